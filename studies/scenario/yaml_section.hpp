#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>

namespace tandem {

/// A mapping in a yaml file, read key by key. Every error is one sentence that begins with file and line.
class YamlSection {
 public:
  /// What a file holds. Throws Error where it is missing or cannot be read.
  static std::string text_of(const std::filesystem::path& file);
  /// The whole file, which must be a mapping.
  static YamlSection load(const std::filesystem::path& file);
  /// The same of a text, which errors call `file`.
  static YamlSection parse(const std::string& text, const std::filesystem::path& file);

  bool has(const std::string& key) const { return node_[key].IsDefined(); }
  std::vector<std::string> keys() const;
  /// Throws when there is a key that `known` lacks, naming the one it may have been meant for.
  void allow_only(const std::vector<std::string>& known) const;

  std::string text(const std::string& key) const;
  /// A sequence of words; one word alone is a sequence of one.
  std::vector<std::string> texts(const std::string& key) const;
  double number(const std::string& key) const;
  bool boolean(const std::string& key) const;
  /// A sequence of finite numbers; one number alone is a sequence of one.
  std::vector<double> numbers(const std::string& key) const;
  std::vector<double> numbers(const std::string& key, std::size_t count) const;
  YamlSection section(const std::string& key) const;

  /// Throws an error about the line of a key, or of the section itself.
  [[noreturn]] void fail(const std::string& key, const std::string& reason) const;
  [[noreturn]] void fail(const std::string& reason) const;

 private:
  YamlSection(std::filesystem::path file, std::string name, YAML::Node node);
  YAML::Node require(const std::string& key) const;
  double finite(const std::string& key, const YAML::Node& value) const;
  [[noreturn]] void fail_at(const YAML::Mark& mark, const std::string& reason) const;

  std::filesystem::path file_;
  std::string name_;  ///< "" for the file, "noise", "sensor camera", …
  YAML::Node node_;
};

}  // namespace tandem
