#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/command_line.hpp>

// Every command, in the order of `tandem --help`; each is defined in a file of its name.
#define TANDEM_COMMANDS(command)                                                                                       \
  command(estimate) command(navigate) command(track) command(compare) command(models) command(calibrate) command(plan) \
      command(rendezvous) command(study) command(report) command(demo) command(simulate) command(scenarios)

namespace tandem {

#define TANDEM_DECLARE(name) Command name##_command();
TANDEM_COMMANDS(TANDEM_DECLARE)

int run_command_line(int argc, const char* const* argv, const std::string& version) {
#define TANDEM_CALL(name) name##_command(),
  return run_commands({TANDEM_COMMANDS(TANDEM_CALL)}, argc, argv, version);
}

}  // namespace tandem
