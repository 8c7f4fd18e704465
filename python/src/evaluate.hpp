#pragma once

#include "residual_family.hpp"

namespace tandem::python {

/// Returns the rows of a residual at group elements, or (rows, [Jacobians]) with `jacobians`. Elements may be arrays.
py::object evaluate(const FamilyResidual& residual, const py::args& states, bool jacobians);

}  // namespace tandem::python
