#pragma once

#include <optional>
#include <string>

#include <tandem/lie/so3.hpp>

namespace tandem {

/// Returns the rotation of a Hamilton quaternion x y z w, normalised. Returns nothing if its norm differs from 1 by
/// more than 1e-3.
std::optional<SO3> rotation_from(const double* xyzw);
/// Returns the error message for a quaternion that rotation_from() rejects.
std::string quaternion_error(const double* xyzw);

}  // namespace tandem
