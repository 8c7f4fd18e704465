#pragma once

#include <cmath>
#include <vector>

#include <tandem/lie/operations.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>

#include "simulated_tracking.hpp"

/// Noise-free simulation like Simulation, for sensors of any type, in space or in the plane. Trigonometry computes the
/// measurements from the truth, independently of the residuals under test.
namespace tandem::testing {

inline Vector<6> twist(double surge, double yaw_rate) {
  return (Vector<6>() << surge, 0.0, 0.0, 0.0, 0.0, yaw_rate).finished();
}

struct SimulatedRun {
  bool planar = false;
  double duration = 12.0;  ///< s
  Vector<6> target_twist = twist(0.9, 0.06);
  Vector<6> chaser_twist = (Vector<6>() << 1.4, 0.1, 0.02, 0.01, -0.02, 0.03).finished();

  SE3 flat(const SE3& x) const { return planar ? in_space(in_group<SE2>(x)) : x; }
  SE3 chaser(double t) const {
    Vector<6> w = chaser_twist;
    if (planar) w.segment<3>(2).setZero();
    return flat(Simulation::pose(-20.0, 4.0, -3.0, 0.2)) * SE3::Exp(w * t);
  }
  SE3 target(double t) const { return flat(Simulation::pose(2.0, -5.0, -4.0, 0.8)) * SE3::Exp(target_twist * t); }

  /// Returns the measurement that is stamped t.
  Measurement measure(const TargetSensor& sensor, double t) const {
    const double valid = t - sensor.delay;
    const SE3 seen = (chaser(valid) * sensor.mount).inverse() * target(valid) * sensor.marker;
    const Vector<3> p = seen.translation();
    Measurement m{.t = t};
    if (sensor.type == SensorType::position || sensor.type == SensorType::pose) m.position = p;
    if (sensor.type == SensorType::pose) m.rotation = seen.rotation();
    m.range = p.norm();
    m.azimuth = std::atan2(p.y(), p.x());
    m.elevation = std::atan2(p.z(), std::hypot(p.x(), p.y()));
    return m;
  }

  /// Returns data with odometry at 4 Hz, noise for all models, and a measurement of each sensor at each of the times.
  TrackingData data(std::vector<TargetSensor> sensors, const std::vector<double>& times) const {
    TrackingData d;
    d.planar = planar;
    d.noise = TrackingNoise(planar);
    const auto pose_noise = [&](double position, double angle) {
      Eigen::VectorXd v = Eigen::VectorXd::Constant(planar ? 3 : 6, position);
      v.tail(planar ? 1 : 3).setConstant(angle);
      return v;
    };
    d.noise.prior = pose_noise(1e-2, 1e-3);
    d.noise.odometry = pose_noise(0.05, 0.005);
    d.noise.constant_twist = pose_noise(0.05, 0.02);
    d.noise.constant_velocity.setConstant(0.05);
    const int steps = static_cast<int>(std::lround(4 * duration));
    for (int i = 0; i <= steps; ++i) d.odometry.push_back({0.25 * i, chaser(0.25 * i)});
    for (TargetSensor& sensor : sensors) {
      sensor.sigma = sigma(sensor.type);
      for (const double t : times) sensor.measurements.push_back(measure(sensor, t));
    }
    d.sensors = std::move(sensors);
    return d;
  }

  /// Returns standard deviations of 0.1 m and 0.02 rad.
  Eigen::VectorXd sigma(SensorType type) const {
    Eigen::VectorXd v = Eigen::VectorXd::Constant(rows(type, planar), 0.02);
    const bool position = type == SensorType::position || type == SensorType::pose;
    if (type != SensorType::bearing) v.head(position ? (planar ? 2 : 3) : 1).setConstant(0.1);
    return v;
  }

  /// Sets the variables of the target to the truth, except for boundary points.
  void set_truth(TrackingProblem& tracking) const {
    for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
      const SE3 at = target(tracking.keyframes[k].t);
      const auto set = [&]<LieGroup G>(const Variable<G>& x, const SE3& pose) {
        if constexpr (std::same_as<G, SE3> || std::same_as<G, SE2>) {
          tracking.problem.set_value(x, in_group<G>(pose));
        } else {
          tracking.problem.set_value(x, G(pose.translation().template head<G::dof>()));
        }
      };
      std::visit(
          [&]<class X>(const X& x) {
            if constexpr (requires { x.first; }) {
              set(x.first, target(tracking.keyframes.front().t));
              tracking.problem.set_value(x.speed, Rn<1>(Vector<1>(target_twist[0])));
            } else {
              set(x, at);
            }
          },
          tracking.target[k]);
    }
    for (const TwistVariable& w : tracking.twist)
      std::visit(
          [&]<LieGroup W>(const Variable<W>& x) {
            Vector<W::dof> v;
            if constexpr (W::dof == 6) {
              v = target_twist;
            } else {
              v << target_twist[0], target_twist[1], target_twist[5];
            }
            tracking.problem.set_value(x, W(v));
          },
          w);
  }

  /// Returns the largest position error of the target [m].
  double largest_error(const TrackingProblem& tracking) const {
    double largest = 0;
    for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
      const Vector<3> truth = target(tracking.keyframes[k].t).translation();
      largest = std::max(largest, (tracking.target_state(k).position - truth).norm());
    }
    return largest;
  }
  /// Returns the largest orientation error of the target [rad], of those states that have an orientation.
  double largest_angle(const TrackingProblem& tracking) const {
    double largest = 0;
    for (std::size_t k = 0; k < tracking.keyframes.size(); ++k)
      if (const auto R = tracking.target_state(k).rotation)
        largest = std::max(largest, (target(tracking.keyframes[k].t).rotation().inverse() * *R).Log().norm());
    return largest;
  }
};

inline double cost(TrackingProblem& tracking) { return NlpEvaluator(tracking.problem).cost(); }

/// Returns from, from + step, …, up to `to`.
inline std::vector<double> every(double step, double from, double to) {
  std::vector<double> times;
  for (int i = 0; from + i * step <= to + 1e-9; ++i) times.push_back(from + i * step);
  return times;
}

/// Returns data with one keyframe per character, 1 s apart: 'P' has a measured pose, 'p' a position, and '.' nothing.
inline TrackingData patterned(SimulatedRun run, const std::string& pattern) {
  run.duration = double(pattern.size()) - 1;
  std::vector<double> poses, positions;
  for (std::size_t k = 0; k < pattern.size(); ++k) {
    if (pattern[k] == 'P') poses.push_back(double(k));
    if (pattern[k] == 'p') positions.push_back(double(k));
  }
  TrackingData data = run.data({{.name = "usbl", .type = SensorType::position}}, positions);
  data.sensors.push_back(run.data({{.name = "optical", .type = SensorType::pose}}, poses).sensors[0]);
  return data;
}

}  // namespace tandem::testing
