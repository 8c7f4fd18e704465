#pragma once

#include <cmath>
#include <random>

#include <tandem/problem/tracking/tracking_problem.hpp>

/// Simulation of a chaser and a level target with constant twists. Without noise, interpolated odometry and all
/// residuals are exact, so the cost at the truth is zero.
namespace tandem::testing {

struct Simulation {
  double duration = 20.0;         ///< s
  double odometry_period = 0.25;  ///< s
  double usbl_period = 2.0;       ///< s; the optical sensor measures every 0.7 s in the last third
  double noise = 0.0;             ///< measurement noise, in standard deviations
  bool optical = true;
  SE3 usbl_mount, optical_mount, marker;
  Vector<3> beacon = Vector<3>::Zero();

  static SE3 pose(double x, double y, double z, double yaw) {
    return SE3(SO3::Exp({0.0, 0.0, yaw}), Vector<3>(x, y, z));
  }
  static SE3 chaser(double t) {
    return pose(-20.0, 4.0, -3.0, 0.2) * SE3::Exp((Vector<6>() << 1.4, 0.1, 0.02, 0.01, -0.02, 0.03).finished() * t);
  }
  static SE3 target(double t) {
    return pose(2.0, -5.0, -4.0, 0.8) * SE3::Exp((Vector<6>() << 0.9, 0.0, 0.0, 0.0, 0.0, 0.06).finished() * t);
  }

  TrackingData data() const {
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal(0.0, noise > 0 ? noise : 1.0);
    const auto draw = [&](Eigen::VectorXd v) {
      for (double& entry : v) entry *= noise > 0 ? normal(random) : 0.0;
      return v;
    };
    TrackingData d;
    d.noise.prior = Vector<6>(1e-2, 1e-2, 1e-2, 1e-3, 1e-3, 1e-3);
    d.noise.odometry = Vector<6>(0.05, 0.05, 0.05, 0.005, 0.005, 0.005);
    d.noise.constant_twist = Vector<6>(0.05, 0.02, 0.02, 0.01, 0.01, 0.03);
    const int steps = static_cast<int>(std::lround(duration / odometry_period));
    for (int i = 0; i <= steps; ++i) d.odometry.push_back({i * odometry_period, chaser(i * odometry_period)});

    TargetSensor usbl{.name = "usbl", .type = SensorType::position, .sigma = Vector<3>(0.5, 0.5, 0.5)};
    usbl.mount = usbl_mount;
    usbl.marker = SE3(SO3(), beacon);
    for (double t = 0.4; t < duration; t += usbl_period)
      usbl.measurements.push_back(
          {.t = t, .position = (chaser(t) * usbl_mount).inverse().act(target(t).act(beacon)) + draw(usbl.sigma)});
    d.sensors.push_back(usbl);
    if (!optical) return d;

    TargetSensor camera{.name = "optical", .type = SensorType::pose};
    camera.sigma = Vector<6>(0.05, 0.05, 0.1, 0.03, 0.03, 0.03);
    camera.mount = optical_mount;
    camera.marker = marker;
    for (double t = 2.0 * duration / 3.0; t < duration; t += 0.7) {
      const SE3 z = (chaser(t) * optical_mount).inverse() * target(t) * marker * SE3::Exp(draw(camera.sigma));
      camera.measurements.push_back({.t = t, .position = z.translation(), .rotation = z.rotation()});
    }
    d.sensors.push_back(camera);
    return d;
  }
};

/// Returns the SE(3) variable of a PoseVariable or TargetVariable.
template <class Any>
Variable<SE3> pose(const Any& variable) {
  return std::get<Variable<SE3>>(variable);
}

template <class Any>
std::vector<Variable<SE3>> poses(const std::vector<Any>& variables) {
  std::vector<Variable<SE3>> result;
  for (const Any& x : variables) result.push_back(pose(x));
  return result;
}

/// Returns a simulation whose measurement noise is 1.5 times the given standard deviations.
inline Simulation noisy(double duration) {
  Simulation simulation;
  simulation.duration = duration;
  simulation.noise = 1.5;
  return simulation;
}

}  // namespace tandem::testing
