#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/scenario/quaternion.hpp>

namespace tandem {
namespace {
constexpr double kTolerance = 1e-3;  // of the length
}

std::optional<SO3> rotation_from(const double* xyzw) {
  const SO3::Quaternion q{Eigen::Vector4d(xyzw)};  // Eigen, too, keeps x y z w
  if (!(std::abs(q.norm() - 1.0) <= kTolerance)) return {};
  return SO3(q);
}

std::string not_a_rotation(const double* xyzw) {
  return fmt::format("quaternion {:g} {:g} {:g} {:g} has length {:g}, which must be 1 within {:g}", xyzw[0], xyzw[1],
                     xyzw[2], xyzw[3], Eigen::Vector4d(xyzw).norm(), kTolerance);
}

}  // namespace tandem
