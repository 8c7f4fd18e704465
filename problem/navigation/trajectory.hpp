#pragma once

#include <optional>
#include <vector>

#include <tandem/lie/sek3.hpp>

namespace tandem {

/// Times closer than this count as equal [s].
inline constexpr double kSameInstant = 1e-3;

/// A value with a time t [s].
template <class T>
struct Stamped {
  double t;
  T value;
};

/// Returns the pose at time t of a trajectory in time order, interpolated on SE(3). Returns nullopt outside of its time
/// span; within kSameInstant of the span, returns the pose at its end.
std::optional<SE3> pose_at(const std::vector<Stamped<SE3>>& trajectory, double t);

}  // namespace tandem
