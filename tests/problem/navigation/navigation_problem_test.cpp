#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/gauss_newton.hpp>

#include "problem/tracking/level_turn.hpp"

namespace tandem {
namespace {

using ::testing::HasSubstr;
using testing::LevelTurn;

NavigationProblem solved(const NavigationData& data, const std::vector<Stamped<EgoState>>& guess,
                         const Alignment& start, const EgoOptions& options = {}) {
  NavigationProblem problem = make_navigation_problem(data, guess, start, options);
  const Summary summary = solve(problem.problem, GaussNewtonOptions{});
  EXPECT_TRUE(summary.converged()) << summary.message;
  return problem;
}

TEST(Navigation, ExactDataGiveTruth) {
  const LevelTurn turn;
  const NavigationProblem problem = solved(turn.data(), turn.guess(), turn.start());
  EXPECT_LE(turn.largest_error(problem), 1e-6);
  EXPECT_EQ(problem.keyframes.size(), 21u);
  EXPECT_EQ(problem.measurements.size(), 50u + 20u + 10u + 40u);
  EXPECT_TRUE(problem.splits.empty());
}

TEST(Navigation, BuildingThrowsStopped) {
  const LevelTurn turn;
  const std::atomic<bool> stop = true;
  EXPECT_THROW(make_navigation_problem(turn.data(), turn.guess(), turn.start(), {}, Stop(&stop)), Stopped);
}

/// Compares measurements between keyframes, propagated by the IMU, with one keyframe per measurement.
TEST(Navigation, MeasurementsBetweenKeyframesMatchOnesAtKeyframes) {
  LevelTurn turn;
  turn.duration = 6;
  NavigationData data = turn.data();
  for (EgoSensor& sensor : data.sensors)  // the same noise for both problems
    for (std::size_t i = 0; i < sensor.measurements.size(); ++i)
      sensor.measurements[i].value +=
          sensor.sigma[0] * Vector<3>(std::sin(double(i)), std::cos(3. * double(i)), std::sin(2. + double(i)));
  const NavigationProblem coarse = solved(data, turn.guess(), turn.start());

  std::vector<double> times;
  for (const auto& [t, state] : turn.guess()) times.push_back(t);
  for (const EgoEvent& event : in_time_order(data.sensors)) times.push_back(event.t);
  std::sort(times.begin(), times.end());
  std::vector<Stamped<EgoState>> guess;
  for (const double t : times)
    if (guess.empty() || t - guess.back().t > kSameInstant) guess.push_back({t, turn.state(t)});
  const NavigationProblem fine = solved(data, guess, turn.start());
  ASSERT_GT(fine.keyframes.size(), 3 * coarse.keyframes.size());
  for (std::size_t k = 0; k < coarse.keyframes.size(); ++k)
    for (std::size_t j = 0; j < fine.keyframes.size(); ++j) {
      if (std::abs(fine.keyframes[j].t - coarse.keyframes[k].t) > 1e-9) continue;
      // Only the fine problem has IMU noise over fractions of a second: 1e-3 m/s, compared to 1e-2 m/s of the DVL.
      const EgoState a = coarse.state(k), b = fine.state(j);
      EXPECT_LE((a.pose.inverse() * b.pose).Log().norm(), 3e-3) << k;
      EXPECT_LE((a.velocity - b.velocity).norm(), 3e-3) << k;
    }
  EXPECT_GT(turn.largest_error(coarse), 5e-3) << "the noise has an effect";
}

TEST(Navigation, EstimatesImuBiases) {
  LevelTurn turn;
  turn.duration = 60;
  turn.bias << 0.02, -0.03, 0.05, 1e-3, -2e-3, 3e-3;
  std::vector<Stamped<EgoState>> guess = turn.guess();
  for (int i = 0; i < 3; ++i) {  // repeats the preintegration at the estimated biases
    const NavigationProblem problem = solved(turn.data(), guess, turn.start());
    for (std::size_t k = 0; k < guess.size(); ++k) guess[k].value = problem.state(k);
  }
  const Vector<6> off = guess.back().value.bias - turn.bias;
  EXPECT_LE(off.tail<3>().norm(), 2e-4) << off.transpose();
  EXPECT_NEAR(off[2], 0, 5e-3) << "vertical accelerometer";
}

TEST(Navigation, CoastsThroughImuGap) {
  const LevelTurn turn;
  NavigationData data = turn.data();
  std::erase_if(data.imu->samples, [](const ImuSample& s) { return s.t > 7.3 && s.t < 9.6; });
  const NavigationProblem problem = solved(data, turn.guess(), turn.start());
  ASSERT_EQ(problem.splits.size(), 1u) << "adjacent intervals are merged";
  EXPECT_EQ(problem.splits.front(), std::pair(7.0, 10.0));
  const auto num_discarded = problem.num_discarded;
  EXPECT_GT(num_discarded[0], 2u) << "DVL readings in the gap";
  EXPECT_LE(turn.largest_error(problem), 0.3) << "coasting goes straight, the vehicle turns by 0.1 rad/s for 3 s";
}

TEST(Navigation, SupportsDvlAndHeadingWithoutImu) {
  const LevelTurn turn;
  NavigationData data = turn.data();
  data.imu.reset();
  std::vector<Stamped<EgoState>> guess;
  for (const EgoEvent& event : in_time_order(data.sensors))
    if (guess.empty() || event.t - guess.back().t > kSameInstant) guess.push_back({event.t, turn.state(event.t)});
  Alignment start = turn.start();
  start.state = turn.state(guess.front().t);
  const NavigationProblem problem = solved(data, guess, start);
  EXPECT_THAT(problem.num_discarded, ::testing::Each(0u));
  EXPECT_TRUE(problem.splits.empty()) << "there is no IMU";
  EXPECT_LE(turn.largest_error(problem), 0.08)
      << "a centripetal acceleration of 0.15 m/s² acts for 0.4 s between readings";
}

TEST(Navigation, SupportsPreintegratedDvl) {
  const LevelTurn turn;
  EgoOptions options;
  options.preintegrated_dvl = true;
  const NavigationProblem problem = solved(turn.data(), turn.guess(), turn.start(), options);
  EXPECT_LE(turn.largest_error(problem), 1e-3);
  for (const PlacedEgoMeasurement& m : problem.measurements) EXPECT_EQ(m.block.has_value(), m.sensor != 0);
}

TEST(Navigation, EstimatesDvlScale) {
  LevelTurn turn;
  turn.dvl_scale = 0.02;
  EgoOptions options;
  options.dvl_scale = true;
  turn.duration = 60;
  const NavigationProblem problem = solved(turn.data(), turn.guess(), turn.start(), options);
  ASSERT_TRUE(problem.dvl_scale);
  EXPECT_NEAR(problem.problem.value(*problem.dvl_scale).vector()[0], 0.02, 2e-3);
}

TEST(Navigation, AppliesSensorDelay) {
  const LevelTurn turn;
  NavigationData data = turn.data(0.35);
  EXPECT_LE(turn.largest_error(solved(data, turn.guess(), turn.start())), 1e-6);
  for (EgoSensor& sensor : data.sensors) sensor.delay = 0;
  EXPECT_GE(turn.largest_error(solved(data, turn.guess(), turn.start())), 1e-2);
}

TEST(Navigation, RejectsInvalidInput) {
  const LevelTurn turn;
  NavigationData data = turn.data();
  const auto rejection = [&] {
    try {
      make_navigation_problem(data, turn.guess(), turn.start());
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  data.sensors[3].sigma = Vector<3>::Ones();
  EXPECT_THAT(rejection(), HasSubstr("depth: a depth needs 1 standard deviations, not 3"));
  EXPECT_THROW(make_navigation_problem(turn.data(), {{0.0, turn.state(0)}}, turn.start()), Error);
}

TEST(CoarseAlignment, ComputesTiltHeadingPositionAndVelocity) {
  const LevelTurn turn;
  const Alignment a = coarse_alignment(turn.data());
  EXPECT_EQ(a.t, 0);
  EXPECT_FALSE(a.heading_unknown);
  // Error sources: the centripetal acceleration, 0.015 rad, and the rotation until the first heading.
  EXPECT_LE((turn.pose(0).rotation().inverse() * a.state.pose.rotation()).Log().norm(), 0.06);
  EXPECT_LE((turn.pose(0).translation() - a.state.pose.translation()).norm(), 1.0);
  EXPECT_LE((turn.velocity(0) - a.state.velocity).norm(), 0.1);
}

TEST(CoarseAlignment, HeadingIsUnknownIfObservableLater) {
  const LevelTurn turn;
  NavigationData data = turn.data();
  data.sensors.erase(data.sensors.begin() + 1);
  EXPECT_TRUE(coarse_alignment(data).heading_unknown);
  data.sensors.erase(data.sensors.begin() + 1);  // GPS
  const Alignment a = coarse_alignment(data);
  EXPECT_FALSE(a.heading_unknown) << "zero by definition";
  EXPECT_NEAR(a.state.pose.translation().head<2>().norm(), 0, 1e-12);
  const Alignment aligned = coarse_alignment(turn.data());
  const EgoState s = aligned.rotated_about_vertical(1.0);
  EXPECT_LE((s.velocity - SO3::Exp({0, 0, 1.0}).act(aligned.state.velocity)).norm(), 1e-12);
}

TEST(CoarseAlignment, NeedsImuOrHeadingWithDvlOrGps) {
  NavigationData data = LevelTurn().data();
  data.imu.reset();
  EXPECT_NO_THROW(coarse_alignment(data));
  std::erase_if(data.sensors, [](const EgoSensor& s) { return s.type == EgoSensorType::dvl; });
  EXPECT_NO_THROW(coarse_alignment(data));
  std::erase_if(data.sensors, [](const EgoSensor& s) { return s.type == EgoSensorType::gps; });
  EXPECT_THROW(coarse_alignment(data), Error);
}

}  // namespace
}  // namespace tandem
