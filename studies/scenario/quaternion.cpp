#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/scenario/quaternion.hpp>

namespace tandem {
namespace {
constexpr double kTolerance = 1e-3;  // largest deviation of the norm from 1
}

std::optional<SO3> rotation_from(const double* xyzw) {
  const SO3::Quaternion q{Eigen::Vector4d(xyzw)};  // Eigen stores x y z w
  if (!(std::abs(q.norm() - 1.0) <= kTolerance)) return {};
  return SO3(q);
}

std::string quaternion_error(const double* xyzw) {
  return fmt::format("quaternion {:g} {:g} {:g} {:g} has norm {:g}; it must be 1 within {:g}", xyzw[0], xyzw[1],
                     xyzw[2], xyzw[3], Eigen::Vector4d(xyzw).norm(), kTolerance);
}

}  // namespace tandem
