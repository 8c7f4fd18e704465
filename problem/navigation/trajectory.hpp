#pragma once

#include <optional>
#include <vector>

#include <tandem/lie/sek3.hpp>

namespace tandem {

/// Times closer than this are one [s].
inline constexpr double kSameInstant = 1e-3;

/// A value at an instant [s].
template <class T>
struct Stamped {
  double t;
  T value;
};

/// The pose at time t of a trajectory in time order, interpolated on SE(3); nothing outside its span (with 1
/// ms to spare, within which the end holds).
std::optional<SE3> pose_at(const std::vector<Stamped<SE3>>& trajectory, double t);

}  // namespace tandem
