#include <algorithm>
#include <filesystem>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/run_file.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// The command whose run files have a model for all commands.
constexpr const char* kTuned = "tune";

const OptionInfo* find(const CommandOptions& options, const std::string& word) {
  const std::string name = word.substr(0, word.find('='));
  for (const OptionInfo& option : options.infos())
    for (const std::string_view part : split(option.name, ','))
      if (!option.positional && part == name) return &option;
  return nullptr;
}

/// The options that a command line gives; an empty key means a positional argument.
std::set<std::string> given_keys(const CommandOptions& options, const std::vector<std::string>& words) {
  std::set<std::string> keys;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (!words[i].starts_with('-')) {
      keys.insert("");
    } else if (const OptionInfo* const option = find(options, words[i])) {
      keys.insert(option->key());
      if (!option->takes.empty() && words[i].find('=') == std::string::npos) ++i;
    }
  }
  return keys;
}

/// Returns the value of --config and removes it from the words; empty if there is none.
std::string take_config(std::vector<std::string>& words) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i].starts_with("--config=")) {
      const std::string file = words[i].substr(9);
      words.erase(words.begin() + std::ptrdiff_t(i));
      return file;
    }
    if (words[i] == "--config" && i + 1 < words.size()) {
      const std::string file = words[i + 1];
      words.erase(words.begin() + std::ptrdiff_t(i), words.begin() + std::ptrdiff_t(i) + 2);
      return file;
    }
  }
  return {};
}

/// Makes an existing relative path absolute. The name of a built-in scenario, study or vehicle is not a path, even if a
/// folder has this name and the option takes a file.
std::string located(const OptionInfo& option, const std::string& value) {
  const auto takes = [&](const char* word) { return option.takes.find(word) != std::string::npos; };
  std::error_code error;
  const bool file = takes("FILE") && std::filesystem::is_regular_file(value, error);
  const bool folder = (takes("SCENARIO") || takes("DIR")) && std::filesystem::is_directory(value, error) &&
                      (!takes("FILE") || value.find('/') != std::string::npos);
  return file || folder ? std::filesystem::absolute(value, error).lexically_normal().string() : value;
}

bool is_in_run_files(const OptionInfo& option) {
  const std::string key = option.key();
  return key != "config" && key != "print-config";
}

}  // namespace

std::vector<std::string> with_run_file(const std::string& command, CommandOptions& options,
                                       std::vector<std::string> words) {
  const std::string file = take_config(words);
  if (file.empty()) return words;
  if (!std::filesystem::exists(file)) throw Error(fmt::format("--config {}: there is no such file", printable(file)));
  const YamlSection yaml = YamlSection::load(file);
  std::vector<std::string> known = {"command"};
  for (const OptionInfo& option : options.infos())
    if (is_in_run_files(option)) known.push_back(option.key());
  const bool tuned = yaml.has("command") && yaml.text("command") == kTuned;
  if (yaml.has("command") && yaml.text("command") != command && !tuned)
    yaml.fail("command",
              fmt::format("this run file is for tandem {}, not for tandem {}", yaml.text("command"), command));
  if (!tuned || command == kTuned) {
    yaml.allow_only(known);
  } else {
    for (const std::string& key : yaml.keys())
      if (std::find(known.begin(), known.end(), key) == known.end())
        warn(fmt::format("{}: tandem {} has no option --{}, so this part of the tuned model is not used",
                         yaml.place(key), command, key));
  }

  const std::set<std::string> replaced = given_keys(options, words);
  std::vector<std::string> result;
  for (const OptionInfo& option : options.infos()) {
    const std::string key = option.key();
    if (!yaml.has(key) || replaced.contains(option.positional ? "" : key)) continue;
    options.set_place(key, yaml.place(key));
    if (option.positional) {
      for (const std::string& value : yaml.texts(key)) result.push_back(value);
    } else if (option.takes.empty()) {
      if (yaml.boolean(key)) result.push_back("--" + key);
    } else if (option.repeatable) {
      for (const std::string& value : yaml.texts(key)) result.push_back(fmt::format("--{}={}", key, value));
    } else {
      result.push_back(fmt::format("--{}={}", key, fmt::join(yaml.texts(key), ",")));
    }
  }
  result.insert(result.end(), words.begin(), words.end());
  return result;
}

std::string run_file(const std::string& command, const std::string& version, const CommandOptions& options,
                     const std::map<std::string, std::vector<std::string>>& replaced) {
  std::string text = fmt::format("# Written by tandem {}. To repeat this run: tandem {} --config run.yaml --out DIR\n",
                                 version, command);
  text += fmt::format("command: {}\n", command);
  const auto write = [&text](const OptionInfo& option, const std::vector<std::string>& values) {
    const std::string key = option.key();
    if (!is_in_run_files(option) || key == "out") return;
    if (option.takes.empty()) {
      text += fmt::format("{}: true\n", key);
      return;
    }
    std::vector<std::string> quoted;
    for (const std::string& value : values) quoted.push_back(yaml_text(located(option, value)));
    text += option.repeatable ? fmt::format("{}: [{}]\n", key, fmt::join(quoted, ", "))
                              : fmt::format("{}: {}\n", key, fmt::join(quoted, ""));
  };
  for (const auto& [option, values] : options.given())
    if (!replaced.contains(option.key())) write(option, values);
  for (const OptionInfo& option : options.infos())
    if (const auto at = replaced.find(option.key()); at != replaced.end() && !at->second.empty())
      write(option, at->second);
  return text;
}

}  // namespace tandem
