#include <tandem/studies/commands/command.hpp>
#include <tandem/version.hpp>

/// The program `tandem-NAME`, which `tandem NAME` runs.
int main(int argc, char** argv) { return tandem::run_command(tandem::this_command(), argc, argv, TANDEM_VERSION); }
