#pragma once

#include <optional>
#include <string>

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <tandem/lie/error.hpp>

#include "bind_group.hpp"

namespace tandem::python {

/// Sets options from keyword arguments: options("name", member). finish() then rejects the names that are left.
class Options {
 public:
  /// `owner` begins the messages, for example "ipopt".
  Options(std::string owner, const py::dict& given) : owner_(std::move(owner)), given_(given) {}

  template <class T>
  void operator()(const char* name, T& value) {
    const py::object given = find(name);
    if (!given) return;
    try {
      value = given.cast<T>();
    } catch (const py::cast_error&) {
      throw_wrong(name, given);
    }
  }
  /// A dictionary of texts or numbers.
  void operator()(const char* name, std::map<std::string, std::string>& value);
  template <int N>
  void operator()(const char* name, Vector<N>& value) {
    const py::object given = find(name);
    if (!given) return;
    const Batch numbers = batch(given, {N}, owner_ + ": option " + name);
    if (!numbers.single) throw_wrong(name, given);
    value = Eigen::Map<const Vector<N>>(numbers.data());
  }
  template <LieGroup G>
  void operator()(const char* name, G& value) {
    const py::object given = find(name);
    if (!given) return;
    if (!py::isinstance<Elements<G>>(given) || !given.cast<const Elements<G>&>().single) throw_wrong(name, given);
    value = given.cast<const Elements<G>&>()[0];
  }
  /// An option with named values, as a NamedValue.
  template <class T, class Values>
  void operator()(const char* name, T& value, const Values& values) {
    std::string text, all;
    (*this)(name, text);
    if (text.empty()) return;
    for (const auto& choice : values) {
      if (text == choice.name) {
        value = choice.value;
        return;
      }
      all += (all.empty() ? "" : ", ") + std::string(choice.name);
    }
    throw BadInputError(owner_ + ": option " + name + " is one of " + all + ", not " + text);
  }
  /// Throws TypeError with the names of all options if a keyword argument is none of them.
  void finish() const;

 private:
  /// Returns the value of an option, or null.
  py::object find(const char* name);
  [[noreturn]] void throw_wrong(const char* name, const py::object& given) const;

  std::string owner_, known_;
  const py::dict& given_;
  std::size_t used_ = 0;
};

}  // namespace tandem::python
