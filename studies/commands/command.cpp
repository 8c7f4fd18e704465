#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <deque>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <tandem/problem/stop.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/hand_over.hpp>
#include <tandem/studies/scenario/sensor_file.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/freed_memory.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// What is wrong with a command line, naming the near word where one is unknown.
std::string message(const CLI::ParseError& error, const CLI::App& app) {
  const CLI::App* command = app.get_subcommands().empty() ? &app : app.get_subcommands().front();
  if (const std::vector<std::string> extras = app.remaining(true); !extras.empty()) {
    std::vector<std::string> known;
    for (const CLI::Option* option : command->get_options())
      if (!option->get_group().empty()) known.push_back(option->get_name());
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

/// The command that the words name, which is the first that is one; null where none is.
const ListedCommand* named(const std::vector<ListedCommand>& commands, int argc, const char* const* argv) {
  for (const char* const* word = argv + 1; word < argv + argc; ++word)
    for (const ListedCommand& command : commands)
      if (command.name == *word) return &command;
  return nullptr;
}

}  // namespace

CommandOptions::CommandOptions(CLI::App& app) : app_(app) {}

void CommandOptions::footer(const std::string& text) { app_.footer(text); }

void CommandOptions::argument(const std::string& name, const std::string& takes, const std::string& help,
                              std::string& value) {
  app_.add_option(name, value, help)->type_name(takes)->required();
}

void CommandOptions::arguments(const std::string& name, const std::string& takes, const std::string& help,
                               std::vector<std::string>& values) {
  app_.add_option(name, values, help)->type_name(takes);
}

void CommandOptions::each(const std::string& name, const std::string& takes, const std::string& help, Times times,
                          Set set) {
  // CLI11 calls back while it parses, before it has seen an unknown option or --help: values are read later.
  const auto later = [this, name, set = std::move(set)](const std::vector<std::string>& values) {
    reads_.emplace_back([name, set, values] {
      for (const std::string& text : values) set(name, text);
    });
  };
  CLI::Option* const option = app_.add_option_function<std::vector<std::string>>(name, later, help);
  option->type_name(takes)->group(group_)->allow_extra_args(false);
  if (times != Times::any) option->expected(1);
  if (times == Times::required) option->required();
}

void CommandOptions::flag(const std::string& name, const std::string& help, bool& value) {
  flag(name, help, [&value] { value = true; });
}

void CommandOptions::flag(const std::string& name, const std::string& help, std::function<void()> set) {
  app_.add_flag_callback(
          name, [this, set = std::move(set)] { reads_.push_back(set); }, help)
      ->group(group_);
}

void CommandOptions::hidden(const std::string& name, std::string& value) { app_.add_option(name, value)->group(""); }

std::vector<std::string> CommandOptions::given(const std::string& heading) const {
  std::vector<std::string> names;
  for (const CLI::Option* option : app_.get_options())
    if (option->count() > 0 && option->get_group() == heading) names.push_back(option->get_name());
  return names;
}

void CommandOptions::read(std::vector<std::string> words) {
  words_ = std::move(words);
  for (const std::function<void()>& read : reads_) read();
}

int run_commands(const std::vector<ListedCommand>& commands, int argc, const char* const* argv,
                 const std::string& version) try {
  if (const ListedCommand* const command = named(commands, argc, argv); command && !command->program.empty())
    hand_over(command->name, command->program, argv);
  keep_freed_memory();
  CLI::App app("Joint estimation of a vehicle and the moving target it observes", "tandem");
  app.set_version_flag("--version", "tandem " + version);
  app.require_subcommand(1);
  bool outside = false;
  app.add_flag("--allow-outside", outside, "Before the command: a scenario's files may be outside of its folder");
  struct Entry {
    CLI::App* app;
    CommandOptions options;
    std::function<int()> run;
    bool stops;
    Entry(CLI::App& parent, const ListedCommand& listed)
        : app(parent.add_subcommand(listed.name, listed.summary)),
          options(*app),
          run(listed.program.empty() ? listed.command.prepare(options) : nullptr),
          stops(listed.command.stops) {}
  };
  std::deque<Entry> entries;
  for (const ListedCommand& command : commands) entries.emplace_back(app, command);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    complain(message(error, app));
    return kWrongInput;
  }
  const auto entry = std::find_if(entries.begin(), entries.end(), [](const Entry& e) { return e.app->parsed(); });
  allow_outside_files(outside);
  const auto name = std::find(argv + 1, argv + argc, entry->app->get_name());
  entry->options.read({std::min(name + 1, argv + argc), argv + argc});
  if (entry->stops) stop_on_interrupt();
  const int status = entry->run();
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return status;
  complain(fmt::format("standard output cannot be written: {}", std::strerror(errno)));
  return kWrongInput;
} catch (const Stopped& stopped) {
  complain(stopped.what());
  return kNotDone;
} catch (const std::exception& error) {
  complain(error.what());
  return kWrongInput;
}

}  // namespace tandem
