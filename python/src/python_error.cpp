#include "python_error.hpp"

namespace tandem::python {

std::string PythonError::summary(const py::error_already_set& error) {
  std::string text = py::str(error.type().attr("__name__"));
  const std::string value = py::str(error.value());
  return value.empty() ? text : text + ": " + value;
}

void PythonError::raise() const {
  const py::object type = exception_class("ResidualError");
  py::error_already_set cause(*error_);
  const bool named = cause.matches(type);  // raised by the package itself
  cause.restore();
  if (!named) py::raise_from(type.ptr(), what());
  throw py::error_already_set();
}

py::object exception_class(const char* name) { return py::module_::import("tandem.errors").attr(name); }

void raise(const char* name, const std::string& message) {
  PyErr_SetString(exception_class(name).ptr(), message.c_str());
  throw py::error_already_set();
}

void bind_errors(py::module_&) {
  py::register_exception_translator([](std::exception_ptr thrown) {
    const auto set = [](const char* name, const std::exception& error) {
      PyErr_SetString(exception_class(name).ptr(), error.what());
    };
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const NotObservableError& error) {
      const py::object type = exception_class("NotObservableError");
      PyErr_SetObject(type.ptr(), type(error.what(), error.states()).ptr());
    } catch (const UndefinedResidualError& error) {
      set("UndefinedResidualError", error);
    } catch (const NumericalError& error) {
      set("NumericalError", error);
    } catch (const StaleHandleError& error) {
      set("StaleHandleError", error);
    } catch (const BadInputError& error) {
      set("BadInputError", error);
    } catch (const Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
    } catch (const Stopped& error) {
      set("Stopped", error);
    } catch (const Error& error) {
      set("Error", error);
    } catch (const PythonError& error) {
      try {
        error.raise();
      } catch (py::error_already_set& raised) {
        raised.restore();
      }
    }
  });
}

}  // namespace tandem::python
