#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/online/innovation_gate.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

#include "problem/tracking/simulated_run.hpp"

namespace tandem::detail {
namespace {

using tandem::testing::SimulatedRun;
using ::testing::HasSubstr;

Gaussian unit(double sigma) { return Gaussian{sigma}; }

/// A random walk in one dimension and a measurement of its newest step.
TEST(InnovationGate, IsTheInnovationOverItsStandardDeviation) {
  FixedLag lag;
  Problem& problem = lag.problem();
  const auto x0 = lag.add(0, Rn<1>(Vector<1>(0.5)), "x0");
  problem.minimize(Prior<Rn<1>>{Rn<1>(Vector<1>(0.5))}, unit(2), {x0});
  ASSERT_TRUE(lag.update().converged());
  const auto x1 = lag.add(1, Rn<1>(Vector<1>(0.5)), "x1");
  problem.minimize(RelativePose<Rn<1>>{Rn<1>()}, unit(1.5), {x0, x1});
  ASSERT_TRUE(lag.relinearize());
  EXPECT_NEAR(lag.covariance(x1)(0, 0), 4 + 2.25, 1e-10);  // up to the regularisation of the smoother
  const Block block = problem.minimize(Prior<Rn<1>>{Rn<1>(Vector<1>(9.5))}, unit(0.5), {x1});
  const double sigmas = normalized_innovation(lag, block, 1).value().sigmas;
  EXPECT_NEAR(sigmas, 9 / std::sqrt(4 + 2.25 + 0.25), 1e-10);
  // Its square is twice the increase of the minimal cost.
  EXPECT_NEAR(2 * lag.update().cost, sigmas * sigmas, 1e-6);
}

TEST(InnovationGate, IsSmallForUnobservableStates) {
  FixedLag lag;
  const auto x = lag.add(0, R3(Vector<3>::Zero()), "x"), y = lag.add(0, R3(Vector<3>::Zero()), "y");
  lag.problem().minimize(RelativePose<R3>{R3()}, Gaussian{1.0, 1.0, 1.0}, {x, y});
  ASSERT_TRUE(lag.relinearize());
  const Block block = lag.problem().minimize(Prior<R3>{R3(Vector<3>(1e6, 0, 0))}, Gaussian{1.0, 1.0, 1.0}, {y});
  EXPECT_LT(normalized_innovation(lag, block, 3).value().sigmas, 2.0);
  const Block absurd = lag.problem().minimize(Prior<R3>{R3(Vector<3>(1e200, 0, 0))}, Gaussian{1.0, 1.0, 1.0}, {y});
  EXPECT_EQ(normalized_innovation(lag, absurd, 3).value().sigmas, HUGE_VAL);
  EXPECT_FALSE(has_finite_cost(lag.problem(), absurd));
}

/// A run with odometry at 4 Hz and exact fixes at 1 Hz. `change` may change or remove fixes.
class GatedRun {
 public:
  explicit GatedRun(OnlineOptions options = {}) : estimator_(data_, {}, std::move(options)) {
    estimator_.on_reset = [this](const TrackReset& reset) { resets.push_back(reset); };
    estimator_.on_reject = [this](const std::string&, const Rejection& why) { rejections.push_back(why.kind); };
  }

  template <class F>
  void run(double from, double to, F change, const SE3& origin = {}) {
    for (double t = from; t < to; t += 0.25) {
      estimator_.add_odometry({t, origin * run_.chaser(t)});
      if (std::fmod(t, 1.0) != 0) continue;
      if (std::optional<Measurement> m = change(run_.measure(data_.sensors[0], t))) estimator_.add_target(0, *m);
    }
  }
  void run(double from, double to) {
    run(from, to, [](const Measurement& m) { return std::optional(m); });
  }
  double error() const {
    const double t = estimator_.newest();
    const Vector<3> truth = run_.chaser(t).inverse().act(run_.target(t).translation());
    return (estimator_.chaser().pose.inverse().act(estimator_.target().value().position) - truth).norm();
  }
  OnlineEstimator& estimator() { return estimator_; }
  SE3 chaser(double t) const { return run_.chaser(t); }
  const SensorHealth& health() const { return estimator_.health().sensors.at(0); }

  std::vector<TrackReset> resets;
  std::vector<Rejection::Kind> rejections;

 private:
  SimulatedRun run_;
  TrackingData data_ = run_.data({{.name = "usbl", .type = SensorType::position}}, {});
  OnlineEstimator estimator_;
};

std::optional<Measurement> displaced(Measurement m) {
  m.position.x() += 200;
  return m;
}

TEST(OnlineGate, RejectsAndCountsOutliers) {
  GatedRun run;
  run.run(0, 30);
  run.run(30, 32, displaced);
  run.run(32, 40);
  EXPECT_EQ(run.health().rejected, 2u);
  EXPECT_EQ(run.rejections.size(), 2u);
  EXPECT_EQ(run.rejections.front(), Rejection::Kind::outside_gate);
  EXPECT_EQ(run.health().used, 38u);
  EXPECT_LT(run.error(), 0.05);
  EXPECT_TRUE(run.resets.empty());
}

TEST(OnlineGate, GatesTheFirstMeasurementOfASensorWithSystematicErrors) {
  SimulatedRun run;
  run.duration = 60;
  TrackingData data =
      run.data({{.name = "usbl", .type = SensorType::position}, {.name = "late", .type = SensorType::position}}, {});
  SystematicError& error = data.sensors[1].error.emplace();
  error.bias_sigma = Eigen::VectorXd::Constant(3, 0.5);
  error.scale_sigma = error.misalignment_sigma = 0.02;
  OnlineEstimator estimator(data, {}, {});
  for (double t = 0; t < 40; t += 0.25) {
    estimator.add_odometry({t, run.chaser(t)});
    if (std::fmod(t, 1.0) != 0) continue;
    estimator.add_target(0, run.measure(data.sensors[0], t));
    if (t == 30) estimator.add_target(1, *displaced(run.measure(data.sensors[1], t)));
    if (t > 32) estimator.add_target(1, run.measure(data.sensors[1], t));
  }
  EXPECT_EQ(estimator.health().sensors.at(1).rejected, 1u);
  EXPECT_GE(estimator.health().sensors.at(1).used, 6u);
}

TEST(OnlineGate, ResetsToASensorThatKeepsContradictingTheEstimate) {
  GatedRun run;
  run.run(0, 30);
  run.run(30, 37, displaced);
  EXPECT_TRUE(run.resets.empty()) << "only six seconds";
  run.run(37, 41, displaced);
  ASSERT_EQ(run.resets.size(), 1u);
  EXPECT_EQ(run.resets[0].kind, TrackReset::Kind::contradicted);
  EXPECT_THAT(run.resets[0].why, HasSubstr("usbl contradicts the estimate: it was rejected until 37"));
  EXPECT_NEAR(run.error(), 200, 1) << "the estimate follows the displaced fixes";
  EXPECT_EQ(run.estimator().health().target.state, OutputState::unconfirmed);
  EXPECT_FALSE(run.estimator().health().target.confirmed);
  EXPECT_LT(run.estimator().keyframes(), 10u) << "the old window is discarded";
  run.run(41, 70);
  EXPECT_EQ(run.estimator().health().resets, 2u);
  EXPECT_LT(run.error(), 0.5);
}

TEST(OnlineGate, UsesAllFiniteMeasurementsIfDisabled) {
  OnlineOptions options;
  options.reset.gate = HUGE_VAL;
  GatedRun run(options);
  run.run(0, 30);
  run.run(30, 31, displaced);
  EXPECT_EQ(run.health().rejected, 0u);
  run.run(31, 32, [](Measurement m) {
    m.position.x() = 1e308;
    return std::optional(m);
  });
  run.run(32, 40);
  EXPECT_TRUE(run.estimator().target()->position.allFinite());
}

TEST(OnlineGate, SuspendsTheEstimateAfterALongGap) {
  GatedRun run;
  run.run(0, 30);
  run.run(30, 200, [](const Measurement&) { return std::optional<Measurement>(); });
  ASSERT_EQ(run.resets.size(), 1u);
  EXPECT_EQ(run.resets[0].kind, TrackReset::Kind::suspended);
  EXPECT_NEAR(run.resets[0].t, 89, 1.5);
  EXPECT_FALSE(run.estimator().has_target());
  run.run(200, 230);
  EXPECT_TRUE(run.estimator().has_target());
  EXPECT_LT(run.error(), 0.5);
  EXPECT_EQ(run.estimator().health().suspensions, 1u);
}

TEST(OnlineGate, OutputsBecomeLostThenInvalidThenNone) {
  const auto nothing = [](const Measurement&) { return std::optional<Measurement>(); };
  GatedRun run;
  const TrackHealth& health = run.estimator().health();
  EXPECT_EQ(health.target.state, OutputState::none);
  run.run(0, 30);
  run.run(30, 49.25, nothing);
  EXPECT_EQ(health.target.state, OutputState::aided) << "the last fix was at 29 s";
  run.run(49.25, 49.75, nothing);
  EXPECT_EQ(health.target.state, OutputState::lost);
  EXPECT_NEAR(health.target.age, 20.5, 1e-9);
  run.run(49.75, 69.75, nothing);
  EXPECT_EQ(health.target.state, OutputState::invalid);
  EXPECT_EQ(health.chaser.state, OutputState::aided) << "odometry continues";
  run.run(69.75, 100, nothing);
  EXPECT_EQ(health.target.state, OutputState::none) << "the estimate is suspended";
  run.run(100, 110);
  EXPECT_EQ(health.target.state, OutputState::aided);
}

TEST(OnlineGate, RejectedMeasurementsDoNotAid) {
  OnlineOptions options;
  options.reset.lost_after = 5;
  GatedRun run(options);
  run.run(0, 30);
  run.run(30, 36, displaced);
  EXPECT_EQ(run.health().last_received, 35.0);
  EXPECT_EQ(run.estimator().health().target.state, OutputState::lost);
}

TEST(OnlineGate, TheChaserAgesByOtherStreamsWhenOdometryEnds) {
  GatedRun run;
  run.run(0, 30);
  Measurement fix{};
  fix.position = {10, 0, 0};
  for (fix.t = 31; fix.t <= 71; ++fix.t) {
    run.estimator().add_target(0, fix);
    const OutputState expected = fix.t - 29.75 > 40   ? OutputState::invalid
                                 : fix.t - 29.75 > 20 ? OutputState::lost
                                                      : OutputState::aided;
    ASSERT_EQ(run.estimator().health().chaser.state, expected) << fix.t;
  }
}

TEST(OnlineGate, ResetsIfOdometryJumpsToANewOrigin) {
  GatedRun run;
  run.run(0, 30);
  OnlineEstimator& estimator = run.estimator();
  const SE3 away(SO3(), {1e5, 0, 0});
  int rejected = 0;
  for (double t = 30; t < 33; t += 0.25) rejected += estimator.add_odometry({t, away}).has_value();
  EXPECT_EQ(rejected, 4);
  ASSERT_EQ(run.resets.size(), 1u);
  EXPECT_THAT(run.resets[0].why, HasSubstr("odometry jumped to a new origin at 30"));
}

/// The poses of the excursion say nothing of the chaser, so it does not become more certain.
TEST(OnlineGate, ContinuesAfterAnExcursionOfTheOdometry) {
  GatedRun run;
  OnlineEstimator& estimator = run.estimator();
  const auto sigma = [&] { return std::sqrt(estimator.covariance().chaser.topLeftCorner<3, 3>().trace()); };
  run.run(0, 30);
  const double before = sigma();
  const SE3 away(SO3::Exp({0, 0, 1}), {500, 0, 0});
  run.run(
      30, 36, [](const Measurement& m) { return std::optional(m); }, away);
  run.run(36, 45);
  ASSERT_EQ(run.resets.size(), 2u);
  EXPECT_THAT(run.resets[0].why, HasSubstr("odometry jumped to a new origin at 30"));
  EXPECT_THAT(run.resets[1].why, HasSubstr("odometry returned to its earlier origin at 36"));
  EXPECT_LT((estimator.chaser().pose.inverse() * run.chaser(estimator.newest())).Log().norm(), 1e-3);
  EXPECT_LT(run.error(), 0.05);
  EXPECT_GE(sigma(), before);
}

TEST(OnlineGate, AWrongFirstPoseOfTheOdometryIsDropped) {
  GatedRun run;
  OnlineEstimator& estimator = run.estimator();
  estimator.add_odometry({0, SE3(SO3(), {500, 0, 0})});
  run.run(0.25, 20);
  EXPECT_LT((estimator.chaser().pose.inverse() * run.chaser(estimator.newest())).Log().norm(), 1e-3);
  EXPECT_LT(run.error(), 0.05);
}

}  // namespace
}  // namespace tandem::detail
