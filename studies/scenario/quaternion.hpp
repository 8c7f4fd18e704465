#pragma once

#include <optional>
#include <string>

#include <tandem/lie/so3.hpp>

namespace tandem {

/// The rotation of a Hamilton quaternion as files write it, x y z w: normalised when its length is within
/// 1e-3 of one, nothing when it is not (not_a_rotation says so in words).
std::optional<SO3> rotation_from(const double* xyzw);
std::string not_a_rotation(const double* xyzw);

}  // namespace tandem
