#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <typeinfo>

#include <pybind11/pybind11.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/stop.hpp>

namespace tandem::python {

namespace py = pybind11;

/// An exception of a Python function on its way through a solver. Threads without the interpreter's lock may copy and
/// destroy it.
class PythonError : public std::runtime_error {
 public:
  /// Takes the exception that is being handled. `source` is the function that raised it, for the message. The caller
  /// holds the lock.
  PythonError(const std::string& source, const py::error_already_set& error)
      : std::runtime_error(source + " raised " + summary(error)),
        error_(new py::error_already_set(error), [](py::error_already_set* e) {
          if (!Py_IsInitialized()) return;
          const py::gil_scoped_acquire lock;
          delete e;
        }) {}

  /// Raises tandem.ResidualError with the original exception as its cause. The caller holds the lock.
  [[noreturn]] void raise() const;

 private:
  static std::string summary(const py::error_already_set& error);

  std::shared_ptr<py::error_already_set> error_;
};

/// Ctrl-C within a Python function that no solver has called, on its way to KeyboardInterrupt.
class Interrupted : public Stopped {
 public:
  using Stopped::Stopped;
};

/// Returns f(). Converts a plain Error, which readers throw, to BadInputError.
template <class F>
auto checked_input(F f) {
  try {
    return f();
  } catch (const Error& error) {
    if (typeid(error) == typeid(Error)) throw BadInputError(error.what());
    throw;
  }
}

/// Returns a class of tandem.errors.
py::object exception_class(const char* name);
/// Raises an exception of tandem.errors.
[[noreturn]] void raise(const char* name, const std::string& message);
/// Converts C++ exceptions to those of tandem.errors.
void bind_errors(py::module_& m);

}  // namespace tandem::python
