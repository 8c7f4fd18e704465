#include <algorithm>
#include <filesystem>
#include <new>
#include <system_error>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <tandem/problem/stop.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/command_help.hpp>
#include <tandem/studies/commands/run_file.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/freed_memory.hpp>
#include <tandem/studies/support/input_file.hpp>
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
  option.flag("--allow-outside",
              "Read files that are outside the scenario or result folder, or links that lead out of it",
              common.allow_outside);
}

/// Returns the names of the files that a command may write to its output folder.
std::vector<std::string> result_files(const Command& command) {
  std::vector<std::string> names = {"run.yaml"};
  if (!command.files) return names;
  for (const FileDescription& description : command.files())
    for (const std::string_view name : split(description.file, ','))
      if (!name.starts_with("--")) names.emplace_back(trimmed(name));
  return names;
}

/// Parses the command line and runs the command.
int parse_and_run(const NamedCommand& command, int argc, const char* const* argv, const std::string& version) {
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
    print(*help);
    return kSuccess;
  }
  words = with_run_file(command.name, options, std::move(words));
  std::vector<const char*> arguments = {"tandem", command.name.c_str()};
  for (const std::string& word : words) arguments.push_back(word.c_str());
  try {
    app.parse(static_cast<int>(arguments.size()), arguments.data());
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {
      print("tandem " + version + "\n");
      return kSuccess;
    }
    warn(message(error, app));
    return kInvalidInput;
  }
  options.set_result_files(result_files(command.command));
  options.read(words);
  if (common.print_config) {
    print(run_file(command.name, version, options));
    return kSuccess;
  }
  allow_outside_files(common.allow_outside);
  set_run_file(run_file(command.name, version, options));
  if (command.command.stops) stop_on_interrupt();
  return run();
}

/// Runs parse_and_run() and reports its exceptions.
int run_and_report(const NamedCommand& command, int argc, const char* const* argv, const std::string& version) try {
  return parse_and_run(command, argc, argv, version);
} catch (const Stopped& stopped) {
  warn(stopped.what());
  return kIncomplete;
} catch (const std::bad_alloc&) {
  warn("there is not enough memory for this run; shorten the recording (--max-keyframes) or free memory");
  return kInvalidInput;
} catch (const std::filesystem::filesystem_error& error) {
  warn(fmt::format("{}: {}", error.path1().string(), error.code().message()));
  return kInvalidInput;
} catch (const std::system_error& error) {  // e.g. no thread can be started
  warn(fmt::format("a call of the operating system failed: {}", error.code().message()));
  return kInvalidInput;
} catch (const std::exception& error) {
  warn(error.what());
  return kInvalidInput;
}

}  // namespace

int run_command(const NamedCommand& command, int argc, const char* const* argv, const std::string& version) {
  prepare_standard_streams();
  keep_freed_memory();
  const int status = run_and_report(command, argc, argv, version);
  const std::string failure = output_failure();
  if (failure.empty() || status == kInvalidInput) return status;
  warn(failure);
  return kInvalidInput;
}

}  // namespace tandem
