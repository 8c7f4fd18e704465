#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {

/// How far a navigation is from the truth at one keyframe; a field is absent where truth or covariance is. R is the true
/// rotation, R̂ the estimated one.
struct NavigationError {
  /// s: of the keyframe or, where true poses are more than 0.2 s apart, of the next of them before the next keyframe, to
  /// which the IMU carries the estimate on.
  double t;
  /// Estimate minus truth: position [m] and velocity [m/s] along the world's axes, and Log(R⁻¹ R̂) about the body's x, y
  /// and z [rad], called roll, pitch and yaw. The true velocity is the difference of true positions about it: over 2 s of truth at 1 Hz,
  /// so that turns blur it.
  std::optional<Vector<3>> position{}, orientation{}, velocity{};
  /// Standard deviations of the same components, at the keyframe.
  std::optional<Vector<3>> position_sigma{}, orientation_sigma{}, velocity_sigma{};
  /// Normalised estimation errors squared, eᵀ Σ⁻¹ e, of pose and position: on average 6 and 3 where Σ is right
  /// (Bar-Shalom, Li & Kirubarajan 2001, section 5.4).
  std::optional<double> pose_nees{}, position_nees{};
};

/// A time without GPS.
struct GpsOutage {
  double from, to;  ///< s: the last fix and the next, or the recording's ends
  /// m: travelled by the truth; horizontal error at the last keyframe before `to`, and the largest one on the way.
  std::optional<double> distance{}, drift{}, most{};
};

inline constexpr double kOutage = 10.0;  ///< s: shorter times without GPS are none

struct NavigationComparison {
  std::vector<NavigationError> errors;  ///< one a keyframe
  /// The truth's world in the estimate's: identity but where no sensor tells where the world's origin is, or its heading;
  /// then the first position, and heading, are taken from the truth. `alignment` says so in a sentence.
  SE3 to_estimate{};
  std::string alignment;
  /// Where in the body truth is: at its origin but for truth without orientation, which is that of a GPS antenna.
  Vector<3> point = Vector<3>::Zero();
  std::string antenna;             ///< the sensor whose antenna it is, or empty
  std::optional<double> distance;  ///< m, that the truth travels from the first keyframe to the last
  std::vector<GpsOutage> outages;  ///< where there is GPS at all
};

/// Compares with scenario.truth_chaser, interpolated where needed; without truth there are standard deviations alone.
/// `scenario` has all its sensors, also those that the navigation went without.
NavigationComparison compare_with_truth(const Navigation& navigation, const Scenario& scenario);

struct Statistics {
  int n;
  double mean, rms, max;
};

/// Over keyframes.
struct NavigationErrorSummary {
  int n = 0;                                                     ///< keyframes
  int compared = 0;                                              ///< those of them that the truth covers
  std::optional<Statistics> position, horizontal;                ///< m: of the error's norm, of its x and y
  std::optional<Statistics> orientation;                         ///< rad: of its angle
  std::optional<Statistics> velocity;                            ///< m/s
  std::optional<Vector<3>> orientation_rms;                      ///< rad, by component
  std::optional<Vector<3>> position_within, orientation_within;  ///< share of keyframes within 3 σ, by component
  std::optional<double> pose_nees, position_nees;                ///< means
};

/// Of the keyframes `after` seconds or more after the first.
NavigationErrorSummary summarise(const std::vector<NavigationError>& errors, double after = 0);

/// √(x² + y²).
double horizontal(const Vector<3>& v);

}  // namespace tandem
