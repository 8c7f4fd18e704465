#include <algorithm>

#include <tandem/lie/operations.hpp>
#include <tandem/problem/navigation/trajectory.hpp>

namespace tandem {

std::optional<SE3> pose_at(const std::vector<Stamped<SE3>>& trajectory, double t) {
  if (trajectory.empty() || t < trajectory.front().t - kSameInstant || t > trajectory.back().t + kSameInstant)
    return {};
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), t,
                                      [](const Stamped<SE3>& pose, double time) { return pose.t < time; });
  if (after == trajectory.begin()) return trajectory.front().value;
  if (after == trajectory.end()) return trajectory.back().value;
  const auto before = after - 1;
  return interpolate(before->value, after->value, (t - before->t) / (after->t - before->t));
}

}  // namespace tandem
