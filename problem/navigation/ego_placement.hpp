#pragma once

#include <tandem/problem/navigation/ego_chain.hpp>
#include <tandem/residuals/miscalibrated_ego.hpp>

namespace tandem::detail {

/// Context for adding a measurement of the chaser's own sensors to the problem.
struct EgoPlacing {
  Problem& problem;
  const EgoKeyframe& keyframe;  ///< the last one at or before the measurement
  const ImuDelta* ahead;        ///< preintegrated IMU from the keyframe to the measurement; null at the keyframe
  const Earth& earth;
  const std::optional<Variable<Rn<1>>>& dvl_scale;
  const EgoSensor& sensor;
  const Loss& loss;
  const EgoBias* bias;      ///< bias state of the sensor, or null
  const ImuSample* motion;  ///< mean IMU reading at the measurement, without bias; null if no delay is estimated
  SensorConstants& constants;
};

/// Adds a residual that also reads the systematic errors of its sensor.
template <class R>
Block place_miscalibrated(const EgoPlacing& at, const R& residual) {
  const EgoKeyframe& k = at.keyframe;
  const SystematicError& error = *at.sensor.error;
  const std::string& name = at.sensor.name;
  SensorConstants& constants = at.constants;
  const auto bias =
      at.bias ? std::get<Variable<Rn<R::dim>>>(at.bias->state) : constants.fixed_identity<Rn<R::dim>>(at.problem);
  const bool common = at.sensor.type == EgoSensorType::dvl && at.dvl_scale;
  const auto scale = common ? *at.dvl_scale : constants.get_or_add<Rn<1>>(at.problem, name, "scale", error.scale_sigma);
  const auto turn = constants.get_or_add<SO3>(at.problem, name, "misalignment", error.misalignment_sigma);
  // Without IMU samples at the measurement, it gives no information on the delay.
  const auto delay = constants.get_or_add<Rn<1>>(at.problem, name, "delay", at.motion ? error.delay_sigma : 0);
  MiscalibratedEgo<R> whole{residual, at.sensor.mount.rotation(), {}, at.earth};
  if (at.ahead) whole.ahead = *at.ahead;
  if (at.motion) whole.rate = at.motion->angular_rate, whole.force = at.motion->specific_force;
  // Unused states are fixed variables, to keep the Hessian sparse.
  const bool moves = MiscalibratedEgo<R>::reads_velocity || at.ahead || at.motion;
  const auto velocity = moves ? k.velocity : constants.fixed_identity<R3>(at.problem);
  const auto imu = at.ahead && k.bias ? *k.bias : constants.fixed_identity<Rn<6>>(at.problem);
  return at.problem.minimize(whole, Gaussian(at.sensor.sigma), {k.pose, velocity, imu, bias, scale, turn, delay},
                             at.loss);
}

/// Adds a residual of the chaser's pose (SE3), of pose and velocity (SE3, R3), or of these and the scale factor error
/// of the DVL (SE3, R3, Rn<1>).
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
