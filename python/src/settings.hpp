#pragma once

#include <pybind11/pybind11.h>

namespace tandem::python {

namespace py = pybind11;

/// Binds the reader of scenario.yaml.
void bind_settings(py::module_& m);

}  // namespace tandem::python
