#pragma once

#include <cmath>
#include <cstddef>

#include <tandem/problem/tracking/target_sensor.hpp>

namespace tandem::detail {

/// Returns the least time [s] before and after a measurement in which the motion is evaluated to estimate its delay.
///
/// The unit of the window is the prior standard deviation of the delay. A longer window smooths out turns between
/// keyframes: with 12, a true delay is estimated 3 % too long (SensorConstants tests). In a shorter window, the noise
/// of the keyframes acts as motion, and an unobservable delay seems observable. With 2, simulated dockings give a false
/// standard error of 0.08 s.
inline double motion_half_window(const SystematicError& error) {
  constexpr double kDelaySigmas = 6;
  return kDelaySigmas * error.delay_sigma;
}

/// Keyframes before and after keyframe k that give the motion at k.
struct MotionNeighbours {
  std::size_t before, after;
  bool is_final;  ///< whether later keyframes would not change `after`
};

/// Returns the neighbours of k among the keyframes i for which is_usable(i) is true. They are at least `half_window`
/// away, else the farthest ones, else k. Time is divided into spans of a third of the half window, and only the first
/// usable keyframe of a span is a neighbour. Measurements thus share neighbours, which couples fewer states.
/// `build` is a TrackingBuild.
template <class Build, class IsUsable>
MotionNeighbours motion_neighbours(const Build& build, std::size_t k, double half_window, IsUsable is_usable) {
  constexpr double kSpansPerHalfWindow = 3;
  const auto span_of = [&](std::size_t i) { return std::floor(kSpansPerHalfWindow * build.dt(0, i) / half_window); };
  MotionNeighbours found{k, k, false};
  for (std::size_t i = k; i-- > 0;) {
    if (!is_usable(i)) continue;
    if (build.dt(found.before, k) >= half_window && span_of(i) != span_of(found.before)) break;
    found.before = i;
  }
  for (std::size_t i = k + 1; i < build.size() && !found.is_final; ++i) {
    if (!is_usable(i)) continue;
    found.is_final = span_of(i) != span_of(found.after) && build.dt(k, i) >= half_window;
    found.after = i;
  }
  return found;
}

}  // namespace tandem::detail
