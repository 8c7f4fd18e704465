#include <tandem/studies/commands/command_list.hpp>

/// The program `tandem`.
int main(int argc, char** argv) {
  using namespace tandem;
  return run_commands({TANDEM_COMMANDS(TANDEM_OWN, TANDEM_OF_MORE)}, argc, argv, TANDEM_VERSION);
}
