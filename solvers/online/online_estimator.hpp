#pragma once

#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <tandem/problem/navigation/coarse_alignment.hpp>
#include <tandem/problem/tracking/target_window.hpp>
#include <tandem/solvers/online/fixed_lag.hpp>

namespace tandem {

/// How an OnlineEstimator makes and solves its problem.
struct OnlineOptions {
  TrackingOptions tracking{};  ///< of the target: any model but steady_course, soft constraints
  EgoOptions ego{};
  FixedLagOptions lag{};
  /// s of data to wait for until a heading that no sensor gives at once is decided (see align()).
  double alignment = 30.0;
  std::optional<Alignment> start{};  ///< in place of an alignment by the estimator itself
};

/// One update: a keyframe has joined, or a late measurement.
struct OnlineUpdate {
  double t;           ///< s, of the newest keyframe
  KeyframeType type;  ///< gated where there is no target
  bool new_keyframe;
  double seconds;  ///< that the update took, from the first residual that was added
  Summary summary;
};

/// A chaser and its target as measurements come in: fixed-lag smoothing of the problems of make_tracking_problem and
/// make_navigation_problem, keyframe by keyframe. The chaser moves by odometry or by its own sensors, where these are
/// given; the target, where there are sensors that observe it, is estimated from the first measurement of its position
/// on. Each stream comes in its own time order; streams may be late against each other, and measurements as late as the
/// window is long.
class OnlineEstimator {
 public:
  /// `tracking`: sensors of the target and noise; its odometry and measurements are not read. `ego`: the chaser's own
  /// sensors in place of odometry; their measurements are not read either. Throws Error on options that cannot work.
  OnlineEstimator(const TrackingData& tracking, const std::optional<NavigationData>& ego, const OnlineOptions& options);
  OnlineEstimator(const OnlineEstimator&) = delete;

  /// Called after each update.
  std::function<void(const OnlineUpdate&)> on_update;
  /// Called with a line that turned out to be of no use when its turn came, which may be while later ones are added: the
  /// sensor, and a sentence. Without it, the call that is under way returns the sentence.
  std::function<void(const std::string& sensor, const std::string& why)> on_refuse;
  /// Called with what leaves the window, at its last estimate.
  std::function<void(const Stamped<EgoState>&)> on_leave;

  // Each returns why the line was refused, a sentence; nothing when it was taken.
  std::optional<std::string> add_odometry(const Stamped<SE3>& pose);
  std::optional<std::string> add_imu(const ImuSample& sample);
  std::optional<std::string> add_ego(std::size_t sensor, const EgoMeasurement& m);
  std::optional<std::string> add_target(std::size_t sensor, const Measurement& m);
  /// Nothing more will come: estimates what was waiting for later lines.
  void finish();
  /// Solves the window to its minimum.
  Summary settle();

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
  /// h seconds after the newest keyframe, at constant twist (a point: constant velocity).
  SE3 predicted_chaser(double h) const;
  std::optional<TargetState> predicted_target(double h) const;

  /// Covariances of the newest keyframe, right perturbations of the poses [m, rad], planar ones as 3 × 3.
  struct Covariance {
    Eigen::MatrixXd chaser;          ///< pose
    Eigen::MatrixXd velocity, bias;  ///< 3 × 3, 6 × 6; empty with odometry
    Eigen::MatrixXd target;          ///< pose or point; empty without a target
    Eigen::MatrixXd joint;           ///< of [chaser; target]
  };
  Covariance covariance() const;

  /// All chaser states in the window.
  std::vector<Stamped<EgoState>> window() const;
  /// Gaps of the IMU that split the chain so far: from, to [s].
  std::vector<std::pair<double, double>> splits() const;

 private:
  struct Event {
    std::size_t sensor;
    std::variant<EgoMeasurement, Measurement> measurement;
  };
  template <LieGroup G>
  using Window = std::unique_ptr<detail::TargetWindow<G>>;
  using Clock = std::chrono::steady_clock;

  /// f(window) of the target's window, `none` without one.
  template <class F, class R>
  R in_window(F f, R none) const {
    return std::visit(
        [&]<class W>(const W& w) -> R {
          if constexpr (std::same_as<W, std::monostate>) {
            return none;
          } else {
            return f(*w);
          }
        },
        window_);
  }
  template <class F>
  void with_window(F f) const {
    std::visit(
        [&]<class W>(const W& w) {
          if constexpr (!std::same_as<W, std::monostate>) f(*w);
        },
        window_);
  }

  FixedLagOptions with_hook(FixedLagOptions options);
  std::optional<std::string> why_not_at(const std::string& name, double stamp);
  std::optional<std::string> why_too_late(const std::string& name, double t) const;
  std::optional<std::string> wait(double stamp, double valid, Event event);
  void refuse(const std::string& name, const std::optional<std::string>& why);
  double reached() const;
  double last_motion() const;
  void process();
  bool start_chain();
  void join(const EgoKeyframe& keyframe);
  void take_event();
  void take_ego(std::size_t sensor, const EgoMeasurement& m, double t);
  void take_target(std::size_t sensor, const Measurement& m, double t);
  void refuse(const std::string& name, double t);
  void add_keyframe(double t, std::size_t sensor, const Measurement* first);
  void start_target(std::size_t sensor, const Measurement& m);
  void make_window();
  template <LieGroup G>
  void track_last(const detail::TargetWindow<G>& window);
  SE3 dead_reckoned_at(double t) const;
  void begin_update();
  void update();
  void trim();
  bool restart_due();
  Summary restart(const Summary& before);

  OnlineOptions options_;
  TrackingData settings_;
  std::optional<NavigationData> ego_settings_;
  NavigationData waiting_;  // for the alignment
  double interval_ = 1.0;
  FixedLag lag_;
  std::optional<EgoChain> chain_;
  std::variant<std::monostate, Window<SE3>, Window<SE2>> window_;
  std::vector<Stamped<SE3>> odometry_;
  std::multimap<double, Event> pending_;  // by the time when they were valid
  double clock_ = -HUGE_VAL, last_imu_ = -HUGE_VAL, cost_ = 0;
  double restart_after_, last_restart_ = -HUGE_VAL;
  std::optional<double> ahead_;  // the stamp of a line that was far ahead of all others
  std::optional<std::string> refused_;
  bool finished_ = false;
  // Since the last update: something calls for one; a keyframe has joined; a measurement of the chaser's own has.
  bool due_ = false, new_keyframe_ = false, unsolved_ = false;
  Clock::time_point begun_;
};

}  // namespace tandem
