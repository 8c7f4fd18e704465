#include <tandem/residuals/imu_preintegration.hpp>
#include <tandem/residuals/preintegrated_imu.hpp>
#include <tandem/residuals/vehicle/actuator_lag.hpp>
#include <tandem/residuals/vehicle/inside_cone.hpp>
#include <tandem/residuals/vehicle/twist_kinematics.hpp>
#include <tandem/residuals/vehicle/vehicle_dynamics.hpp>
#include <tandem/residuals/vehicle/visibility.hpp>

#include "options.hpp"
#include "residual_in_python.hpp"

namespace tandem::python {
namespace {

py::tuple preintegrate(py::handle samples, const py::kwargs& given) {
  const Batch rows = batch(samples, {7}, "preintegrate_imu: t, specific force, angular rate");
  if (rows.single || rows.count < 2)
    throw py::value_error("preintegrate_imu: expected at least two samples, an array of shape (n, 7)");
  SE3 mount;
  ImuNoise noise;
  Vector<6> bias = Vector<6>::Zero();
  Earth earth;
  ImuHold hold = ImuHold::turning;
  for (const char* required : {"accelerometer", "gyroscope", "accelerometer_bias_walk", "gyroscope_bias_walk"})
    if (!given.contains(required)) throw py::type_error(std::string("preintegrate_imu: ") + required + " is missing");
  Options read("preintegrate_imu", given);
  read("mount", mount);
  read("accelerometer", noise.accelerometer);
  read("gyroscope", noise.gyroscope);
  read("accelerometer_bias_walk", noise.accelerometer_bias_walk);
  read("gyroscope_bias_walk", noise.gyroscope_bias_walk);
  read("integration", noise.integration);
  read("bias", bias);
  read("gravity", earth.gravity);
  read("earth_rate", earth.rate);
  bool at_start = false;
  read("at_start", at_start);
  if (at_start) hold = ImuHold::at_start;
  read.finish();
  for (const double sigma : {noise.accelerometer, noise.gyroscope, noise.accelerometer_bias_walk,
                             noise.gyroscope_bias_walk, noise.integration})
    if (!(sigma >= 0) || std::isinf(sigma))
      throw BadInputError("preintegrate_imu: noises must be finite and not negative");
  ImuPreintegrator sum(mount, noise, bias, hold);
  const auto sample = [&](std::size_t i) {
    const double* x = rows.data() + 7 * i;
    return ImuSample{x[0], Vector<3>(x[1], x[2], x[3]), Vector<3>(x[4], x[5], x[6])};
  };
  for (std::size_t i = 1; i < rows.count; ++i) sum.integrate(sample(i - 1), sample(i));
  return py::make_tuple(in_python("PreintegratedImu", PreintegratedImu{sum.delta(), earth}),
                        map_matrices<15, 15>(1, true, [&](std::size_t) { return sum.covariance(); }));
}

}  // namespace

void bind_dynamics(py::module_& m) {
  declare<PreintegratedImu>(
      m, "PreintegratedImu",
      {"dt", "rotation", "velocity", "position", "bias", "rotation_by_bias", "velocity_by_bias", "position_by_bias",
       "gravity", "earth_rate"},
      8,
      "PreintegratedImu(dt, rotation, velocity, position, bias, rotation_by_bias, velocity_by_bias, position_by_bias, "
      "gravity=(0, 0, -9.80665), earth_rate=0)\n\nPreintegrated inertial measurements between two keyframes; "
      "preintegrate_imu() computes it from samples. 15 rows: position, velocity, rotation, biases. States: pose, "
      "velocity (R3), biases (R6), each at the first keyframe, then at the second.");
  m.def(
      "preintegrate_imu", &preintegrate, py::arg("samples"),
      "preintegrate_imu(samples, *, accelerometer, gyroscope, accelerometer_bias_walk, gyroscope_bias_walk, "
      "integration=0, mount=SE3(), bias=0, gravity=(0, 0, -9.80665), earth_rate=0, at_start=False)\n\n"
      "Return (PreintegratedImu, covariance of its 15 rows) of samples of shape (n, 7): time [s], specific force "
      "[m/s^2] and angular rate [rad/s] along the sensor's axes. Noises are root spectral densities; `mount` is the "
      "pose of the sensor in the body; `bias` is subtracted. With `at_start`, samples are taken at the start of their "
      "interval; otherwise they are means over it.\n\n"
      ">>> import tandem, numpy as np\n"
      ">>> samples = np.array([[0.1 * k, 0, 0, 9.80665, 0, 0, 0] for k in range(11)])\n"
      ">>> imu, S = tandem.preintegrate_imu(samples, accelerometer=1e-3, gyroscope=1e-4,\n"
      "...                                  accelerometer_bias_walk=1e-4, gyroscope_bias_walk=1e-5)\n"
      ">>> at_rest = [tandem.SE3(), tandem.R3([0, 0, 0]), tandem.R6([0] * 6)]\n"
      ">>> bool(np.abs(imu(*at_rest, *at_rest)).max() < 1e-12), S.shape\n"
      "(True, (15, 15))\n");
  declare<TwistKinematics<SE3>>(m, "TwistKinematics", {"dt"}, 1,
                                "TwistKinematics(dt)\n\nMotion by the mean of two body twists over dt [s]. States: "
                                "pose, twist (R6), pose, twist.");
  declare<VehicleDynamics<3>, VehicleDynamics<8>>(
      m, "VehicleDynamics",
      {"mass", "linear", "quadratic", "lift", "weight", "buoyancy", "centre_of_mass", "centre_of_buoyancy", "thrust",
       "fin", "dt", "mass_inverse", "start_weight"},
      13,
      "VehicleDynamics(mass, linear, quadratic, lift, weight, buoyancy, centre_of_mass, centre_of_buoyancy, thrust, "
      "fin, dt, mass_inverse, start_weight)\n\nEquations of motion of a vehicle over dt [s], by the implicit midpoint "
      "rule; Vehicle.dynamics() computes it from a vehicle. 6 rows [m/s, rad/s]. States: pose, twist (R6), twist after "
      "the step, actuators (R3 or R8), command, current (R3, along the world axes) [m/s].");
  declare<ActuatorLag<3>, ActuatorLag<8>>(
      m, "ActuatorLag", {"decay"}, 1,
      "ActuatorLag(decay)\n\nActuators that follow a command with a first-order lag; decay is exp(-dt / lag), shape "
      "(3,) or (8,). States: actuators (R3 or R8), command, actuators after the step.");
  declare<InsideCone<SE3>, InsideCone<R3>>(
      m, "InsideCone", {"half_angle", "B", "beacon"}, 1,
      "InsideCone(half_angle, B=identity, beacon=0)\n\nPoint of a target in a cone [m]: at least 0 inside. `B` is the "
      "apex, whose x axis is the axis, in the body of the carrier. States: carrier pose, target pose or point.");
  declare<Visibility>(m, "Visibility", {"range", "range_fade", "half_angle", "cosine_fade", "B", "beacon"}, 0,
                      "Visibility(range=9, range_fade=1, half_angle=pi/4, cosine_fade=0.05, B=identity, "
                      "beacon=0)\n\nSoft visibility of a target; zero where a fix is certain. States: carrier pose, "
                      "target pose, gain (R1).");
}

}  // namespace tandem::python
