#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/heading_search/solve_tracking.hpp>

/// Targets that stand, drift or stop, whose heading nothing measures for most of the time. The heading has many local
/// minima, some of them flat.
namespace tandem::testing {
namespace {

SE3 level(double x, double y, double z, double yaw) { return SE3(SO3::Exp({0, 0, yaw}), Vector<3>(x, y, z)); }

struct Case {
  const char* name;
  std::function<SE3(double)> target;
  double usbl_period = 4, usbl_sigma = 0.2, keyframe_interval = 1;  // s, m, s
  Vector<6> constant_twist = Vector<6>(0.15, 0.05, 0.05, 0.02, 0.02, 0.06);
  double poses_until = 0;  // s; a pose each second before
  Role non_holonomic = Role::off;
  bool planar = false;
};

std::function<SE3(double)> straight(double speed, double course, double yaw) {
  return [=](double t) { return level(25 + speed * t * std::cos(course), -5 + speed * t * std::sin(course), -8, yaw); };
}
SE3 swinging(double t) {  // at an anchor
  const double a = 0.6 * std::sin(t / 60);
  return level(25 - 8 * std::cos(a), -5 - 8 * std::sin(a), -8, a);
}
SE3 stopping(double t) { return level(25 + 0.8 * (std::min(t, 150.0) + std::max(t - 400, 0.0)), -5, -8, 0); }

/// Returns 600 s of measurements from a chaser that circles at a depth of 3 m.
TrackingData data_of(const Case& c, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto flat = [&](const Vector<6>& v) {
    return c.planar ? Eigen::VectorXd(Vector<3>(v[0], v[1], v[5])) : Eigen::VectorXd(v);
  };
  const auto chaser = [&](double t) {
    return level(10 * std::cos(t / 40), 10 * std::sin(t / 40), c.planar ? -8 : -3, t / 40 + std::numbers::pi / 2);
  };
  TrackingData d;
  d.planar = c.planar;
  d.keyframe_interval = c.keyframe_interval;
  d.noise = TrackingNoise(c.planar);
  d.noise.prior = flat(Vector<6>::Constant(1e-3));
  d.noise.odometry = flat(Vector<6>(0.01, 0.01, 0.01, 6e-4, 6e-4, 6e-4));
  d.noise.constant_twist = flat(c.constant_twist);
  d.noise.constant_velocity = Vector<3>(0.15, 0.15, 0.05).head(c.planar ? 2 : 3);
  for (double t = 0; t <= 600; t += 0.5) d.odometry.push_back({t, chaser(t)});
  TargetSensor usbl{.name = "usbl", .type = SensorType::position};
  usbl.sigma = Eigen::VectorXd::Constant(c.planar ? 2 : 3, c.usbl_sigma);
  for (double t = 0; t <= 600; t += c.usbl_period) {
    const Vector<3> error = c.usbl_sigma * Vector<3>{normal(random), normal(random), c.planar ? 0 : normal(random)};
    usbl.measurements.push_back({.t = t, .position = chaser(t).inverse().act(c.target(t).translation()) + error});
  }
  d.sensors.push_back(usbl);
  if (c.poses_until == 0) return d;
  TargetSensor optical{.name = "optical", .type = SensorType::pose};
  const Vector<6> sigma(0.14, 0.14, 0.14, 0.04, 0.04, 0.04);
  optical.sigma = flat(sigma);
  for (double t = 0; t <= c.poses_until; t += 1) {
    const Vector<6> error = sigma.unaryExpr([&](double s) { return s * normal(random); });
    const SE3 pose = chaser(t).inverse() * c.target(t) * SE3::Exp(error);
    optical.measurements.push_back({.t = t, .position = pose.translation(), .rotation = pose.rotation()});
  }
  d.sensors.push_back(optical);
  return d;
}

std::vector<Case> cases() {
  const auto dock = straight(0, 0, 0.3);
  Vector<6> calm = Vector<6>::Constant(0.01);
  calm[0] = 0.02;
  return {
      {.name = "dock", .target = dock},
      {.name = "dock, fixes each second", .target = dock, .usbl_period = 1},
      {.name = "dock, fixes each 20 s", .target = dock, .usbl_period = 20},
      {.name = "dock, precise fixes", .target = dock, .usbl_sigma = 0.02},
      {.name = "dock, noisy fixes", .target = dock, .usbl_sigma = 2},
      {.name = "dock, keyframes each 4 s", .target = dock, .keyframe_interval = 4},
      {.name = "dock, little motion noise", .target = dock, .constant_twist = calm},
      {.name = "dock, poses at first", .target = dock, .poses_until = 30},
      {.name = "dock, non-holonomic", .target = dock, .non_holonomic = Role::soft},
      {.name = "dock in the plane", .target = dock, .planar = true},
      {.name = "creeps", .target = straight(0.02, 0, 0)},
      {.name = "drifts", .target = straight(0.1, 1.0, -0.6)},
      {.name = "drifts, non-holonomic", .target = straight(0.2, 2.0, 2.0), .non_holonomic = Role::soft},
      {.name = "swings at an anchor", .target = swinging},
      {.name = "swings in the plane", .target = swinging, .planar = true},
      {.name = "stops and goes on", .target = stopping},
      {.name = "ahead", .target = straight(1, 0.4, 0.4)},
      {.name = "astern", .target = straight(-1, 0.4, 0.4)},
      {.name = "astern, poses at first", .target = straight(-1, 0.4, 0.4), .poses_until = 30},
  };
}

/// Mode B has no headings and is nearly linear. Mode A converges in at most 5 times its iterations, and in 3 times on
/// average.
TEST(SlowTarget, ConvergesInAFewTimesTheIterationsOfPoints) {
  double sum = 0, count = 0;
  for (const Case& c : cases())
    for (const unsigned seed : {1u, 2u}) {
      const TrackingData data = data_of(c, seed);
      TrackingOptions options{.non_holonomic = c.non_holonomic};
      TrackingProblem poses = make_tracking_problem(data, options);
      options.mode = Mode::B;
      TrackingProblem points = make_tracking_problem(data, options);
      const Summary a = solve(poses.problem, GaussNewtonOptions{}), b = solve(points.problem, GaussNewtonOptions{});
      EXPECT_TRUE(a.converged() && b.converged()) << c.name << ": " << a.message;
      EXPECT_LE(a.iterations, 5 * b.iterations) << c.name << ", seed " << seed;
      sum += double(a.iterations) / b.iterations;
      ++count;
    }
  EXPECT_LE(sum / count, 3);
}

/// If the motion noise is equal in all directions, no start is better than others, and the cost is flat.
TEST(SlowTarget, ConvergesWithEqualMotionNoise) {
  for (const auto& target : {straight(0, 0, 0.3), std::function<SE3(double)>(stopping)}) {
    Case c{.name = "isotropic", .target = target};
    c.constant_twist.setConstant(0.01);
    TrackingProblem tracking = make_tracking_problem(data_of(c, 2));
    const Summary s = solve(tracking.problem, GaussNewtonOptions{});
    EXPECT_TRUE(s.converged()) << s.message;
  }
}

}  // namespace
}  // namespace tandem::testing
