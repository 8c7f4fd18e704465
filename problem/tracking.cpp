#include <tandem/problem/tracking.hpp>
#include <tandem/problem/tracking_start.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/outside.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/usbl_position.hpp>

namespace tandem {
namespace {

using Surge = TwistComponents<SE3, surge>;
using YawRate = TwistComponents<SE3, yaw_rate>;
using NonHolonomic = TwistComponents<SE3, sway | heave>;

/// Adds the residuals of one kind after the other, so that each pool is filled in time order.
class Builder {
 public:
  Builder(const TrackingData& data, const TrackingOptions& options, TrackingProblem& out)
      : data_(data), options_(options), out_(out), frames_(out.keyframes), n_(frames_.size()) {}

  void chaser(const std::vector<SE3>& odometry) {
    out_.problem.minimize(Prior<SE3>{odometry.front()}, Gaussian(data_.noise.prior), {out_.chaser.front()});
    const Gaussian noise(data_.noise.odometry);
    for (std::size_t k = 1; k < n_; ++k)
      out_.problem.minimize(RelativePose<SE3>{odometry[k - 1].inverse() * odometry[k]}, noise.scaled(std::sqrt(dt(k))),
                            {out_.chaser[k - 1], out_.chaser[k]});
  }

  void measurements() {
    for (const auto& sensor : data_.position_sensors) {
      const Gaussian noise(sensor.sigma);
      each(sensor.measurements, [&](std::size_t k, const Vector<3>& z) {
        out_.problem.minimize(UsblPosition<SE3>{z, sensor.mount, sensor.beacon}, noise,
                              {out_.chaser[k], out_.target[k]}, options_.loss);
      });
    }
    for (const auto& sensor : data_.pose_sensors) {
      const Gaussian noise(sensor.sigma);
      each(sensor.measurements, [&](std::size_t k, const SE3& z) {
        out_.problem.minimize(RelativePose<SE3>{z, sensor.mount, sensor.marker}, noise,
                              {out_.chaser[k], out_.target[k]}, options_.loss);
      });
    }
  }

  void motion() {
    const Gaussian noise(data_.noise.constant_twist);
    for (std::size_t k = 2; k < n_; ++k)
      out_.problem.minimize(ConstantTwist<SE3>{dt(k - 1), dt(k)}, noise.scaled(std::sqrt(dt(k))),
                            {out_.target[k - 2], out_.target[k - 1], out_.target[k]});
  }

  void roll_pitch() {
    const Gaussian noise(data_.noise.roll_pitch);
    for (const auto& x : out_.target) hold_zero(RollPitch<SE3>{}, options_.roll_pitch, noise, {x});
  }

  void constraints() {
    const Gaussian sideways(data_.noise.non_holonomic), along{data_.noise.surge}, turning{data_.noise.yaw_rate};
    for (std::size_t k = 1; k < n_; ++k) {
      const VariablesOf<Surge> pair{out_.target[k - 1], out_.target[k]};
      hold_zero(NonHolonomic{dt(k)}, options_.non_holonomic, sideways, pair);
      if (options_.surge) hold_between(Surge{dt(k)}, options_.limits, *options_.surge, along, pair);
      if (options_.max_yaw_rate)
        hold_between(YawRate{dt(k)}, options_.limits, between(-*options_.max_yaw_rate, *options_.max_yaw_rate), turning,
                     pair);
    }
  }

 private:
  double dt(std::size_t k) const { return frames_[k].t - frames_[k - 1].t; }

  template <class T, class F>
  void each(const std::vector<Stamped<T>>& measurements, F f) {
    for (const auto& m : measurements)
      if (const auto k = keyframe_at(frames_, m.t)) f(*k, m.value);
  }

  template <Residual R>
  void hold_zero(const R& residual, Role role, const Gaussian& noise, const VariablesOf<R>& x) {
    if (role == Role::hard) out_.problem.subject_to(residual, equal_to(0), x);
    if (role == Role::soft) out_.problem.minimize(residual, noise, x);
  }
  template <Residual R>
  void hold_between(const R& residual, Role role, const Bounds<R::dim>& bounds, const Gaussian& noise,
                    const VariablesOf<R>& x) {
    if (role == Role::hard) out_.problem.subject_to(residual, bounds, x);
    if (role == Role::soft) out_.problem.minimize(Outside<R>(residual, bounds), noise, x);
  }

  const TrackingData& data_;
  const TrackingOptions& options_;
  TrackingProblem& out_;
  const std::vector<Keyframe>& frames_;
  std::size_t n_;
};

}  // namespace

TrackingProblem make_tracking_problem(const TrackingData& data, const TrackingOptions& options) {
  TrackingProblem out;
  out.keyframes = make_keyframes(data, options.max_keyframes);
  const std::vector<SE3> chaser = odometry_at(data.odometry, out.keyframes);
  const std::vector<SE3> target = initial_target(data, out.keyframes, chaser);
  for (std::size_t k = 0; k < out.keyframes.size(); ++k) {  // in turns: the Hessian stays narrow-banded
    out.chaser.push_back(out.problem.add(chaser[k], "chaser " + std::to_string(k)));
    out.target.push_back(out.problem.add(target[k], "target " + std::to_string(k)));
  }
  Builder builder(data, options, out);
  builder.chaser(chaser);
  builder.measurements();
  builder.motion();
  builder.roll_pitch();
  builder.constraints();
  return out;
}

}  // namespace tandem
