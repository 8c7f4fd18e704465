#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include <yaml-cpp/yaml.h>

namespace tandem {

/// A mapping in a yaml file, read key by key. The readers throw Error if a key is missing or its value has the wrong
/// type. Every message is one sentence that starts with file and line.
class YamlSection {
 public:
  /// Returns the top level of a file, which must be a mapping.
  static YamlSection load(const std::filesystem::path& file);
  /// Returns the top level of a text; `file` is its name in error messages.
  static YamlSection parse(const std::string& text, const std::filesystem::path& file);

  bool has(const std::string& key) const { return values_.contains(key); }
  std::vector<std::string> keys() const;
  /// Throws Error if there is a key that is not in `known`, and suggests a similar one.
  void allow_only(const std::vector<std::string>& known) const;

  std::string text(const std::string& key) const;
  /// Returns the words of a list, or a single word.
  std::vector<std::string> texts(const std::string& key) const;
  double number(const std::string& key) const;
  bool boolean(const std::string& key) const;
  /// Returns the finite numbers of a list, or a single number.
  std::vector<double> numbers(const std::string& key) const;
  /// Returns a list of `count` finite numbers.
  std::vector<double> numbers(const std::string& key, std::size_t count) const;
  YamlSection section(const std::string& key) const;
  /// Returns whether the value of a key consists of KEY: VALUE entries.
  bool is_mapping(const std::string& key) const { return node_[key].IsMap(); }
  /// Returns the value of a key as yaml on one line, for example "{sigma: [1, 2], time: 20}".
  std::string line(const std::string& key) const;

  /// Returns "FILE:LINE" of a key.
  std::string place(const std::string& key) const;
  /// Throws Error with the line of a key, or of the section itself.
  [[noreturn]] void fail(const std::string& key, const std::string& reason) const;
  [[noreturn]] void fail(const std::string& reason) const;

 private:
  YamlSection(std::filesystem::path file, std::string name, YAML::Node node);
  YAML::Node require(const std::string& key) const;
  double finite(const std::string& key, const YAML::Node& value) const;
  std::string place_of(const YAML::Mark& mark) const;
  [[noreturn]] void fail_at(const YAML::Mark& mark, const std::string& reason) const;

  std::filesystem::path file_;
  std::string name_;  ///< "" for the file, "noise", "sensor camera", …
  YAML::Node node_;
  std::unordered_map<std::string, YAML::Node> values_;
};

/// Returns a text as a YAML scalar: as it is if it is a plain word or number, otherwise in double quotes.
std::string yaml_text(const std::string& text);

}  // namespace tandem
