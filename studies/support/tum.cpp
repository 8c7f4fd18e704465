#include <fmt/format.h>

#include <tandem/studies/support/tum.hpp>

namespace tandem {

std::string tum_row(double t, const Vector<3>& p, const std::optional<SO3>& orientation,
                    const std::optional<TumDecimals>& decimals) {
  const Vector<4> q = orientation.value_or(SO3()).quaternion().coeffs();
  std::string row = orientation ? "" : std::string(tum_no_orientation) + '\n';
  if (!decimals) return row + fmt::format("{} {} {} {} {} {} {} {}\n", t, p[0], p[1], p[2], q[0], q[1], q[2], q[3]);
  return row + fmt::format("{:.{}f} {:.{}f} {:.{}f} {:.{}f} {:.{}f} {:.{}f} {:.{}f} {:.{}f}\n", t, decimals->time, p[0],
                           decimals->position, p[1], decimals->position, p[2], decimals->position, q[0],
                           decimals->quaternion, q[1], decimals->quaternion, q[2], decimals->quaternion, q[3],
                           decimals->quaternion);
}

std::string tum_row(double t, const SE3& pose, const std::optional<TumDecimals>& decimals) {
  return tum_row(t, pose.translation(), pose.rotation(), decimals);
}

}  // namespace tandem
