#pragma once

#include <tandem/problem/navigation/ego_chain.hpp>
#include <tandem/residuals/miscalibrated_own.hpp>

namespace tandem::detail {

/// Where a measurement of the chaser's own sensors joins the problem: at the keyframe before it, the state there carried
/// on to its instant by `ahead`; at the keyframe itself where that is null.
struct EgoPlacing {
  Problem& problem;
  const EgoKeyframe& keyframe;
  const ImuDelta* ahead;
  const Earth& earth;
  const std::optional<Variable<Rn<1>>>& dvl_scale;
  const EgoSensor& sensor;
  const Loss& loss;
  const EgoError* bias;     ///< the sensor's own, or null
  const ImuSample* motion;  ///< about the instant, without bias; null where no delay is estimated
  SensorConstants& constants;
};

/// As one that reads the errors of its sensor, too.
template <class R>
Block place_miscalibrated(const EgoPlacing& at, const R& residual) {
  const EgoKeyframe& k = at.keyframe;
  const StayingError& error = *at.sensor.error;
  const std::string& name = at.sensor.name;
  SensorConstants& constants = at.constants;
  const auto bias = at.bias ? std::get<Variable<Rn<R::dim>>>(at.bias->state) : constants.none<Rn<R::dim>>(at.problem);
  const bool common = at.sensor.type == EgoSensorType::dvl && at.dvl_scale;
  const auto scale = common ? *at.dvl_scale : constants.get<Rn<1>>(at.problem, name, "scale", error.scale);
  const auto turn = constants.get<SO3>(at.problem, name, "misalignment", error.misalignment);
  // Where no sample tells how the body moves, the measurement does not count for the delay.
  const auto delay = constants.get<Rn<1>>(at.problem, name, "delay", at.motion ? error.delay : 0);
  MiscalibratedOwn<R> whole{residual, at.sensor.mount.rotation(), {}, at.earth};
  if (at.ahead) whole.ahead = *at.ahead;
  if (at.motion) whole.rate = at.motion->angular_rate, whole.force = at.motion->specific_force;
  // What it does not read is a constant, so that blocks of the problem's matrix are not filled with zeros.
  const bool moves = MiscalibratedOwn<R>::reads_velocity || at.ahead || at.motion;
  const auto velocity = moves ? k.velocity : constants.none<R3>(at.problem);
  const auto imu = at.ahead && k.bias ? *k.bias : constants.none<Rn<6>>(at.problem);
  return at.problem.minimize(whole, Gaussian(at.sensor.sigma), {k.pose, velocity, imu, bias, scale, turn, delay},
                             at.loss);
}

/// Adds a residual that reads the chaser's pose (SE3), pose and velocity (SE3, R3), or these and the DVL's scale factor
/// (SE3, R3, Rn<1>).
template <class R>
Block place(const EgoPlacing& at, const R& residual) {
  const EgoKeyframe& k = at.keyframe;
  const Gaussian noise(at.sensor.sigma);
  constexpr std::size_t states = std::tuple_size_v<typename R::States>;
  const auto extra = [&] {
    if constexpr (states == 3) {
      return std::tuple(*at.dvl_scale);
    } else {
      return std::tuple<>();
    }
  }();
  if constexpr (states < 3)
    if (at.sensor.error) return place_miscalibrated(at, residual);
  if (at.ahead)
    return at.problem.minimize(Propagated<R>{residual, *at.ahead, at.earth}, noise,
                               std::tuple_cat(std::tuple(k.pose, k.velocity, *k.bias), extra), at.loss);
  if constexpr (states == 1) {
    return at.problem.minimize(residual, noise, std::tuple(k.pose), at.loss);
  } else {
    return at.problem.minimize(residual, noise, std::tuple_cat(std::tuple(k.pose, k.velocity), extra), at.loss);
  }
}

}  // namespace tandem::detail
