#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/navigation/coarse_alignment.hpp>
#include <tandem/problem/navigation/motion_instant.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag_options.hpp>
#include <tandem/solvers/online/motion_hypotheses.hpp>
#include <tandem/solvers/online/rejection.hpp>
#include <tandem/solvers/online/track_health.hpp>

namespace tandem {

/// Options of an OnlineEstimator.
struct OnlineOptions {
  TrackingOptions tracking{};  ///< target model; not steady_course or none
  EgoOptions ego{};
  FixedLagOptions lag{};
  ResetOptions reset{};
  /// Duration of the data used to align a heading that no sensor measures [s] (see align()).
  double alignment = 30.0;
  std::optional<Alignment> start{};  ///< replaces the first alignment
  /// Estimates the newest state of the target and its predictions by MotionHypotheses, instead of the window. The
  /// window still estimates the chaser and earlier states of the target. See why_hypotheses_unsupported().
  bool hypotheses = false;
  /// If no motion of the target satisfies its hard constraints, makes them soft and resets the estimate. Otherwise such
  /// updates have the status infeasible (OnlineUpdate::summary), and the estimate is reset as after other failures.
  bool soften_infeasible = false;
};

/// Returns why motion hypotheses are not supported, or an empty string. They need position fixes in space, from a
/// chaser that moves by odometry.
std::string why_hypotheses_unsupported(const TrackingData& tracking, bool by_odometry);

/// The position of a target relative to the chaser.
struct RelativeTarget {
  Vector<3> position;                        ///< position in the chaser's body [m]
  std::optional<Matrix<3, 3>> covariance{};  ///< covariance along the same axes [m²]
};

/// One update of the window, caused by a new keyframe with its measurements, or by a late measurement of the target.
/// Late measurements of the chaser's own sensors wait for the next update.
struct OnlineUpdate {
  double t;           ///< newest keyframe [s]
  KeyframeType type;  ///< none without a target
  bool new_keyframe;  ///< true once per keyframe
  double seconds;     ///< duration from the first new residual to the end of the update [s]
  Summary summary;
};

/// Estimates a chaser and its target while measurements arrive: a fixed-lag smoother for the problems of
/// make_tracking_problem() and make_navigation_problem(). The chaser moves by odometry, or by its own sensors. The
/// target is estimated from the first measurement of its position on.
///
/// Each stream must be in time order. Streams may lag behind each other, and measurements may be late by up to the
/// length of the window. The order of simultaneous measurements has no effect on the problem.
///
/// Each measurement must pass the gate (ResetOptions::gate). The estimate is reset if measurements keep contradicting
/// it, if the window does not converge, or after a long gap. A reset discards the window, its covariances and the
/// hypotheses. The target is then re-initialised by its next position measurement. A chaser with its own sensors
/// continues from its last state with a larger covariance, or is aligned again after a gap.
///
/// If several sensors contradict the estimate that the IMU propagates, but agree with each other without it, the
/// estimate continues without the IMU until it agrees with them again.
///
/// Thread safety: different estimators may be used in different threads. One estimator needs a lock, also for its const
/// functions, which cache results.
class OnlineEstimator {
 public:
  /// `tracking`: sensors of the target and noise. `ego`: the chaser's own sensors, which replace odometry. Measurements
  /// in both are ignored. Throws Error on invalid options.
  OnlineEstimator(const TrackingData& tracking, const std::optional<NavigationData>& ego, const OnlineOptions& options);
  OnlineEstimator(const OnlineEstimator&) = delete;
  ~OnlineEstimator();

  // Hooks. They may read the estimate and call reset(), which then takes effect at the end of the current call. The
  // other functions that change the estimate throw BadInputError within a hook.

  /// Called after each update.
  std::function<void(const OnlineUpdate&)> on_update;
  /// Called with the sensor and the reason when a queued measurement is rejected, possibly during a later call. Without
  /// this hook, the current call returns the reason.
  std::function<void(const std::string& sensor, const Rejection& why)> on_reject;
  /// Called before the estimate is reset.
  std::function<void(const TrackReset&)> on_reset;
  /// Called when the innovations of a sensor (index in TrackHealth::sensors) have shifted, with the names of the other
  /// sensors of the same subject that agree with the estimate.
  std::function<void(std::size_t sensor, const InnovationShift& shift, const std::string& others)> on_shift;
  /// Called with the last estimate of each chaser state that leaves the window, after
  /// FixedLagOptions::before_marginalize. Only if the chaser moves by its own sensors.
  std::function<void(const Stamped<EgoState>&)> on_leave;

  // The following functions add a measurement. They return the reason if it is rejected, else nothing.

  std::optional<Rejection> add_odometry(const Stamped<SE3>& pose);
  /// The time of the sample must be corrected by ImuSensor::delay.
  std::optional<Rejection> add_imu(const ImuSample& sample);
  std::optional<Rejection> add_ego(std::size_t sensor, const EgoMeasurement& m);
  std::optional<Rejection> add_target(std::size_t sensor, const Measurement& m);
  /// Ends the input: processes the measurements that wait for later data.
  void finish();
  /// Discards all data and the estimate, but keeps the counts of health(). The next measurement may have an earlier
  /// time. See the hooks.
  void reset();
  /// Solves the window to convergence.
  Summary solve_to_convergence();

  const TrackHealth& health() const;
  /// Returns the state of the motion hypotheses at the oldest keyframe; nothing without hypotheses or target.
  std::optional<MotionHypotheses::Checkpoint> hypotheses() const;
  /// Takes over the health and the hypotheses of another estimator with the same sensors. The measurements of its
  /// window must have been added to this one. Throws Error like MotionHypotheses::restore().
  void restore(const TrackHealth& health, const std::optional<MotionHypotheses::Checkpoint>& hypotheses);
  /// Returns OnlineOptions::start for an estimator that replaces this one: the newest state with its standard
  /// deviations along world axes. Nothing if the chaser moves by odometry, or has no covariance.
  std::optional<Alignment> handover_start() const;

  bool started() const;           ///< The chaser is initialised.
  bool has_target() const;        ///< The target is initialised.
  double newest() const;          ///< Time of the newest keyframe [s].
  double oldest() const;          ///< Time of the oldest keyframe in the window [s].
  std::size_t keyframes() const;  ///< Number of keyframes in the window.
  double cost() const;            ///< Cost of the window at the last update.

  /// Returns the chaser at the newest keyframe; velocity and bias are zero with odometry.
  EgoState chaser() const;
  /// Returns the target at the newest keyframe.
  std::optional<TargetState> target() const;
  /// Returns the velocity of the target in the world [m/s], over about the last second of the window.
  std::optional<Vector<3>> target_velocity() const;
  /// Predicts the chaser h seconds after the newest keyframe, with its twist of the last second. h must be finite.
  SE3 predicted_chaser(double h) const;
  /// Predicts the target h seconds after the newest keyframe, with motion hypotheses if enabled, else with the motion
  /// model of the window. Without a covariance (at the first keyframe, or after a failed update), extrapolates with the
  /// twist of the last second.
  std::optional<TargetState> predicted_target(double h) const;
  /// Predicts the target h seconds after the newest keyframe, relative to the chaser at that keyframe. The covariance
  /// from the hypotheses excludes the chaser's motion since the last fix; that from the window includes it. The window
  /// has none after a failed update. For h > 0 it also has none at the first keyframe, or if an axis of the target is
  /// unobservable.
  std::optional<RelativeTarget> relative_target(double h) const;

  /// Covariances of the newest keyframe from the window, for right perturbations [m, rad]; 3 × 3 for planar poses.
  /// Motion hypotheses do not affect them.
  struct Covariance {
    Eigen::MatrixXd chaser;          ///< pose
    Eigen::MatrixXd velocity, bias;  ///< 3 × 3, 6 × 6; empty with odometry
    Eigen::MatrixXd target;          ///< pose or point; empty without a target
    Eigen::MatrixXd joint;           ///< joint covariance of [chaser; target]
  };
  Covariance covariance() const;
  /// Returns whether motion hypotheses give target(), predictions and relative positions.
  bool uses_hypotheses() const;
  /// Returns the target of the window, to which covariance() belongs, at the newest keyframe. With h > 0, it moves on
  /// for h seconds with its twist of the last second.
  std::optional<TargetState> window_target(double h = 0) const;

  /// Chaser and target at an instant.
  struct Instant {
    std::optional<MotionInstant> chaser, target;  ///< nothing outside the keyframes of the window
  };
  /// Returns the states at t [s], between two keyframes of the window, by the interpolation of the motion priors
  /// (TrackingTrajectory, EgoTrajectory), with covariances unless the last update failed. Motion hypotheses do not
  /// affect them.
  Instant at(double t) const;

  /// The current estimate of a systematic error of a sensor.
  struct SensorError {
    std::string name;  ///< "usbl.scale", "camera.misalignment", "dvl.bias"
    /// Scale [1]; misalignment [rad] about the sensor's axes; delay [s]; bias, one per row.
    Eigen::VectorXd value;
    Eigen::VectorXd prior_sigma;  ///< prior standard deviations
    Eigen::VectorXd sigma;        ///< posterior standard deviations; empty if unknown
  };
  std::vector<SensorError> sensor_errors() const;

  /// Returns all chaser states in the window.
  std::vector<Stamped<EgoState>> window() const;
  /// Returns the IMU gaps that have split the chain so far: start and end [s].
  std::vector<std::pair<double, double>> splits() const;
  /// Returns the intervals in which the IMU contradicts the other sensors: start and end [s]. The first samples of an
  /// interval may be good. The end is infinite as long as the contradiction lasts.
  const std::vector<std::pair<double, double>>& imu_exclusions() const;

 private:
  class Streams;
  std::unique_ptr<Streams> streams_;
};

}  // namespace tandem
