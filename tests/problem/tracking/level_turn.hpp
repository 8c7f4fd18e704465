#pragma once

#include <cmath>

#include <tandem/problem/navigation/navigation_problem.hpp>

/// Simulation of own sensors, for a vehicle that turns in a level circle at constant speed.
namespace tandem::testing {

/// Noise-free data of all sensors. The specific force is constant in the body, so IMU sampling causes no errors.
struct LevelTurn {
  static constexpr double speed = 1.5, rate = 0.1;  ///< m/s, rad/s
  double duration = 20;                             ///< s
  Vector<6> bias = Vector<6>::Zero();
  double dvl_scale = 0;

  static SE3 pose(double t) {
    const double r = speed / rate, a = 0.4 + rate * t;
    return SE3(SO3::Exp({0, 0, a}), Vector<3>(r * std::sin(a), -r * std::cos(a), -5));
  }
  static Vector<3> velocity(double t) { return pose(t).rotation().act(Vector<3>(speed, 0, 0)); }
  EgoState state(double t) const { return {pose(t), velocity(t), bias}; }

  static EgoSensor sensor(EgoSensorType type, const Eigen::VectorXd& sigma, const SE3& mount = {}) {
    EgoSensor s;
    s.name = name(type);
    s.type = type;
    s.sigma = sigma;
    s.mount = mount;
    return s;
  }
  /// Returns the measurement that is stamped t.
  EgoMeasurement measure(const EgoSensor& s, double t) const {
    EgoMeasurement m = s.type->ideal(s, t, pose(t - s.delay), velocity(t - s.delay));
    if (s.type == EgoSensorType::dvl) m.value *= 1 + dvl_scale;
    return m;
  }

  /// Returns data of IMU (50 Hz), DVL (2.5 Hz), heading (1 Hz), GPS (0.5 Hz) and depth (2 Hz). Only the IMU has samples
  /// at whole seconds. `delay` [s] applies to all sensors except the IMU.
  NavigationData data(double delay = 0) const {
    NavigationData d;
    ImuSensor& imu = d.imu.emplace();
    imu.mount = SE3(SO3::Exp({0, 0, 0.5}), Vector<3>::Zero());
    imu.noise = {1e-3, 1e-4, 1e-5, 1e-6};
    imu.initial_accelerometer_bias = 0.1;
    imu.initial_gyroscope_bias = 0.01;
    const SO3 to_sensor = imu.mount.rotation().inverse();
    const int n = int(std::lround(50 * duration));
    for (int i = 0; i <= n; ++i)
      imu.samples.push_back({0.02 * i, to_sensor.act(Vector<3>(0, speed * rate, 9.80665)) + bias.head<3>(),
                             to_sensor.act(Vector<3>(0, 0, rate)) + bias.tail<3>()});
    const auto add = [&](EgoSensor s, double period, double first) {
      s.delay = delay;
      for (double t = first + delay; t <= duration + delay; t += period) s.measurements.push_back(measure(s, t));
      d.sensors.push_back(s);
    };
    add(sensor(EgoSensorType::dvl, Vector<3>::Constant(0.01)), 0.4, 0.13);
    add(sensor(EgoSensorType::heading, Vector<3>::Constant(0.01), SE3(SO3::Exp({0, 0, 1.0}), Vector<3>::Zero())), 1.0,
        0.31);
    add(sensor(EgoSensorType::gps, Vector<3>::Constant(0.5), SE3(SO3(), Vector<3>(0.2, 0, 0.5))), 2.0, 0.47);
    add(sensor(EgoSensorType::depth, Eigen::VectorXd::Constant(1, 0.05), SE3(SO3(), Vector<3>(-0.3, 0, 0))), 0.5, 0.09);
    return d;
  }

  /// Returns the truth with small errors, every `step` seconds.
  std::vector<Stamped<EgoState>> guess(double step = 1.0) const {
    std::vector<Stamped<EgoState>> g;
    for (int k = 0; k * step <= duration + 1e-9; ++k) {
      EgoState s = state(k * step);
      s.pose = s.pose * SE3::Exp((Vector<6>() << 0.3, -0.2, 0.1, 0.02, -0.02, 0.05).finished() * std::sin(k));
      s.velocity += Vector<3>(0.1, -0.1, 0.05) * std::cos(k);
      s.bias.setZero();
      g.push_back({k * step, s});
    }
    return g;
  }
  Alignment start() const {
    Alignment a;
    a.state = state(0);
    a.state.bias.setZero();
    return a;
  }

  /// Returns the largest error of pose [m, rad] and velocity [m/s] at the keyframes.
  double largest_error(const NavigationProblem& problem) const {
    double largest = 0;
    for (std::size_t k = 0; k < problem.keyframes.size(); ++k) {
      const EgoState truth = state(problem.keyframes[k].t), found = problem.state(k);
      largest = std::max(
          {largest, (truth.pose.inverse() * found.pose).Log().norm(), (truth.velocity - found.velocity).norm()});
    }
    return largest;
  }
};

/// Returns the pose of a target near the vehicle, which moves at 1 m/s and turns by 0.02 rad/s.
inline SE3 vessel(double t) {
  return SE3(SO3::Exp({0, 0, 1}), Vector<3>(20, 5, 0)) * SE3::Exp((Vector<6>() << 1, 0, 0, 0, 0, 0.02).finished() * t);
}

}  // namespace tandem::testing
