#pragma once

#include <functional>
#include <string>
#include <vector>

#include <tandem/studies/estimation/estimate_metrics.hpp>
#include <tandem/studies/estimation/sensor_outcomes.hpp>
#include <tandem/studies/estimation/uncertainty.hpp>
#include <tandem/studies/navigation/navigate.hpp>
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/support/solver_choice.hpp>

namespace tandem {

/// A measurement that was held out against its prediction.
struct Validation {
  HeldOut prediction;
  double t;  ///< s, as stamped
  /// Whether the robust losses leave it a weight of kDownWeighted or more in the same estimate with all measurements in:
  /// says so without the interval that it is to validate. Nothing when that estimate did not converge.
  std::optional<bool> inlier;
};

/// What became of the measurements of one of the chaser's own sensors.
struct EgoSensorUse {
  std::string name;
  std::size_t used, left_out;
};

/// A measurement that the others contradict (see outliers()).
struct Suspect {
  std::string sensor;
  double t;       ///< s, as stamped
  double sigmas;  ///< standard deviations from what the others say

  /// "usbl at 312.000 s is 2003 standard deviations from where the other measurements put the target".
  std::string text() const;
};

/// What estimating a scenario gave.
struct Estimate {
  std::string scenario;
  TrackingOptions options;
  Frame frame;  ///< what results are written in; everything here is in ENU-FLU
  Summary summary;
  int residual_blocks = 0;  ///< soft ones
  int hard_blocks = 0;
  std::vector<Keyframe> keyframes;
  std::vector<SE3> chaser;  ///< one each a keyframe
  std::vector<TargetState> target;
  std::vector<Vector<6>> target_twist;  ///< body twists, where the model estimates them [m/s, rad/s]
  std::vector<KeyframeError> errors;    ///< one a keyframe
  std::vector<MeasurementOutcome> measurements;
  std::vector<SensorOutcome> sensors;
  std::vector<std::string> without_extrinsics;   ///< declared sensors
  std::vector<KeyframeUncertainty> uncertainty;  ///< one each a keyframe, or none
  std::vector<Validation> held_out;              ///< needs the uncertainty
  std::string why_no_uncertainty;                ///< a sentence, when there is none
  std::string cut_short;                         ///< what the solver's limits cut short after it, a sentence, or none
  std::vector<Suspect> suspects;                 ///< the worst first
  std::vector<FoundConstant> constants;          ///< of sensors with errors that stay
  std::string contradiction;                     ///< of the limits on the motion with the data, a sentence, or none

  // Where the chaser moves by its own sensors:
  std::vector<EgoSensorUse> ego_sensors;
  std::vector<NavigationFinding> findings;        ///< about them
  std::vector<std::pair<double, double>> splits;  ///< gaps of the IMU: from, to [s]
  std::optional<double> dvl_scale{};              ///< the DVL reads (1 + this) v, when estimated
};

/// Builds the tracking problem, solves it and compares with the truth. Throws Error when data and options
/// make no problem or the solver cannot take it; a solve that does not converge is in the summary. When measurements are
/// held out and losses robust, solves once more with all of them in, to tell the inliers. A chaser without odometry is
/// navigated by its own sensors first, as `navigation` says, and then estimated together with the target.
/// `graduated`: by graduated non-convexity around the solver (solvers/graduated.hpp). The solver's limits are of all this
/// together: what is there by then is given. `built` is called with the problem before it is solved.
Estimate estimate(const Scenario& scenario, const TrackingOptions& options, const Solver& solver,
                  bool graduated = false, const NavigationOptions& navigation = {}, bool covariance = true,
                  const std::function<void(const Problem&)>& built = {});

}  // namespace tandem
