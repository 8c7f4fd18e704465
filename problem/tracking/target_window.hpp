#pragma once

#include <utility>

#include <tandem/problem/function_ref.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/target_forecast.hpp>
#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/problem/tracking/tracking_trajectory.hpp>

namespace tandem::detail {

/// Residuals of a tracking problem in a sliding window. Keyframes and measurements are added one by one.
template <LieGroup G>
class TargetWindow {
 public:
  using State = typename TrackingBuild<G>::State;

  /// Copies sensors and noise from `settings`, but no measurements.
  TargetWindow(Problem& problem, const TrackingData& settings, const TrackingOptions& options);
  TargetWindow(const TargetWindow&) = delete;

  std::size_t size() const { return build_.size(); }
  const std::vector<Keyframe>& keyframes() const { return out_.keyframes; }
  const TrackingData& data() const { return data_; }

  /// Adds a keyframe later than the last one. The type of the keyframe follows from `first`, a measurement of `sensor`
  /// valid at t, or null; the caller adds it afterwards. If `chaser` is null, the chaser follows the odometry pose
  /// `dead_reckoned`, which is the prior at the first keyframe. The initial guess of the target is the prediction, or
  /// at the first keyframe the position that `first` measures. Throws Error if there is none.
  void add_keyframe(double t, const SE3& dead_reckoned, const Variable<G>* chaser, std::size_t sensor,
                    const Measurement* first);
  /// Adds the bias state of a sensor's SystematicError that a measurement needs. Returns whether a state was added.
  bool prepare_bias(std::size_t sensor, const Measurement& m);
  /// Calls f(t, variable) for each bias state that a newer one has superseded since the last call. The first
  /// measurement that reads the state attaches to the keyframe at t [s]. The newest bias state of each sensor stays in
  /// the problem, regardless of its age.
  template <class F>
  void each_superseded_bias(F f);
  /// Calls f(name, variable, prior standard deviations) for each systematic error. The variable of a bias is its newest
  /// state.
  template <class F>
  void each_systematic_error(F f) const;
  /// Adds a measurement at a keyframe or between two. Returns the reason if this fails, e.g. because the measurement is
  /// outside the window.
  std::optional<std::string> add_measurement(std::size_t sensor, const Measurement& m);
  /// Returns the block of the measurement that was added last. For a pose with two residuals, this is the block of the
  /// position. For a pose, the first G::point_dim rows are the position. No keyframe may have been dropped since.
  const Block& last_block() const { return out_.measurements.back().block.value(); }
  /// Removes the measurement that was added last. No keyframe may have been dropped since.
  void remove_last_measurement();
  /// Makes measurements depend on the estimated delay of their sensor. This needs keyframes after the measurement
  /// (motion_neighbours), so add_measurement() uses a fixed delay: zero with additional noise at first, and later the
  /// estimate. This function frees the delay of measurements that have enough later keyframes, or that are `reach` [s]
  /// or more before the newest one. It also sets the fixed delays to the current estimates.
  void free_delays(double reach);
  /// Forgets the keyframes before t. Their variables must have left the problem.
  void drop_before(double t);

  SE3 chaser(std::size_t k) const { return SE3(in_space(problem_.value(build_.chaser[k]))); }
  /// Returns the odometry pose of the chaser at keyframe k, if it follows odometry.
  const SE3& dead_reckoned(std::size_t k) const { return build_.odometry[k]; }
  TargetState target(std::size_t k) const;
  /// Return the states at t, after the last keyframe, extrapolated with the twist or velocity over the last second.
  SE3 predicted_chaser(double t) const;
  TargetState predicted(double t) const;
  /// Joint covariance of variables, given by id and tangent dimension, in this order.
  using JointCovariance = FunctionRef<Eigen::MatrixXd(const std::vector<int>& ids, const std::vector<int>& dofs)>;
  /// Forecasts the target h > 0 [s] after the last keyframe with its motion model. Returns nullopt if there is only one
  /// keyframe, or if rounding errors dominate the covariance. For exceptions, see detail::forecast() and `covariance`.
  std::optional<TargetForecast<G>> forecast(double h, const JointCovariance& covariance) const;
  /// Return the states at t, between the first and the last keyframe, as TrackingTrajectory. The chaser follows
  /// `odometry`, which should cover the two keyframes around t.
  MotionInstant chaser_at(double t, const std::vector<Stamped<SE3>>& odometry,
                          const PropagateCovariance& propagate) const;
  MotionInstant target_at(double t, const PropagateCovariance& propagate) const;
  /// Returns the target's mean velocity over the last second, in the world [m/s].
  Vector<3> velocity() const;
  const Variable<G>& chaser_variable(std::size_t k) const { return build_.chaser[k]; }
  const State& target_variable(std::size_t k) const { return build_.target[k]; }

  /// Calls f(t, variable) for the variables that the last add_keyframe() added.
  template <class F>
  void each_new_variable(F f) const;

  /// Returns or sets the target's states at all keyframes.
  std::vector<TargetState> values() const;
  void set_values(const std::vector<TargetState>& values);
  /// Computes an initial guess of the target from the measurements in the window.
  std::vector<TargetState> initial_guess() const;
  /// Returns the angle between measured and estimated orientation at the last keyframe [rad]; 0 without measurement.
  double orientation_innovation() const;

 private:
  std::size_t reference() const;
  template <class F>
  MotionInstant with_trajectory(double t, const std::vector<Stamped<SE3>>& odometry, F f) const;
  PointForecastStart<G> point_forecast_start(const JointCovariance& covariance) const;

  Problem& problem_;
  TrackingData data_;  // data with the measurements in the window, for initial_guess()
  TrackingOptions options_;
  TrackingProblem out_;
  TrackingBuild<G> build_;
  std::vector<typename TrackingBuild<G>::SensorBias> superseded_biases_;
  /// A measurement that reads a fixed delay.
  struct FixedDelayMeasurement {
    std::size_t sensor;
    Measurement measurement;
    Block block;
    std::optional<typename TrackingBuild<G>::SensorBias> bias;
  };
  void place_newest(std::size_t sensor, std::size_t k);
  bool free_delay(const FixedDelayMeasurement& m, std::size_t k);
  struct FixedDelay {
    Variable<Rn<1>> value;  // fixed variable
    double sigma;           // standard deviation of the delay; 0 as soon as it is estimated
  };
  void add_delay_noise(const FixedDelay& delay, const Block& block);
  std::vector<FixedDelayMeasurement> fixed_delay_measurements_;
  std::map<std::size_t, FixedDelay> fixed_delays_;  // by sensor
  bool chaser_given_ = false;
  bool new_boundary_point_ = false;  // the last keyframe added a boundary point to the previous keyframe
};

template <LieGroup G>
template <class F>
void TargetWindow<G>::each_superseded_bias(F f) {
  for (const auto& bias : std::exchange(superseded_biases_, {}))
    std::visit([&](const auto& x) { f(bias.t, x); }, bias.state);
}

template <LieGroup G>
template <class F>
void TargetWindow<G>::each_systematic_error(F f) const {
  build_.constants.each(f);
  for (const auto& [sensor, bias] : build_.biases) {
    const TargetSensor& by = data_.sensors[sensor];
    if (by.error->has_constant_bias()) continue;  // included in the constants
    std::visit([&](const auto& x) { f(by.name + ".bias", x, by.error->bias_sigma); }, bias.state);
  }
}

template <LieGroup G>
template <class F>
void TargetWindow<G>::each_new_variable(F f) const {
  const std::size_t k = size() - 1;
  const double t = out_.keyframes[k].t;
  if (new_boundary_point_) f(out_.keyframes[k - 1].t, *build_.boundary_point[k - 1]);
  if (!chaser_given_) f(t, build_.chaser[k]);
  std::visit(
      [&]<class X>(const X& x) {
        if constexpr (!requires { x.first; }) f(t, x);
      },
      build_.target[k]);
  if (build_.boundary_point[k]) f(t, *build_.boundary_point[k]);
  if (!build_.twist.empty()) f(t, build_.twist[k]);
}

}  // namespace tandem::detail
