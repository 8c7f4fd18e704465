#include <Eigen/LU>
#include <gtest/gtest.h>

#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/relative_covariance.hpp>

#include "problem/tracking/simulated_run.hpp"
#include "target_lines.hpp"

/// Predictions of the window, compared with the batch problem with additional keyframes without measurements.
namespace tandem::testing {
namespace {

struct Case {
  std::string name;
  TrackingOptions options;
};

std::vector<Case> cases() {
  return {{"constant twist", {}},
          {"constant twist, non-holonomic", {.non_holonomic = Role::soft}},
          {"constant twist, inactive limits", {.surge = between(0.0, 2.0), .max_yaw_rate = 0.5, .limits = Role::soft}},
          {"constant twist, free to roll and pitch", {.roll_pitch = Role::off}},
          {"constant twist, mode B", {.mode = Mode::B}},
          {"constant twist, mode B, direct", {.mode = Mode::B, .junction = Junction::direct}},
          {"constant velocity", {.model = MotionModel::constant_velocity}},
          {"damped twist", {.model = MotionModel::damped_twist}},
          {"damped twist, non-holonomic", {.model = MotionModel::damped_twist, .non_holonomic = Role::soft}},
          {"damped twist, mode B", {.model = MotionModel::damped_twist, .mode = Mode::B}},
          {"damped velocity", {.model = MotionModel::damped_velocity}},
          {"white noise on acceleration", {.model = MotionModel::white_noise_acceleration}},
          {"white noise on acceleration, non-holonomic",
           {.model = MotionModel::white_noise_acceleration, .non_holonomic = Role::soft}}};
}

/// A recording up to time `now`, and its continuation by h seconds of odometry without measurements of the target.
struct Recording {
  TrackingData until_now, until_then;
  double now;

  /// Ignores measurements after `now` [s]; there must be one at `now`.
  Recording(const TrackingData& whole, double now, double h) : until_then(whole), now(now) {
    for (TargetSensor& sensor : until_then.sensors)
      std::erase_if(sensor.measurements, [&](const Measurement& m) { return m.t > now + kSameInstant; });
    until_now = cropped(until_then);
    auto& odometry = until_then.odometry;
    const SE3 then = pose_at(odometry, now + h).value();
    std::erase_if(odometry, [&](const Stamped<SE3>& x) {
      return x.t < until_now.odometry.front().t + kSameInstant || x.t > now + h - kSameInstant;
    });
    odometry.insert(odometry.begin(), until_now.odometry.front());
    odometry.push_back({now + h, then});
  }
};

/// A recording up to the end of a pattern (see patterned()).
Recording recording(const std::string& pattern, double h, bool planar) {
  SimulatedRun simulation;
  simulation.planar = planar;
  TrackingData whole = patterned(simulation, pattern + std::string(std::size_t(std::ceil(h)), '.'));
  whole.noise.twist_time.setConstant(20);
  whole.noise.velocity_time.setConstant(30);
  return {whole, double(pattern.size()) - 1, h};
}

/// Returns the target at the last keyframe relative to the chaser at keyframe k.
RelativeTarget seen_from(std::size_t k, TrackingProblem& all) {
  const SE3 chaser = all.chaser_pose(k);
  const std::size_t last = all.keyframes.size() - 1;
  RelativeTarget relative{chaser.inverse().act(all.target_state(last).position)};
  const Marginals marginals(all.problem);
  relative.covariance.emplace(Matrix<3, 3>::Zero());
  std::visit(
      [&]<class C, class T>(const Variable<C>& c, const T& t) {
        if constexpr (requires { all.problem.value(t); }) {
          if constexpr (requires {
                          relative_position_covariance(all.problem.value(c), all.problem.value(t),
                                                       marginals.joint(c, t));
                        }) {
            relative.covariance->template topLeftCorner<C::point_dim, C::point_dim>() =
                relative_position_covariance(all.problem.value(c), all.problem.value(t), marginals.joint(c, t));
          }
        }
      },
      all.chaser[k], all.target[last]);
  return relative;
}

struct Compared {
  RelativeTarget expected, found;
  double difference() const { return (found.position - expected.position).norm(); }  ///< m
  double ratio() const { return (*found.covariance - *expected.covariance).norm() / expected.covariance->norm(); }
};

Compared compare(const Recording& recording, const TrackingOptions& options, double h) {
  OnlineEstimator estimator(recording.until_now, {}, exactly_tracking(options));
  run(recording.until_now, estimator);
  TrackingProblem all = batch(recording.until_then, options);
  std::size_t now = 0;
  while (all.keyframes[now].t < recording.now - kSameInstant) ++now;
  EXPECT_NEAR(estimator.newest(), recording.now, 1e-9);
  EXPECT_NEAR(all.keyframes[now].t, recording.now, 1e-9);
  EXPECT_NEAR(all.keyframes.back().t, recording.now + h, 1e-9);
  const Compared c{seen_from(now, all), estimator.relative_target(h).value()};
  EXPECT_GT(c.expected.covariance->trace(), estimator.relative_target(0)->covariance->trace());
  const SE3 chaser = estimator.chaser().pose;
  EXPECT_LE((chaser.inverse().act(estimator.predicted_target(h)->position) - c.found.position).norm(), 1e-9);
  return c;
}

void check(const Case& c, const std::string& pattern, double h, bool planar) {
  SCOPED_TRACE(c.name + ", " + pattern + ", " + std::to_string(h) + " s" + (planar ? ", in the plane" : ""));
  const Compared both = compare(recording(pattern, h, planar), c.options, h);
  EXPECT_LE(both.difference(), 1e-4);
  ASSERT_TRUE(both.found.covariance.has_value());
  EXPECT_LE(both.ratio(), 1e-3) << *both.found.covariance << "\n\n" << *both.expected.covariance;
}

TEST(OnlineForecast, AgreesWithTheBatchEstimateOfFutureKeyframes) {
  for (const Case& c : cases())
    for (const char* pattern : {"P.pP.p", "Pp.PPP", "P..p.P"})  // ends with a point, with poses, with one pose
      for (const double h : {0.4, 1.0, 3.5, 20.0}) check(c, pattern, h, false);
}

TEST(OnlineForecast, AgreesWithTheBatchEstimateInThePlane) {
  for (const Case& c : cases())
    for (const char* pattern : {"P.pP.p", "Pp.PPP", "P..p.P"}) check(c, pattern, 2.5, true);
}

/// Differs slightly from the batch estimate, since each keyframe takes one filter step instead of iterations.
TEST(OnlineForecast, IsCloseToTheBatchEstimateForNoisyFixes) {
  Simulation simulation;
  simulation.noise = 1.0;
  TrackingData whole = simulation.data();
  whole.noise.constant_velocity.setConstant(0.1);
  const double now = whole.sensors[1].measurements[4].t, h = 2.5;
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const Compared both = compare({whole, now, h}, c.options, h);
    ASSERT_TRUE(both.found.covariance.has_value());
    EXPECT_LE(both.difference(), 0.1 * std::sqrt(both.expected.covariance->trace()));
    EXPECT_LE(both.ratio(), 0.05) << *both.found.covariance << "\n\n" << *both.expected.covariance;
  }
}

/// Several horizons of the motion model must not change the information.
TEST(OnlineForecast, CovarianceGrowsWithTheHorizon) {
  const Recording r = recording("P.pP.p", 1.0, false);
  for (const TrackingOptions& options :
       {TrackingOptions{}, TrackingOptions{.mode = Mode::B}, TrackingOptions{.horizons = {{1, 1}, {2, 2}}}}) {
    OnlineEstimator estimator(r.until_now, {}, exactly_tracking(options));
    run(r.until_now, estimator);
    double before = estimator.relative_target(0)->covariance->trace();
    const auto at_once = estimator.relative_target(1e-9)->covariance;
    ASSERT_TRUE(at_once.has_value());
    EXPECT_NEAR(at_once->trace(), before, 1e-6 * before);
    for (const double h : {0.1, 0.5, 1.0, 5.0, 60.0}) {
      const auto covariance = estimator.relative_target(h)->covariance;
      ASSERT_TRUE(covariance.has_value()) << h;
      const double variance = covariance->trace();
      EXPECT_GT(variance, before) << h;
      before = variance;
    }
  }
}

/// With points only, the orientation is unobservable in mode A, so the motion along the heading has no covariance.
TEST(OnlineForecast, HasNoCovarianceIfTheOrientationIsUnobservable) {
  const Recording r = recording("ppppppp", 5.0, false);
  OnlineEstimator estimator(r.until_now, {}, exactly_tracking({}));
  const std::vector<Line> all = lines(r.until_now);
  std::size_t i = 0;
  while (!estimator.has_target() && i < all.size()) give(r.until_now, all[i++], estimator);
  ASSERT_TRUE(estimator.relative_target(5.0).has_value()) << "at a first keyframe";
  EXPECT_FALSE(estimator.relative_target(5.0)->covariance.has_value());
  while (i < all.size()) give(r.until_now, all[i++], estimator);
  estimator.finish();
  const RelativeTarget there = estimator.relative_target(5.0).value();
  EXPECT_FALSE(there.covariance.has_value());
  const SimulatedRun truth;
  EXPECT_LE((there.position - truth.chaser(6).inverse().act(truth.target(11).translation())).norm(), 1.5);
  EXPECT_FALSE(estimator.relative_target(-1.0)->covariance.has_value());

  OnlineEstimator by_points(r.until_now, {}, exactly_tracking({.mode = Mode::B}));
  run(r.until_now, by_points);
  EXPECT_TRUE(by_points.relative_target(5.0)->covariance.has_value());
}

}  // namespace
}  // namespace tandem::testing
