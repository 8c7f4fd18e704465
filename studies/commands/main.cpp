#include <tandem/studies/commands/command_line.hpp>

int main(int argc, char** argv) { return tandem::run_command_line(argc, argv, TANDEM_VERSION); }
