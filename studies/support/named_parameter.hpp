#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace tandem {

/// A named setting that yaml files, command-line options and studies can set.
template <class Options>
struct NamedParameter {
  std::string name;
  std::string unit;  ///< empty for words and dimensionless numbers
  std::string doc;
  /// Parses `text` into the options. Throws Error with a message that starts with `where`.
  std::function<void(Options&, const std::string& where, const std::string& text)> set;
  std::function<std::string(const Options&)> text;  ///< returns the value as canonical text that `set` accepts
};

namespace detail {
double number_within(const std::string& where, const std::string& text, double least, double most);
std::string number_text(double value);
std::string parameter_line(const std::string& name, const std::string& unit, const std::string& doc,
                           const std::string& default_value);
bool switch_of(const std::string& where, const std::string& text);
std::size_t one_of(const std::string& where, const std::string& text, const std::vector<std::string>& words);
[[noreturn]] void no_such_parameter(const std::string& where, const std::string& name,
                                    const std::vector<std::string>& names);
}  // namespace detail

/// Returns a parameter that takes a number in [least, most].
template <class Options>
NamedParameter<Options> number_parameter(std::string name, std::string unit, std::string doc, double Options::*value,
                                         double least, double most) {
  return {std::move(name), std::move(unit), std::move(doc),
          [=](Options& options, const std::string& where, const std::string& text) {
            options.*value = detail::number_within(where, text, least, most);
          },
          [=](const Options& options) { return detail::number_text(options.*value); }};
}

/// Returns a parameter that takes 0 or 1.
template <class Options>
NamedParameter<Options> switch_parameter(std::string name, std::string doc, bool Options::*value) {
  return {std::move(name), "", std::move(doc),
          [=](Options& options, const std::string& where, const std::string& text) {
            options.*value = detail::switch_of(where, text);
          },
          [=](const Options& options) { return std::string(options.*value ? "1" : "0"); }};
}

/// Returns a parameter that takes one of the given words and sets its value.
template <class Options, class Word>
NamedParameter<Options> word_parameter(std::string name, std::string doc, Word Options::*value,
                                       std::vector<std::pair<std::string, Word>> words) {
  std::vector<std::string> names;
  for (const auto& [word, meaning] : words) names.push_back(word);
  return {std::move(name), "", std::move(doc),
          [=](Options& options, const std::string& where, const std::string& text) {
            options.*value = words[detail::one_of(where, text, names)].second;
          },
          [=](const Options& options) {
            for (const auto& [word, meaning] : words)
              if (options.*value == meaning) return word;
            return std::string();
          }};
}

/// Returns a parameter of `Options` that sets a parameter of its member `part`.
template <class Options, class Part>
NamedParameter<Options> parameter_of_part(const NamedParameter<Part>& p, Part Options::*part) {
  return {
      p.name, p.unit, p.doc,
      [=](Options& options, const std::string& where, const std::string& text) { p.set(options.*part, where, text); },
      [=](const Options& options) { return p.text(options.*part); }};
}

/// Returns the parameter with this name. If there is none, throws Error with a message that starts with `where` and
/// suggests the most similar name.
template <class Options>
const NamedParameter<Options>& parameter_named(const std::vector<NamedParameter<Options>>& parameters,
                                               const std::string& where, const std::string& name) {
  std::vector<std::string> names;
  for (const NamedParameter<Options>& p : parameters) {
    if (p.name == name) return p;
    names.push_back(p.name);
  }
  detail::no_such_parameter(where, name, names);
}

/// Returns one line for each parameter with its description, unit and default, for `--help`.
template <class Options>
std::string parameter_help(const std::vector<NamedParameter<Options>>& parameters) {
  std::string text;
  for (const NamedParameter<Options>& p : parameters)
    text += detail::parameter_line(p.name, p.unit, p.doc, p.text(Options()));
  return text;
}

}  // namespace tandem
