#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/installation.hpp>
#include <tandem/studies/support/text.hpp>
#include <tandem/version.hpp>

/// The program `tandem`: lists the commands, and runs libexec/tandem/tandem-COMMAND with the same arguments.
namespace tandem {
namespace {

struct CommandInfo {
  std::string name, group, summary;
};

/// Returns all commands of the source tree, built or not, by group. CMake generates the list from the TANDEM_COMMAND
/// lines.
const std::vector<CommandInfo>& commands() {
  static const std::vector<CommandInfo> list = {
#define TANDEM_COMMAND(name, group, summary) {#name, group, summary},
#include <tandem/commands.inc>
#undef TANDEM_COMMAND
  };
  return list;
}

std::filesystem::path program_of(const std::string& command) { return libexec_folder() / ("tandem-" + command); }

bool is_command(const std::string& word) {
  return std::any_of(commands().begin(), commands().end(), [&](const CommandInfo& c) { return c.name == word; });
}

constexpr const char* kSummary = "Joint estimation of a vehicle and the moving target it observes";

int print_help() {
  std::string text = fmt::format("{}\nUsage: tandem COMMAND [OPTIONS]\n", kSummary);
  std::string group;
  for (const CommandInfo& command : commands()) {
    if (command.group != group) text += fmt::format("\n{}:\n", group = command.group);
    text += fmt::format("  {:<11} {}\n", command.name, command.summary);
  }
  text +=
      "\nOptions:\n"
      "  -h, --help  Print this help\n"
      "  --version   Print the version\n"
      "\nExit status: 0 success; 1 invalid input or usage, nothing is written; 2 a solve did not converge, the run was "
      "stopped\nearly, or there is no usable result; 3 the data do not fit the model (with --strict).\n"
      "Use tandem help COMMAND, or tandem COMMAND --help, for the help of a command.\n";
  print(text);
  return 0;
}

/// Prints the list of commands for documentation and shell completion: "words" or "man" (see command_help.hpp).
int print_reference(std::string_view format) {
  std::string text;
  if (format == "man")
    text = fmt::format(
        ".TH TANDEM 1 \"\" Tandem \"User commands\"\n.SH NAME\ntandem \\- {}\n.SH SYNOPSIS\n"
        "tandem COMMAND [OPTIONS]\n.br\ntandem help COMMAND\n",
        kSummary);
  std::string group;
  for (const CommandInfo& command : commands()) {
    if (format == "man" && command.group != group) text += fmt::format(".SH {}\n", group = command.group);
    text += format == "man" ? fmt::format(".TP\n.BR tandem\\-{} (1)\n{}\n", command.name, command.summary)
                            : command.name + "\n";
  }
  print(text);
  return 0;
}

/// Replaces this process by the program of a command. Returns only on failure, with the exit status.
int run(const std::string& command, std::vector<const char*> argv) {
  argv.push_back(nullptr);
  const std::filesystem::path program = program_of(command);
  execv(program.c_str(), const_cast<char* const*>(argv.data()));
  const int reason = errno;
  if (reason != ENOENT) {
    warn(fmt::format("cannot run {}: {}", program.string(), std::strerror(reason)));
  } else if (const auto prefix = installation_folder(); std::filesystem::exists(prefix / "CMakeCache.txt")) {
    warn(fmt::format("tandem {0} is not built; run cmake --build {1} --target tandem-{0}", command,
                     std::filesystem::proximate(prefix).string()));
  } else {
    warn(fmt::format("{}, the program of tandem {}, is missing; reinstall tandem", program.string(), command));
  }
  return 1;
}

int main(int argc, const char* const* argv) {
  std::vector<const char*> words(argv, argv + argc);
  if (argc == 3 && std::string_view(argv[1]) == "help" && is_command(argv[2]))
    return run(argv[2], {argv[0], argv[2], "--help"});
  if (argc == 3 && std::string_view(argv[1]) == "--reference") return print_reference(argv[2]);
  bool help = argc == 1;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--version") {
      print(fmt::format("tandem {}\n", TANDEM_VERSION));
      return 0;
    }
    if (is_command(word)) {
      // `tandem --help estimate` is the same as `tandem estimate --help`.
      std::vector<const char*> arguments = {argv[0]};
      arguments.insert(arguments.end(), argv + i, argv + argc);
      if (help) arguments.push_back("--help");
      return run(word, std::move(arguments));
    }
    if (word == "--help" || word == "-h" || word == "help") {
      help = true;
      continue;
    }
    std::vector<std::string> names;
    for (const CommandInfo& command : commands()) names.push_back(command.name);
    warn(fmt::format("unknown {} {}{}", word.starts_with("-") ? "option" : "command", quote(word),
                     did_you_mean(word, names)));
    return 1;
  }
  if (argc == 1) {
    warn("a command is required (see tandem --help)");
    return 1;
  }
  return print_help();
}

}  // namespace
}  // namespace tandem

int main(int argc, char** argv) {
  tandem::prepare_standard_streams();
  const int status = tandem::main(argc, argv);
  const std::string failure = tandem::output_failure();
  if (failure.empty()) return status;
  tandem::warn(failure);
  return 1;
}
