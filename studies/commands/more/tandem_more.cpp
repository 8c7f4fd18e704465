#include <tandem/studies/commands/command_list.hpp>

/// The program `tandem-more`, to which `tandem` hands commands over that are not its own.
int main(int argc, char** argv) {
  using namespace tandem;
  return run_commands({TANDEM_COMMANDS(TANDEM_OF_TANDEM, TANDEM_OWN)}, argc, argv, TANDEM_VERSION);
}
