#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tandem/problem/navigation/coarse_alignment.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/online/fixed_lag_options.hpp>
#include <tandem/solvers/online/motion_hypotheses.hpp>
#include <tandem/solvers/online/refusal.hpp>
#include <tandem/solvers/online/track_health.hpp>

namespace tandem {

/// How an OnlineEstimator makes and solves its problem.
struct OnlineOptions {
  TrackingOptions tracking{};  ///< of the target: any model but steady_course, soft constraints
  EgoOptions ego{};
  FixedLagOptions lag{};
  ResetOptions reset{};
  /// s of data to wait for until a heading that no sensor gives at once is decided (see align()).
  double alignment = 30.0;
  std::optional<Alignment> start{};  ///< in place of the first alignment by the estimator itself
  /// The target's newest state, and where it will be, by MotionHypotheses over its fixes, and not by the window; what was
  /// measured before the newest keyframe, and all of the chaser, is the window's. See why_no_hypotheses().
  bool hypotheses = false;
};

/// Why motion hypotheses cannot serve: empty, or what is in their way (they take fixes of positions in space, from a
/// chaser that moves by odometry).
std::string why_no_hypotheses(const TrackingData& tracking, bool by_odometry);

/// Where a target is as seen from the chaser.
struct RelativeTarget {
  Vector<3> position;                        ///< m, in the chaser's body
  std::optional<Matrix<3, 3>> covariance{};  ///< m², along its axes
};

/// One update: a keyframe has joined, with all that was measured at its instant and had come by then; or a measurement
/// of the target that came after that. (The chaser's own that come so wait for the next update.)
struct OnlineUpdate {
  double t;           ///< s, of the newest keyframe
  KeyframeType type;  ///< gated where there is no target
  bool new_keyframe;  ///< once for each keyframe
  double seconds;     ///< that the update took, from the first residual that called for it
  Summary summary;
};

/// A chaser and its target as measurements come in: fixed-lag smoothing of the problems of make_tracking_problem and
/// make_navigation_problem, keyframe by keyframe. The chaser moves by odometry or by its own sensors, where these are
/// given; the target, where there are sensors that observe it, is estimated from the first measurement of its position
/// on. Each stream comes in its own time order; streams may be late against each other, and measurements as late as the
/// window is long. Lines of one instant may come in any order: the problem that they make is the same.
///
/// What is measured is held against what is expected first (ResetOptions::gate). An estimate that measurements keep
/// contradicting, whose window does not converge or that nothing is measured of for long is given up: window, covariances
/// and hypotheses are dropped as a whole. A target begins anew at the next measurement of its position; a chaser that
/// moves by its own sensors goes on from its last state, less sure of it, or aligns anew where there was a gap.
class OnlineEstimator {
 public:
  /// `tracking`: sensors of the target and noise; its odometry and measurements are not read. `ego`: the chaser's own
  /// sensors in place of odometry; their measurements are not read either. Throws Error on options that cannot work.
  OnlineEstimator(const TrackingData& tracking, const std::optional<NavigationData>& ego, const OnlineOptions& options);
  OnlineEstimator(const OnlineEstimator&) = delete;
  ~OnlineEstimator();

  /// Called after each update.
  std::function<void(const OnlineUpdate&)> on_update;
  /// Called with a line that turned out to be of no use when its turn came, which may be while later ones are added: the
  /// sensor, and why. Without it, the call that is under way returns that.
  std::function<void(const std::string& sensor, const Refusal& why)> on_refuse;
  /// Called when the estimate is given up, before it begins anew.
  std::function<void(const TrackReset&)> on_reset;
  /// Called with what leaves the window, at its last estimate, where the chaser moves by its own sensors;
  /// FixedLagOptions::leaving is called before it.
  std::function<void(const Stamped<EgoState>&)> on_leave;

  // Each returns why the line was refused; nothing when it was taken.
  std::optional<Refusal> add_odometry(const Stamped<SE3>& pose);
  /// Stamped with when it was valid: ImuSensor::delay is to be taken off, as of the sensor's own samples.
  std::optional<Refusal> add_imu(const ImuSample& sample);
  std::optional<Refusal> add_ego(std::size_t sensor, const EgoMeasurement& m);
  std::optional<Refusal> add_target(std::size_t sensor, const Measurement& m);
  /// Nothing more will come: estimates what was waiting for later lines.
  void finish();
  /// Forgets all that has come, but not the counts of its health: time may run backwards to the next line.
  void begin_anew();
  /// Solves the window to its minimum.
  Summary settle();

  const TrackHealth& health() const;
  /// Of the target, what lines that have left the window told the motion hypotheses; nothing without these, or a target.
  std::optional<MotionHypotheses::Memory> hypotheses() const;
  /// It goes on from the counts of another estimator with the same sensors, and from its hypotheses, whose latest lines
  /// this one was given. Throws Error as MotionHypotheses::go_on_from().
  void go_on_from(const TrackHealth& health, const std::optional<MotionHypotheses::Memory>& hypotheses);
  /// OnlineOptions::start of an estimator that begins where this one is: the newest state, as sure as it is along world
  /// axes, and of its biases, component by component. Nothing where the chaser moves by odometry, or there is none.
  std::optional<Alignment> newest_start() const;

  bool started() const;  ///< there is a chaser
  bool has_target() const;
  double newest() const;          ///< s, of the newest keyframe
  double oldest() const;          ///< s, of the oldest that is in the window
  std::size_t keyframes() const;  ///< in the window
  double cost() const;            ///< of the window, at the last update

  /// Of the newest keyframe; velocity and bias zero where odometry is given.
  EgoState chaser() const;
  std::optional<TargetState> target() const;
  /// World velocity of the target [m/s] over the last second or so of the window.
  std::optional<Vector<3>> target_velocity() const;
  /// h seconds, finite, after the newest keyframe: the chaser at its twist of the last second; the target by motion
  /// hypotheses where these are on, else as the window would have it if nothing were measured meanwhile, by its model of the
  /// motion and what is known of the target. (At its twist of the last second, where there is no covariance to say how far
  /// to believe that: at a first keyframe, and after an update that failed.)
  SE3 predicted_chaser(double h) const;
  std::optional<TargetState> predicted_target(double h) const;
  /// Where the target is h seconds after the newest keyframe, seen from where the chaser is at it, with its covariance. The
  /// chaser's own motion since the last fix is no part of the hypotheses', but of the window's, which has none after an
  /// update that failed, nor, but for h = 0, at a first keyframe or where an axis that nothing observes would hide it.
  std::optional<RelativeTarget> relative_target(double h) const;

  /// Covariances of the newest keyframe, right perturbations of the poses [m, rad], planar ones as 3 × 3; the window's, also
  /// where motion hypotheses tell the target (relative_target).
  struct Covariance {
    Eigen::MatrixXd chaser;          ///< pose
    Eigen::MatrixXd velocity, bias;  ///< 3 × 3, 6 × 6; empty with odometry
    Eigen::MatrixXd target;          ///< pose or point; empty without a target
    Eigen::MatrixXd joint;           ///< of [chaser; target]
  };
  Covariance covariance() const;

  /// An error that stays, of a sensor, as it was measured with last.
  struct SensorError {
    std::string name;           ///< "usbl.scale", "camera.misalignment", "dvl.bias"
    Eigen::VectorXd value;      ///< 1; rad about the sensor's axes; one a row of the sensor's residual, in its units
    Eigen::VectorXd given;      ///< standard deviations before
    Eigen::VectorXd deviation;  ///< and after; empty where covariances are not known
  };
  std::vector<SensorError> sensor_errors() const;

  /// All chaser states in the window.
  std::vector<Stamped<EgoState>> window() const;
  /// Gaps of the IMU that split the chain so far: from, to [s].
  std::vector<std::pair<double, double>> splits() const;

 private:
  class Streams;
  std::unique_ptr<Streams> streams_;
};

}  // namespace tandem
