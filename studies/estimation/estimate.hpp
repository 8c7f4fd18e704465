#pragma once

#include <functional>
#include <string>
#include <vector>

#include <tandem/solvers/fit_report.hpp>
#include <tandem/studies/estimation/estimate_metrics.hpp>
#include <tandem/studies/estimation/likely_causes.hpp>
#include <tandem/studies/estimation/sensor_outcomes.hpp>
#include <tandem/studies/estimation/uncertainty.hpp>
#include <tandem/studies/navigation/fit_delay.hpp>
#include <tandem/studies/navigation/navigate.hpp>
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/scenario/states_at.hpp>
#include <tandem/studies/support/solver_choice.hpp>

namespace tandem {

/// A held-out measurement with its prediction.
struct Validation {
  HeldOut prediction;
  double t;  ///< stamp [s]
  /// Whether the robust losses leave the measurement a weight of kDownweightThreshold or more if all measurements are
  /// used. This criterion does not depend on the interval to be validated. Absent if that solve did not converge.
  std::optional<bool> inlier;
};

/// Numbers of measurements of one of the chaser's own sensors.
struct EgoSensorUse {
  std::string name;
  std::size_t used, discarded;
};

/// A measurement that contradicts the others; see outliers().
struct SuspectedOutlier {
  std::string sensor;
  double t;       ///< stamp [s]
  double sigmas;  ///< distance from the position that the other measurements predict, in standard deviations

  /// Returns for example "usbl at 312.000 s is 2003 standard deviations from where the other measurements put the
  /// target".
  std::string text() const;
};

/// Result of estimate(), in ENU-FLU. Vectors over keyframes have the length of `keyframes`.
struct Estimate {
  std::string scenario;
  TrackingOptions options;
  Frame frame;  ///< frame of the result files
  Summary summary;
  int residual_blocks = 0, hard_blocks = 0;  ///< numbers of soft blocks and of hard constraints
  std::vector<Keyframe> keyframes;
  std::vector<SE3> chaser;
  std::vector<TargetState> target;
  std::vector<Vector<6>> target_twist;  ///< body twists [m/s, rad/s]; empty if they are not states of the model
  std::vector<KeyframeError> errors;
  std::vector<MeasurementOutcome> measurements;
  std::vector<SensorOutcome> sensors;
  std::vector<std::string> without_extrinsics;     ///< declared sensors without extrinsics
  std::vector<KeyframeUncertainty> uncertainty;    ///< over keyframes, or empty
  FitReport fit;                                   ///< agreement of the solution with the data and the stated noise
  std::vector<LikelyCause> causes;                 ///< changes of the data that would explain misfits
  std::vector<Validation> held_out;                ///< held-out measurements; empty without uncertainty
  std::string why_no_uncertainty;                  ///< reason, if `uncertainty` is empty or `held_out` lacks inliers
  std::string cut_short;                           ///< what a limit or an interrupt prevented after the solve, or empty
  std::vector<SuspectedOutlier> suspects;          ///< in order of decreasing distance
  std::vector<SystematicErrorEstimate> constants;  ///< systematic errors of sensors
  std::vector<NavigationFinding> findings;         ///< problems found in the data
  std::vector<DelayFit> delays;                    ///< fitted delays, if the caller fits them
  std::vector<StateAt> at;                         ///< states at the requested instants, in their order
  std::string missing_truth;                       ///< missing_truth() of the scenario
  std::optional<MeanStd> target_error_in_world{};  ///< without errors relative to the chaser [m]
  /// A sentence if the target has an orientation that no sensor measures, else empty.
  std::string unmeasured_orientation;
  std::string contradiction;  ///< warning if motion limits contradict the data, or empty

  // Only if the chaser moves by its own sensors:
  std::vector<EgoSensorUse> ego_sensors;
  std::vector<std::pair<double, double>> splits;  ///< gaps of the IMU: begin, end [s]
  std::optional<double> dvl_scale{};              ///< estimated scale factor s; the DVL reads (1 + s) v
};

/// Builds the tracking problem, solves it, and compares the solution with the truth.
///
/// A chaser without odometry is first navigated by its own sensors, with the options `navigation`, and then estimated
/// jointly with the target. `graduated` selects graduated non-convexity (solvers/graduated.hpp). If measurements are
/// held out and losses are robust, a second solve with all measurements finds the inliers. `covariance` requests the
/// uncertainty. The solver's time limit covers all steps; `cut_short` names those that it prevented. `built` is called
/// with the problem before it is solved. `at` are the times [s] of Estimate::at.
///
/// Throws Error if data and options give no valid problem or the solver does not support it. A solve that does not
/// converge is not an error; see `summary`.
Estimate estimate(const Scenario& scenario, const TrackingOptions& options, const AnySolver& solver,
                  bool graduated = false, const NavigationOptions& navigation = {}, bool covariance = true,
                  const std::function<void(const Problem&)>& built = {}, const std::vector<double>& at = {});

}  // namespace tandem
