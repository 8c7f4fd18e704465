#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <tandem/problem/stop.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/command_help.hpp>
#include <tandem/studies/commands/run_file.hpp>
#include <tandem/studies/scenario/sensor_file.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/freed_memory.hpp>
#include <tandem/studies/support/output_folder.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Returns the message for an invalid command line, with a suggestion for an unknown word.
std::string message(const CLI::ParseError& error, const CLI::App& app) {
  const CLI::App* command = app.get_subcommands().empty() ? &app : app.get_subcommands().front();
  if (const std::vector<std::string> extras = app.remaining(true); !extras.empty()) {
    std::vector<std::string> known;
    for (const CLI::Option* option : command->get_options())
      if (!option->get_group().empty()) known.push_back(option->get_name());
    known.insert(known.end(), {"--help", "--help-all"});
    for (const CLI::App* subcommand : command->get_subcommands({})) known.push_back(subcommand->get_name());
    const std::string word = extras.front().substr(0, extras.front().find('='));
    const char* const kind = word.starts_with("-") ? "option" : command == &app ? "command" : "argument";
    return fmt::format("unknown {} {}{}", kind, quote(word), did_you_mean(word, known));
  }
  const std::string text = error.what();
  const std::string help = command == &app ? "tandem --help" : "tandem " + command->get_name() + " --help";
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error)) {
    const bool repeated = text.find("At Most") != std::string::npos;
    return fmt::format("{} {} (see {})", text.substr(0, text.find(':')), repeated ? "is given twice" : "needs a value",
                       help);
  }
  return fmt::format("{} (see {})", text, help);
}

/// Options of every command.
struct CommonOptions {
  bool allow_outside = false, print_config = false;
  std::string config;
};

void add_common(CommandOptions& option, CommonOptions& common) {
  option.group("Common");
  const auto text = [](const std::string&, const std::string& value) { return value; };
  option("--config", "FILE", "Read options from a run file; other options override it", common.config, text);
  option.flag("--print-config", "Print these options as a run file and exit", common.print_config);
  option.advanced();
  option.flag("--allow-outside", "Allow sensor files outside the scenario folder", common.allow_outside);
}

}  // namespace

int run_command(const NamedCommand& command, int argc, const char* const* argv, const std::string& version) try {
  keep_freed_memory();
  CLI::App app("Joint estimation of a vehicle and the moving target it observes", "tandem");
  app.set_version_flag("--version", "tandem " + version);
  app.set_help_flag();
  app.require_subcommand(1);
  CLI::App* const subcommand = app.add_subcommand(command.name, command.summary);
  subcommand->set_help_flag();
  CommandOptions options(*subcommand);
  const std::function<int()> run = command.command.prepare(options);
  CommonOptions common;
  add_common(options, common);
  // `tandem NAME …`, or `tandem-NAME …` of a program that is called directly.
  const int first = argc > 1 && argv[1] == command.name ? 2 : 1;
  std::vector<std::string> words(argv + first, argv + argc);
  if (const std::optional<std::string> help = requested_help(command, options, words)) {
    fmt::print("{}", *help);
    return kSuccess;
  }
  words = with_run_file(command.name, options, std::move(words));
  std::vector<const char*> arguments = {"tandem", command.name.c_str()};
  for (const std::string& word : words) arguments.push_back(word.c_str());
  try {
    app.parse(static_cast<int>(arguments.size()), arguments.data());
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --version
    warn(message(error, app));
    return kInvalidInput;
  }
  options.read(words);
  if (common.print_config) {
    fmt::print("{}", run_file(command.name, version, options));
    return kSuccess;
  }
  allow_outside_files(common.allow_outside);
  set_run_file(run_file(command.name, version, options));
  if (command.command.stops) stop_on_interrupt();
  const int status = run();
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return status;
  warn(fmt::format("cannot write to standard output: {}", std::strerror(errno)));
  return kInvalidInput;
} catch (const Stopped& stopped) {
  warn(stopped.what());
  return kIncomplete;
} catch (const std::exception& error) {
  warn(error.what());
  return kInvalidInput;
}

}  // namespace tandem
