#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <tandem/problem/tracking/target_window.hpp>
#include <tandem/solvers/online/fixed_lag.hpp>
#include <tandem/solvers/online/motion_hypotheses.hpp>
#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/solvers/online/restart_schedule.hpp>

namespace tandem::detail {

/// The problem of an OnlineEstimator: the chaser, the target once it has been seen, and the window that slides over both.
class OnlineWindow {
 public:
  /// `ego`: empty where the chaser moves by odometry. Measurements of both are not read.
  OnlineWindow(const TrackingData& settings, const NavigationData* ego, const OnlineOptions& options);
  OnlineWindow(const OnlineWindow&) = delete;

  /// Called with what leaves the window, at its last estimate, where the chaser moves by its own sensors.
  std::function<void(const Stamped<EgoState>&)> on_leave;

  bool started() const { return keyframes() > 0; }
  bool has_chain() const { return chain_.has_value(); }
  bool has_target() const { return !std::holds_alternative<std::monostate>(target_); }
  double newest() const { return lag_.newest(); }
  double oldest() const { return lag_.oldest(); }
  std::size_t keyframes() const;
  double cost() const { return cost_; }
  /// The time of the first keyframe that measurements can join [s].
  double first() const { return chain_ ? chain_->keyframes().front().t : oldest(); }

  /// The first keyframe of a chaser that moves by its own sensors.
  void start_chaser(const Alignment& alignment, const std::vector<ImuSample>& samples);
  void add(const ImuSample& sample) { chain_->add(sample); }
  /// A keyframe later than the newest. The chaser is at `dead_reckoned` where it moves by odometry. `first`: a target's
  /// measurement of that instant, if there is one, which is not added yet; it starts a target that is not there, and
  /// gives the keyframe its kind.
  void add_keyframe(double t, const SE3& dead_reckoned, std::size_t sensor, const Measurement* first);
  /// A target is added to the newest keyframe, which the chaser has.
  void start_target(std::size_t sensor, const Measurement& m);
  /// What became of a measurement.
  struct Outcome {
    std::optional<std::string> why_not{};  ///< a sentence; it is in the window where there is none
    std::optional<double> sigmas{};        ///< of its innovation, where that has a covariance
    bool rejected = false;                 ///< by the gate
  };
  /// Adds a measurement of the target, where it passes the gate.
  Outcome add_measurement(std::size_t sensor, const Measurement& m);
  /// Whether a measurement of the chaser's own can join a keyframe; and adds it, where it passes the gate.
  bool reaches(double t) const { return chain_->reaches(t); }
  Outcome attach(std::size_t sensor, const EgoMeasurement& m, double t);

  /// Solves the window and lets go what is old; now and then from a fresh start too.
  Summary update();
  /// Solves it to its minimum: an update stops once steps do what they should, which is right for a warm start.
  Summary settle();

  KeyframeType newest_type() const;
  EgoState chaser() const;
  std::optional<TargetState> target() const;
  std::optional<Vector<3>> target_velocity() const;
  SE3 predicted_chaser(double h) const;
  std::optional<TargetState> predicted_target(double h) const;
  std::optional<RelativeTarget> relative_target(double h) const;
  OnlineEstimator::Covariance covariance() const;
  std::vector<OnlineEstimator::SensorError> sensor_errors() const;
  std::optional<MotionHypotheses::Memory> hypotheses() const;
  void go_on_from(const MotionHypotheses::Memory& memory);
  std::vector<Stamped<EgoState>> states() const;
  std::vector<std::pair<double, double>> splits() const;

 private:
  template <LieGroup G>
  using Target = std::unique_ptr<TargetWindow<G>>;

  /// f(window) of the target's window, `none` without one.
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
  template <class F>
  void with_target(F f) const {
    std::visit(
        [&]<class W>(const W& w) {
          if constexpr (!std::same_as<W, std::monostate>) f(*w);
        },
        target_);
  }

  bool hypothesise() const { return has_target() && hypotheses_ && hypotheses_->started(); }
  SE3 out_of_dead_reckoning() const;
  TargetState hypothetical_target(double h) const;
  std::optional<Matrix<3, 3>> relative_covariance() const;
  /// Of the target in the world, and as seen from the newest chaser.
  struct Forecast {
    TargetState state;
    Matrix<3, 3> covariance;
  };
  std::optional<Forecast> forecast(double h) const;
  std::optional<TargetState> carried_target(double h) const;
  void note_fix(std::size_t sensor, const Measurement& m);

  FixedLagOptions with_hook(FixedLagOptions options);
  void fall_behind();
  bool predicts();
  bool settles_first();
  bool passes(const Block& block, Eigen::Index rows, bool gated, Outcome& outcome) const;
  void join(const EgoKeyframe& keyframe);
  template <class Sensors>
  void join_biases(Sensors& sensors, bool unknown);
  void make_target();
  template <LieGroup G>
  void join_newest(const TargetWindow<G>& window);
  double span() const;
  void tell_delays(double reach);
  Summary slide();
  double minimize();
  bool restart_due();
  Summary restart(const Summary& before);

  const TrackingData settings_;
  const OnlineOptions options_;
  const std::optional<NavigationData> ego_;
  FixedLag lag_;
  std::optional<EgoChain> chain_;
  std::variant<std::monostate, Target<SE3>, Target<SE2>> target_;
  std::optional<MotionHypotheses> hypotheses_;  // of the target, where they are on
  RestartSchedule restarts_;
  double cost_ = 0;
  // Whether lag_'s covariance is of all that has joined: not any more, but for what has been added, yes, or not, because
  // a residual is undefined.
  enum class Covariance { stale, behind, there, none };
  Covariance covariance_ = Covariance::stale;
  bool converged_ = true;  // at the last update, or solved to the minimum since
};

}  // namespace tandem::detail
