#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {

/// Errors of a navigation at one keyframe, with true rotation R and estimate R̂. A field is absent if truth or
/// covariance is.
struct NavigationError {
  /// Time of the comparison [s]: that of the keyframe. If true poses are more than 0.2 s apart, IMU samples propagate
  /// the estimate to the next true pose, unless the next keyframe comes first.
  double t;
  std::optional<Vector<3>> position{};     ///< estimate minus truth, along the world axes [m]
  std::optional<Vector<3>> orientation{};  ///< Log(R⁻¹ R̂), about the body's x (roll), y (pitch) and z (yaw) [rad]
  /// Estimate minus truth, along the world axes [m/s]. The true velocity is a central difference of positions, which
  /// smooths turns if the truth is sparse (2 s for truth at 1 Hz).
  std::optional<Vector<3>> velocity{};
  std::optional<Vector<3>> position_sigma{}, orientation_sigma{}, velocity_sigma{};  ///< σ of these errors
  /// Normalised estimation errors squared, eᵀ Σ⁻¹ e, of pose and position: 6 and 3 on average if Σ is consistent
  /// (Bar-Shalom, Li & Kirubarajan 2001, section 5.4).
  std::optional<double> pose_nees{}, position_nees{};
};

/// An interval without GPS fixes.
struct GpsOutage {
  double from, to;                   ///< The last fix and the next one, or the ends of the recording [s].
  std::optional<double> distance{};  ///< True distance travelled [m].
  std::optional<double> drift{};     ///< Horizontal error at the last keyframe before `to` [m].
  std::optional<double> largest{};   ///< Largest horizontal error in the interval [m].
};

inline constexpr double kMinGpsOutage = 10.0;  ///< shortest GPS outage [s]

/// Comparison of a navigation with the truth.
struct NavigationComparison {
  std::vector<NavigationError> errors;  ///< at each keyframe
  /// Transforms the truth to the estimate's world. Not the identity if no sensor observes the position or the heading
  /// in the world; then it aligns the first position, and the heading, with the truth. `alignment` describes this in a
  /// sentence.
  SE3 to_estimate{};
  std::string alignment;
  /// The point of the body to which the truth refers: the origin, or the GPS antenna if the truth has positions only.
  Vector<3> point = Vector<3>::Zero();
  std::string antenna;             ///< name of the sensor with that antenna, or empty
  std::optional<double> distance;  ///< true distance travelled between the first and the last keyframe [m]
  std::vector<GpsOutage> outages;  ///< empty if the navigation uses no GPS
};

/// Compares a navigation with scenario.truth_chaser, interpolated where needed. Without truth, there are standard
/// deviations but no errors. `scenario` has all its sensors, including those that the navigation did not use.
NavigationComparison compare_with_truth(const Navigation& navigation, const Scenario& scenario);

struct Statistics {
  int n;
  double mean, rms, max;
};

/// Summary of the errors at several keyframes.
struct NavigationErrorSummary {
  int n = 0;                                                     ///< Number of keyframes.
  int compared = 0;                                              ///< Number of keyframes that the truth covers.
  std::optional<Statistics> position, horizontal;                ///< Norm of the error, and of its x and y [m].
  std::optional<Statistics> orientation;                         ///< Angle of the error [rad].
  std::optional<Statistics> velocity;                            ///< Norm of the error [m/s].
  std::optional<Vector<3>> orientation_rms;                      ///< One error per component [rad].
  std::optional<Vector<3>> position_within, orientation_within;  ///< Share of keyframes within 3σ, by component.
  std::optional<double> pose_nees, position_nees;                ///< Means.
};

/// Summarises the errors from `after` seconds after the first keyframe on.
NavigationErrorSummary summarise(const std::vector<NavigationError>& errors, double after = 0);

/// Returns √(x² + y²).
double horizontal(const Vector<3>& v);

}  // namespace tandem
