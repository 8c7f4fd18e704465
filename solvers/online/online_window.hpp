#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <tandem/problem/tracking/target_window.hpp>
#include <tandem/solvers/fit_report.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag.hpp>
#include <tandem/solvers/online/motion_hypotheses.hpp>
#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/solvers/online/restart_schedule.hpp>

namespace tandem::detail {

/// The sliding window of an OnlineEstimator: the problem of the chaser and, once it is initialised, the target.
class OnlineWindow {
 public:
  /// `ego`: null if the chaser moves by odometry. Measurements in `settings` and `ego` are ignored.
  OnlineWindow(const TrackingData& settings, const NavigationData* ego, const OnlineOptions& options);
  OnlineWindow(const OnlineWindow&) = delete;

  /// Called with the last estimate of each chaser state that leaves the window; only with own sensors.
  std::function<void(const Stamped<EgoState>&)> on_leave;

  bool started() const { return keyframes() > 0; }
  bool has_chain() const { return chain_.has_value(); }  ///< the chaser is initialised and moves by its own sensors
  bool has_target() const { return !std::holds_alternative<std::monostate>(target_); }
  double newest() const { return lag_.newest(); }
  double oldest() const { return lag_.oldest(); }
  std::size_t keyframes() const;
  double cost() const { return cost_; }
  /// Returns the time of the first keyframe to which measurements can attach [s].
  double first() const { return chain_ ? chain_->keyframes().front().t : oldest(); }

  /// Adds the first keyframe of a chaser that moves by its own sensors.
  void start_chaser(const Alignment& alignment, const std::vector<ImuSample>& samples);
  void add(const ImuSample& sample) { chain_->add(sample); }
  /// Adds a keyframe at a time later than the newest. `dead_reckoned` is the chaser's pose if it moves by odometry.
  /// `first` is a measurement of the target at this time, or null. It initialises the target if necessary, and sets the
  /// type of the keyframe; its residual is not added.
  void add_keyframe(double t, const SE3& dead_reckoned, std::size_t sensor, const Measurement* first);
  /// Initialises the target at the newest keyframe.
  void start_target(std::size_t sensor, const Measurement& m);
  /// The result of adding a measurement.
  struct Outcome {
    std::optional<std::string> why_not{};  ///< the reason if it cannot be used, a sentence
    NormalizedInnovation innovation{};
    bool rejected = false;  ///< outside the gate
  };
  /// Adds a measurement of the target if it passes the gate.
  Outcome add_measurement(std::size_t sensor, const Measurement& m);
  /// Returns whether a measurement of the chaser at time t can attach to an existing keyframe.
  bool can_attach(double t) const { return chain_->can_attach(t); }
  /// Adds a measurement of the chaser if it passes the gate.
  Outcome attach(std::size_t sensor, const EgoMeasurement& m, double t);

  /// Solves the window and marginalises old states. Sometimes also solves from a fresh start (RestartSchedule).
  Summary update();
  /// Solves the window to its minimum. (An update ends earlier, which suffices after a warm start.)
  Summary solve_to_convergence();

  KeyframeType newest_type() const;
  EgoState chaser() const;
  std::optional<TargetState> target() const;
  std::optional<Vector<3>> target_velocity() const;
  SE3 predicted_chaser(double h) const;
  std::optional<TargetState> predicted_target(double h) const;
  std::optional<RelativeTarget> relative_target(double h) const;
  OnlineEstimator::Covariance covariance() const;
  bool uses_hypotheses() const { return has_target() && hypotheses_ && hypotheses_->started(); }
  std::optional<TargetState> window_target(double h) const;
  // Only if has_chain(): the last keyframe at or before t, or the oldest; its state and covariance.
  const EgoKeyframe& own_keyframe(double t) const;
  EgoState own_state(const EgoKeyframe& keyframe) const { return chain_->state(keyframe); }
  OnlineEstimator::Covariance own_covariance(const EgoKeyframe& keyframe) const;
  OnlineEstimator::Instant at(double t, const std::vector<Stamped<SE3>>& odometry) const;
  std::vector<OnlineEstimator::SensorError> sensor_errors() const;
  std::optional<MotionHypotheses::Checkpoint> hypotheses() const;
  void restore(const MotionHypotheses::Checkpoint& checkpoint);
  std::vector<Stamped<EgoState>> states() const;
  std::vector<std::pair<double, double>> splits() const;

 private:
  template <LieGroup G>
  using Target = std::unique_ptr<TargetWindow<G>>;

  /// Returns f(window) for the window of the target, or `none` without a target.
  template <class F, class R>
  R of_target(F f, R none) const {
    return std::visit(
        [&]<class W>(const W& w) -> R {
          if constexpr (std::same_as<W, std::monostate>) {
            return none;
          } else {
            return f(*w);
          }
        },
        target_);
  }
  /// Calls f(window) for the window of the target, if there is one.
  template <class F>
  void with_target(F f) const {
    std::visit(
        [&]<class W>(const W& w) {
          if constexpr (!std::same_as<W, std::monostate>) f(*w);
        },
        target_);
  }

  SE3 world_from_dead_reckoning() const;
  TargetState target_from_hypotheses(double h) const;
  std::optional<Matrix<3, 3>> relative_covariance() const;
  struct Forecast {
    TargetState state;        // state in the world
    Matrix<3, 3> covariance;  // covariance of the position relative to the newest chaser pose
  };
  std::optional<Forecast> forecast(double h) const;
  void add_fix_to_hypotheses(std::size_t sensor, const Measurement& m);

  OnlineEstimator::Instant at(double t, const std::vector<Stamped<SE3>>& odometry,
                              const PropagateCovariance& propagate) const;
  FixedLagOptions with_hook(FixedLagOptions options);
  void mark_covariance_extendable();
  bool update_covariance();
  bool minimize_once();
  bool passes(const Block& block, Eigen::Index rows, bool use_gate, Outcome& outcome);
  void track_keyframe(const EgoKeyframe& keyframe);
  template <class Sensors>
  void track_replaced_biases(Sensors& sensors, bool unknown);
  void make_target();
  template <LieGroup G>
  void track_newest(const TargetWindow<G>& window);
  double span() const;
  void free_delays(double reach);
  Summary slide();
  double minimize();
  bool fresh_start_due();
  Summary solve_from_fresh_start(const Summary& before);

  const TrackingData settings_;
  const OnlineOptions options_;
  const std::optional<NavigationData> ego_;
  FixedLag lag_;
  std::optional<EgoChain> chain_;
  std::variant<std::monostate, Target<SE3>, Target<SE2>> target_;
  std::optional<MotionHypotheses> hypotheses_;  // if OnlineOptions::hypotheses
  RestartSchedule restarts_;
  LossExpectations expectations_;
  double cost_ = 0;
  // State of the covariance of lag_: outdated; valid except for new variables; valid; or undefined, because a residual
  // is undefined.
  enum class Covariance { stale, extendable, current, unavailable };
  Covariance covariance_ = Covariance::stale;
  bool converged_ = true;  // the last update converged, or the window was minimised since
};

}  // namespace tandem::detail
