#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace tandem {

/// A setting that has a name, for descriptions in yaml, for the command line and for studies.
template <class Options>
struct NamedParameter {
  std::string name;
  std::string unit;  ///< empty: a word, a share or a factor
  std::string doc;
  /// Reads a value into the options. Throws Error that begins with `where`.
  std::function<void(Options&, const std::string& where, const std::string& text)> set;
  std::function<std::string(const Options&)> text;  ///< the value as `set` takes it, always the same for one value
};

namespace detail {
double number_within(const std::string& where, const std::string& text, double least, double most);
std::string number_text(double value);
std::string parameter_line(const std::string& name, const std::string& unit, const std::string& doc,
                           const std::string& otherwise);
bool switch_of(const std::string& where, const std::string& text);
std::size_t one_of(const std::string& where, const std::string& text, const std::vector<std::string>& words);
[[noreturn]] void no_such_parameter(const std::string& where, const std::string& name,
                                    const std::vector<std::string>& names);
}  // namespace detail

/// A number from `least` to `most`.
template <class Options>
NamedParameter<Options> number_parameter(std::string name, std::string unit, std::string doc, double Options::*value,
                                         double least, double most) {
  return {std::move(name), std::move(unit), std::move(doc),
          [=](Options& options, const std::string& where, const std::string& text) {
            options.*value = detail::number_within(where, text, least, most);
          },
          [=](const Options& options) { return detail::number_text(options.*value); }};
}

/// 0 or 1.
template <class Options>
NamedParameter<Options> switch_parameter(std::string name, std::string doc, bool Options::*value) {
  return {std::move(name), "", std::move(doc),
          [=](Options& options, const std::string& where, const std::string& text) {
            options.*value = detail::switch_of(where, text);
          },
          [=](const Options& options) { return std::string(options.*value ? "1" : "0"); }};
}

/// One of some words, each with what it means.
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

/// Another table's parameter, of options that are a member of these.
template <class Options, class Part>
NamedParameter<Options> parameter_of_part(const NamedParameter<Part>& p, Part Options::*part) {
  return {
      p.name, p.unit, p.doc,
      [=](Options& options, const std::string& where, const std::string& text) { p.set(options.*part, where, text); },
      [=](const Options& options) { return p.text(options.*part); }};
}

/// The one of that name. Throws Error that begins with `where` and names the nearest.
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

/// A line each parameter, for --help.
template <class Options>
std::string parameter_help(const std::vector<NamedParameter<Options>>& parameters) {
  std::string text;
  for (const NamedParameter<Options>& p : parameters)
    text += detail::parameter_line(p.name, p.unit, p.doc, p.text(Options()));
  return text;
}

}  // namespace tandem
