#pragma once

#include <pybind11/eigen.h>

#include "residual_family.hpp"

namespace tandem::python {

/// Returns a residual of the library as the family of this name makes it in Python.
template <Residual R>
FamilyResidual in_python(const std::string& family, R residual) {
  const auto value = []<class T>(const T& member) {
    if constexpr (LieGroup<T>)
      return py::cast(Elements<T>{{member}, true});
    else
      return py::cast(member);
  };
  return {&families().at(family),
          std::apply([&](const auto&... members) { return std::vector<py::object>{value(members)...}; },
                     leaves(residual))};
}

}  // namespace tandem::python
