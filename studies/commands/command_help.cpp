#include <algorithm>
#include <cctype>
#include <cstdlib>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>
#include <sys/ioctl.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command_help.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kMinIndent = 16, kMaxIndent = 34;  // column of the descriptions
const std::string kArguments = "Arguments";
constexpr std::size_t kDefaultWidth = 100, kMinWidth = 60;

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

std::string uppercase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::toupper(c)); });
  return text;
}

std::size_t terminal_width() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0)
    return std::max<std::size_t>(size.ws_col, kMinWidth);
  const char* const columns = std::getenv("COLUMNS");
  const std::optional<int> width = columns ? parse_positive_integer(columns) : std::nullopt;
  return width ? std::max(std::size_t(*width), kMinWidth) : kDefaultWidth;
}

/// Returns "-o, --out DIR", or "SCENARIO" of a positional argument.
std::string signature(const OptionInfo& option) {
  if (option.positional) return option.takes;
  std::string name = option.name;
  if (const std::size_t comma = name.find(','); comma != std::string::npos) name.replace(comma, 1, ", ");
  return option.takes.empty() ? name : fmt::format("{} {}", name, option.takes);
}

std::string usage(const NamedCommand& command, const CommandOptions& options) {
  std::string text = fmt::format("tandem {}", command.name);
  for (const OptionInfo& option : options.infos())
    if (option.positional) text += option.required ? " " + option.takes : fmt::format(" [{}...]", option.takes);
  return text + " [OPTIONS]";
}

/// Calls f(heading, options) for each group in the order of registration; positional arguments come first.
template <class F>
void for_each_group(const CommandOptions& options, bool all, F f) {
  std::vector<std::string> groups;
  for (const OptionInfo& option : options.infos())
    if (std::find(groups.begin(), groups.end(), option.group) == groups.end()) groups.push_back(option.group);
  std::stable_partition(groups.begin(), groups.end(), [](const std::string& group) { return group.empty(); });
  for (const std::string& group : groups) {
    std::vector<const OptionInfo*> members;
    for (const OptionInfo& option : options.infos())
      if (option.group == group && (all || !option.advanced)) members.push_back(&option);
    std::stable_partition(members.begin(), members.end(), [](const OptionInfo* option) { return !option->advanced; });
    if (!members.empty()) f(group.empty() ? kArguments : group, members);
  }
}

/// Returns the explanations after the options.
std::string notes(const CommandOptions& options, bool all, std::size_t width) {
  std::string text;
  for (const std::string& part : {options.footer(), all ? options.details() : "", options.exit_status()})
    if (!part.empty()) text += (all ? "\n" : "") + wrapped(part, width) + "\n";
  return text;
}

/// Returns the text of --help, which should fit on one screen, or of --help-all.
std::string help_text(const NamedCommand& command, const CommandOptions& options, bool all) {
  const std::size_t width = terminal_width();
  std::size_t indent = kMinIndent;
  bool hidden = false;
  for (const OptionInfo& option : options.infos()) {
    hidden = hidden || option.advanced;
    if (all || !option.advanced) indent = std::max(indent, signature(option).size() + 4);
  }
  indent = std::min({indent, kMaxIndent, width / 2});
  std::string text = wrapped(fmt::format("{}\nUsage: {}\n", command.summary, usage(command, options)), width);
  const auto add = [&](const std::string& left, std::string_view help) {
    const bool own_line = left.size() + 4 > indent;
    text += own_line ? fmt::format("  {}\n{:{}}", left, "", indent) : fmt::format("  {:<{}}", left, indent - 2);
    text += wrapped(std::string(indent, ' ') + std::string(help), width, indent).substr(indent) + "\n";
  };
  for_each_group(options, all, [&](const std::string& heading, const std::vector<const OptionInfo*>& members) {
    if (all || heading != kArguments) text += fmt::format("{}{}:\n", all ? "\n" : "", heading);
    for (const OptionInfo* option : members) add(signature(*option), all ? option->help : first_sentence(option->help));
    if (heading != "Common") return;
    add("-h, --help", "Print this help");
    if (hidden) add("--help-all", "Print all options with full descriptions");
  });
  return text + notes(options, all, width);
}

std::string markdown_escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '|' || c == '<' || c == '*' || c == '_') result += '\\';
    result += c;
  }
  return result;
}

std::string markdown(const NamedCommand& command, const CommandOptions& options) {
  std::string text = fmt::format("{}.\n\n    {}\n", command.summary, usage(command, options));
  for_each_group(options, true, [&](const std::string& heading, const std::vector<const OptionInfo*>& members) {
    text += fmt::format("\n| {} | |\n| --- | --- |\n", heading);
    for (const OptionInfo* option : members)
      text += fmt::format("| `{}` | {} |\n", replaced(signature(*option), "|", "\\|"), markdown_escaped(option->help));
  });
  text += fmt::format("\n```text{}```\n", notes(options, true, kDefaultWidth));
  return text;
}

std::string roff_escaped(const std::string& text) {
  std::string result = replaced(replaced(text, "\\", "\\e"), "-", "\\-");
  return result.starts_with('.') || result.starts_with('\'') ? "\\&" + result : result;
}

std::string man_page(const NamedCommand& command, const CommandOptions& options) {
  std::string text = fmt::format(
      ".TH TANDEM-{} 1 \"\" Tandem \"User commands\"\n.SH NAME\ntandem-{} \\- {}\n.SH SYNOPSIS\n{}\n",
      uppercase(command.name), command.name, roff_escaped(command.summary), roff_escaped(usage(command, options)));
  for_each_group(options, true, [&](const std::string& heading, const std::vector<const OptionInfo*>& members) {
    text += fmt::format(".SH {}\n", uppercase(heading));
    for (const OptionInfo* option : members)
      text += fmt::format(".TP\n{}\n{}\n", roff_escaped(signature(*option)), roff_escaped(option->help));
  });
  text += ".SH NOTES\n.nf\n";
  const std::string explanations = notes(options, true, 78);
  for (const std::string_view line : split(trimmed(explanations), '\n')) text += roff_escaped(std::string(line)) + "\n";
  text += ".fi\n";
  return text;
}

/// Returns `x`, `y`, `z`, or `c11` … `c66` for more than six names.
std::string listed_names(const std::vector<std::string>& names) {
  if (names.size() > 6) return fmt::format("`{}` … `{}`", names.front(), names.back());
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "`" : ", `") + name + "`";
  return text;
}

/// Returns the table of the contents of a file, with one row for successive columns of the same description.
std::string file_table(const FileDescription& file) {
  std::string text = fmt::format("| {} | description |\n| --- | --- |\n", file.kind);
  for (std::size_t i = 0; i < file.columns.size();) {
    std::vector<std::string> names;
    const std::string& description = file.columns[i].second;
    while (i < file.columns.size() && file.columns[i].second == description) names.push_back(file.columns[i++].first);
    text += fmt::format("| {} | {} |\n", listed_names(names), markdown_escaped(description));
  }
  return text;
}

/// Returns the table of one file, or the names of all files if `name` is empty.
std::string files_reference(const NamedCommand& command, const std::string& name) {
  std::string names;
  if (command.command.files)
    for (const FileDescription& file : command.command.files()) {
      if (file.file == name) return file_table(file);
      names += file.file + "\n";
    }
  if (!name.empty()) throw Error(fmt::format("tandem {} describes no file {}", command.name, quote(name)));
  return names;
}

std::string words(const CommandOptions& options) {
  std::string text = "--help\n--help-all\n";
  for (const OptionInfo& option : options.infos())
    if (!option.positional) text += "--" + option.key() + "\n";
  return text;
}

/// Returns the options as JSON, from which the Python package generates its functions.
std::string json(const NamedCommand& command, const CommandOptions& options) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const OptionInfo& option : options.infos())
    list.push_back({{"name", option.key()},
                    {"takes", option.takes},
                    {"help", option.help},
                    {"group", option.group},
                    {"positional", option.positional},
                    {"required", option.required},
                    {"repeatable", option.repeatable}});
  const nlohmann::ordered_json text = {
      {"command", command.name}, {"summary", command.summary}, {"options", std::move(list)}};
  return text.dump() + "\n";
}

}  // namespace

std::optional<std::string> requested_help(const NamedCommand& command, const CommandOptions& options,
                                          const std::vector<std::string>& given) {
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (given[i] == "--help-all") return help_text(command, options, true);
    if (given[i] == "-h" || given[i] == "--help") return help_text(command, options, false);
    if (given[i] != "--reference" || i + 1 == given.size()) continue;
    if (given[i + 1] == "markdown") return markdown(command, options);
    if (given[i + 1] == "man") return man_page(command, options);
    if (given[i + 1] == "words") return words(options);
    if (given[i + 1] == "json") return json(command, options);
    if (given[i + 1] == "files") {
      const auto file = given.begin() + std::min(std::ptrdiff_t(i) + 2, std::ptrdiff_t(given.size()));
      return files_reference(command, fmt::format("{}", fmt::join(file, given.end(), " ")));
    }
  }
  return {};
}

}  // namespace tandem
