#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/tracking/tracking_start.hpp>
#include <tandem/solvers/gauss_newton.hpp>

#include "simulated_run.hpp"

/// Which measurements the others contradict, and that a robust problem is without them.
namespace tandem::testing {
namespace {

class Outliers : public ::testing::TestWithParam<bool> {  // planar
 protected:
  SimulatedRun run{.planar = GetParam(), .duration = 40.0};
  TrackingData data;

  std::vector<Outlier> found() const {
    const auto keyframes = make_keyframes(data);
    return outliers(data, keyframes, odometry_at(data.odometry, keyframes));
  }
  static ::testing::AssertionResult converges(TrackingProblem& tracking) {
    const Summary summary = solve(tracking.problem, GaussNewtonOptions{});
    if (summary.converged()) return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << summary.message << ", cost " << summary.cost;
  }
  static TrackingProblem robust(const TrackingData& data) {
    TrackingOptions options{.model = MotionModel::constant_velocity};  // nothing tells an orientation
    make_robust(options);
    return make_tracking_problem(data, options);
  }
  /// By how much the robust estimates of both differ [m].
  static double moved(const TrackingData& from, const TrackingData& to) {
    TrackingProblem a = robust(from), b = robust(to);
    EXPECT_TRUE(converges(a));
    EXPECT_TRUE(converges(b));
    double most = 0;
    for (std::size_t k = 0; k < a.keyframes.size(); ++k)
      most = std::max(most, (a.target_state(k).position - b.target_state(k).position).norm());
    return most;
  }
};

/// Positions every two seconds, of which some lie.
class FarPositions : public Outliers {
 protected:
  FarPositions() { data = run.data({{.name = "usbl", .type = SensorType::position}}, every(2.0, 0.0, 40.0)); }
  double start_error() const {
    TrackingOptions options;
    make_robust(options);
    return run.largest_error(make_tracking_problem(data, options));
  }
};

TEST_P(FarPositions, NoneOfGoodOnes) { EXPECT_TRUE(found().empty()); }

TEST_P(FarPositions, OneIsNamedHoweverFarAndWhereverItIs) {
  const TrackingData good = data;
  const std::size_t last = data.sensors[0].measurements.size() - 1;
  const double clean = start_error();
  for (const double far : {1e3, -1e6, 1e150})
    for (const std::size_t i : {std::size_t(0), std::size_t(7), last}) {
      data = good;
      data.sensors[0].measurements[i].position.y() += far;
      const auto outliers = found();
      ASSERT_EQ(outliers.size(), 1u) << far << " m, measurement " << i;
      EXPECT_EQ(outliers[0].index, i) << far;
      EXPECT_GT(outliers[0].sigmas, 50.0) << far;
      EXPECT_LE(start_error(), clean + 5.0) << far << " m, measurement " << i << ": a gap, no more";
    }
}

TEST_P(FarPositions, SeveralAreNamedTheWorstFirst) {
  for (const std::size_t i : {3u, 4u, 12u}) data.sensors[0].measurements[i].position.x() -= 1e4 * double(i);
  const auto outliers = found();
  ASSERT_EQ(outliers.size(), 3u);
  EXPECT_GT(outliers[0].sigmas, outliers[2].sigmas);
}

/// Gross ones are no part of the problem, so that nothing of them can get into the estimate.
TEST_P(FarPositions, TheRobustSettingIsNotMovedByOne) {
  data = run.data({{.name = "camera", .type = SensorType::pose}}, every(0.5, 0.0, 40.0));
  TrackingOptions options;
  make_robust(options);
  TrackingProblem clean = make_tracking_problem(data, options);
  ASSERT_TRUE(converges(clean));
  for (const double far : {1e3, 1e6, 1e150}) {
    TrackingData wrong = data;
    wrong.sensors[0].measurements[7].position.x() = far;
    TrackingProblem tracking = make_tracking_problem(wrong, options);
    ASSERT_TRUE(converges(tracking)) << far;
    for (std::size_t k = 0; k < tracking.keyframes.size(); ++k)
      EXPECT_LE((tracking.target_state(k).position - clean.target_state(k).position).norm(), 0.01) << far << ", " << k;
    EXPECT_FALSE(tracking.measurements[7].block) << "left out";
  }
}

/// A tight turn under a prior that holds the target to a straight line: no fix is an outlier, and one is among them.
TEST_P(Outliers, AreNoGoodFixesOfATightTurn) {
  run.target_twist = twist(2.0, 0.4);
  data = run.data({{.name = "usbl", .type = SensorType::position}}, every(1.0, 0.0, 40.0));
  data.noise.constant_twist.setConstant(1e-4);
  EXPECT_TRUE(found().empty());
  data.sensors[0].measurements[20].position.x() += 100;
  const auto outliers = found();
  ASSERT_EQ(outliers.size(), 1u);
  EXPECT_EQ(outliers[0].index, 20u);
}

/// One measurement of a sensor is far off: it is found, alone, and the robust estimate is as if it had not been.
class FarMeasurement : public Outliers {
 protected:
  void check(const TrackingData& good, const std::vector<std::function<void(Measurement&)>>& faults) {
    data = good;
    EXPECT_TRUE(found().empty());
    const std::size_t last = good.sensors[0].measurements.size() - 1;
    for (std::size_t f = 0; f < faults.size(); ++f)
      for (const std::size_t i : {std::size_t(0), std::size_t(13), last}) {
        SCOPED_TRACE(::testing::Message() << "fault " << f << ", measurement " << i);
        data = good;
        faults[f](data.sensors[0].measurements[i]);
        const auto outliers = found();
        ASSERT_EQ(outliers.size(), 1u);
        EXPECT_EQ(outliers[0].sensor, 0u);
        EXPECT_EQ(outliers[0].index, i);
        EXPECT_TRUE(outliers[0].gross);
        TrackingData without = good;  // its keyframe stays
        without.sensors[0].measurements[i].held_out = true;
        EXPECT_LE(moved(without, data), 0.01) << "m";
      }
  }
  const std::vector<std::function<void(Measurement&)>> far_ranges = {[](Measurement& m) { m.range += 1e3; },
                                                                     [](Measurement& m) { m.range += 1e6; },
                                                                     [](Measurement& m) { m.range = 1e150; }};
  const std::vector<std::function<void(Measurement&)>> turned = {[](Measurement& m) { m.azimuth += M_PI / 2; },
                                                                 [](Measurement& m) { m.azimuth += 3; }};
};

TEST_P(FarMeasurement, OfABearingBesidePositions) {
  const auto good =
      run.data({{.name = "camera", .type = SensorType::bearing}, {.name = "usbl", .type = SensorType::position}},
               every(1.0, 0.0, 40.0));
  check(good, turned);
}

TEST_P(FarMeasurement, OfARangeBesidePositions) {
  const auto good =
      run.data({{.name = "modem", .type = SensorType::range}, {.name = "usbl", .type = SensorType::position}},
               every(1.0, 0.0, 40.0));
  check(good, far_ranges);
}

TEST_P(FarMeasurement, OfARangeAndBearing) {
  const auto good = run.data({{.name = "radar", .type = SensorType::range_bearing}}, every(1.0, 0.0, 40.0));
  check(good, far_ranges);
  check(good, turned);
}

/// Nothing tells where the target is but its own neighbours.
TEST_P(FarMeasurement, OfBearingsAlone) {
  run.chaser_twist = (Vector<6>() << 1.4, 0.0, 0.0, 0.0, 0.0, 0.15).finished();
  run.target_twist = twist(0.5, 0.0);
  check(run.data({{.name = "camera", .type = SensorType::bearing}}, every(0.5, 0.0, 40.0)), turned);
}

TEST_P(FarMeasurement, OfRangesAlone) {
  data = run.data({{.name = "modem", .type = SensorType::range}}, every(0.5, 0.0, 40.0));
  EXPECT_TRUE(found().empty());
  for (const auto& fault : far_ranges) {
    TrackingData wrong = data;
    fault(wrong.sensors[0].measurements[13]);
    std::swap(wrong, data);
    const auto outliers = found();
    std::swap(wrong, data);
    ASSERT_EQ(outliers.size(), 1u);
    EXPECT_EQ(outliers[0].index, 13u);
    EXPECT_TRUE(outliers[0].gross);
  }
}

INSTANTIATE_TEST_SUITE_P(Groups, FarPositions, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "SE2" : "SE3"; });
INSTANTIATE_TEST_SUITE_P(Groups, Outliers, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "SE2" : "SE3"; });
INSTANTIATE_TEST_SUITE_P(Groups, FarMeasurement, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "SE2" : "SE3"; });

}  // namespace
}  // namespace tandem::testing
