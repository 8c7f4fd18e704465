#pragma once

#include <utility>

#include <tandem/problem/function_ref.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/target_forecast.hpp>
#include <tandem/problem/tracking/tracking_build.hpp>

namespace tandem::detail {

/// The residuals of a tracking problem over the keyframes of a sliding window, added as keyframes and measurements come.
template <LieGroup G>
class TargetWindow {
 public:
  using State = typename TrackingBuild<G>::State;

  /// `settings`: sensors and noise; their measurements are not read.
  TargetWindow(Problem& problem, const TrackingData& settings, const TrackingOptions& options);
  TargetWindow(const TargetWindow&) = delete;

  std::size_t size() const { return build_.size(); }
  const std::vector<Keyframe>& keyframes() const { return out_.keyframes; }
  const TrackingData& data() const { return data_; }

  /// A keyframe later than the last one, its kind by `first`, a measurement that was valid then, if there is one: it is
  /// not added yet. The chaser is `chaser` where it is given; else it follows the odometry's pose `dead_reckoned`, from
  /// a prior there at the first one. The target starts where its last poses lead; at the first keyframe, where `first`
  /// sees it.
  void add_keyframe(double t, const SE3& dead_reckoned, const Variable<G>* chaser, std::size_t sensor,
                    const Measurement* first);
  /// Makes ready what a measurement needs beside poses: the bias of its sensor's StayingError at its instant. Returns
  /// whether there is something new.
  bool prepare(std::size_t sensor, const Measurement& m);
  /// Calls f(t, variable) for each bias that a newer one has taken the place of since the last call, t when it was measured
  /// with. The newest of each sensor stays in the problem, however long ago that was.
  template <class F>
  void each_left_bias(F f);
  /// Calls f(name, variable, standard deviations given) for each error that stays, a bias as it was measured with last.
  template <class F>
  void each_error(F f) const;
  /// Adds a measurement: at the keyframe of its instant, or between the two around it. Returns why not: a sentence when
  /// it is before the window or after the last keyframe.
  std::optional<std::string> add_measurement(std::size_t sensor, const Measurement& m);
  /// The block of the measurement that was added last, the position's where a pose is two; while no keyframe has left
  /// since. The first G::point_dim rows of a pose's are its position.
  const Block& last_block() const { return out_.measurements.back().block.value(); }
  /// Takes the measurement that was added last out again; while no keyframe has left since.
  void withdraw_last();
  /// A delay that is estimated needs keyframes after a measurement, too (delay_reach): until there are enough, it is read at
  /// what the delay is taken to be: none, with noise for its deviation, or, once it has been told of, the estimate so far as
  /// though that were right. From now on that is the estimate as it is; and what has enough, or was measured `reach` [s] or
  /// more before the newest keyframe, tells of it.
  void tell_delays(double reach);
  /// Forgets the keyframes before t, whose variables have left the problem.
  void drop_before(double t);

  SE3 chaser(std::size_t k) const { return SE3(in_space(problem_.value(build_.chaser[k]))); }
  /// Where odometry alone has the chaser; where it moves by odometry.
  const SE3& dead_reckoned(std::size_t k) const { return build_.odometry[k]; }
  TargetState target(std::size_t k) const;
  /// Where the chaser is at t, after the last keyframe, at the twist of the last second.
  SE3 predicted_chaser(double t) const;
  /// Where the target is at t, after the last keyframe, at the twist (a point: velocity) of the last second.
  TargetState predicted(double t) const;
  /// Joint covariance of variables by id and tangent dimensions, in the order given.
  using JointCovariance = FunctionRef<Eigen::MatrixXd(const std::vector<int>& ids, const std::vector<int>& dofs)>;
  /// Where the target is h > 0 [s] after the last keyframe, by its model of the motion. Nothing at a
  /// first keyframe, and where rounding would hide the covariance; throws Error as TargetForecast does, and what `of` throws.
  std::optional<TargetForecast<G>> forecast(double h, const JointCovariance& of) const;
  /// World velocity over the last second [m/s].
  Vector<3> velocity() const;
  const Variable<G>& chaser_variable(std::size_t k) const { return build_.chaser[k]; }
  const State& target_variable(std::size_t k) const { return build_.target[k]; }

  /// Calls f(t, variable) for all that joined with the last keyframe: the target's, and the chaser's when it is not given.
  template <class F>
  void each_new_variable(F f) const;

  /// The target's values, and a fresh first guess of them out of the window's measurements.
  std::vector<TargetState> values() const;
  void set_values(const std::vector<TargetState>& values);
  std::vector<TargetState> fresh_start() const;
  /// How far the last keyframe's measured orientation is from where the target is held to face [rad]; 0 without one.
  double surprise() const;

 private:
  std::size_t reference() const;
  PointForecastStart<G> start_as_points(const JointCovariance& of) const;

  Problem& problem_;
  TrackingData data_;  // the window's measurements, to start afresh from
  TrackingOptions options_;
  TrackingProblem out_;
  TrackingBuild<G> build_;
  std::vector<typename TrackingBuild<G>::SensorBias> left_biases_;
  /// A measurement that does not tell of its sensor's delay yet.
  struct Untold {
    std::size_t sensor;
    Measurement measurement;
    Block block;
    std::optional<typename TrackingBuild<G>::SensorBias> bias;
  };
  void place_newest(std::size_t sensor, std::size_t k);
  bool tell(const Untold& untold, std::size_t k);
  struct HeldDelay {
    Variable<Rn<1>> value;  // fixed
    double deviation;       // 0 once it is told of
  };
  void add_noise_of(const HeldDelay& delay, const Block& block);
  std::vector<Untold> untold_;
  std::map<std::size_t, HeldDelay> held_delays_;  // by sensor
  bool chaser_given_ = false;
  bool new_twin_ = false;  // of the keyframe before the last: a point has joined a pose there
};

template <LieGroup G>
template <class F>
void TargetWindow<G>::each_left_bias(F f) {
  for (const auto& bias : std::exchange(left_biases_, {})) std::visit([&](const auto& x) { f(bias.t, x); }, bias.state);
}

template <LieGroup G>
template <class F>
void TargetWindow<G>::each_error(F f) const {
  build_.constants.each(f);
  for (const auto& [sensor, bias] : build_.biases) {
    const TargetSensor& by = data_.sensors[sensor];
    if (by.error->has_constant_bias()) continue;  // one of the constants
    std::visit([&](const auto& x) { f(by.name + ".bias", x, by.error->sigma); }, bias.state);
  }
}

template <LieGroup G>
template <class F>
void TargetWindow<G>::each_new_variable(F f) const {
  const std::size_t k = size() - 1;
  const double t = out_.keyframes[k].t;
  if (new_twin_) f(out_.keyframes[k - 1].t, *build_.twin[k - 1]);
  if (!chaser_given_) f(t, build_.chaser[k]);
  std::visit(
      [&]<class X>(const X& x) {
        if constexpr (!requires { x.first; }) f(t, x);
      },
      build_.target[k]);
  if (build_.twin[k]) f(t, *build_.twin[k]);
  if (!build_.twist.empty()) f(t, build_.twist[k]);
}

}  // namespace tandem::detail
