#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/tracking/tracking_initial_guess.hpp>
#include <tandem/solvers/gauss_newton.hpp>

#include "simulated_run.hpp"

/// Tests that outliers() finds measurements with large errors, and that a robust problem ignores them.
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
    TrackingOptions options{.model = MotionModel::constant_velocity};  // the orientation is not observable
    make_robust(options);
    return make_tracking_problem(data, options);
  }
  /// Returns the largest distance between the robust estimates for two data sets [m].
  static double largest_difference(const TrackingData& data_a, const TrackingData& data_b) {
    TrackingProblem a = robust(data_a), b = robust(data_b);
    EXPECT_TRUE(converges(a));
    EXPECT_TRUE(converges(b));
    double largest = 0;
    for (std::size_t k = 0; k < a.keyframes.size(); ++k)
      largest = std::max(largest, (a.target_state(k).position - b.target_state(k).position).norm());
    return largest;
  }
};

/// Positions every two seconds, some of them with large errors.
class FarPositions : public Outliers {
 protected:
  FarPositions() { data = run.data({{.name = "usbl", .type = SensorType::position}}, every(2.0, 0.0, 40.0)); }
  double initial_guess_error() const {
    TrackingOptions options;
    make_robust(options);
    return run.largest_error(make_tracking_problem(data, options));
  }
};

TEST_P(FarPositions, FindsNoneInGoodData) { EXPECT_TRUE(found().empty()); }

TEST_P(FarPositions, FindsSingleOutlierAtAnyDistance) {
  const TrackingData good = data;
  const std::size_t last = data.sensors[0].measurements.size() - 1;
  const double clean = initial_guess_error();
  for (const double far : {1e3, -1e6, 1e150})
    for (const std::size_t i : {std::size_t(0), std::size_t(7), last}) {
      data = good;
      data.sensors[0].measurements[i].position.y() += far;
      const auto outliers = found();
      ASSERT_EQ(outliers.size(), 1u) << far << " m, measurement " << i;
      EXPECT_EQ(outliers[0].index, i) << far;
      EXPECT_GT(outliers[0].sigmas, 50.0) << far;
      EXPECT_LE(initial_guess_error(), clean + 5.0)
          << far << " m, measurement " << i << "; the initial guess has only a gap";
    }
}

TEST_P(FarPositions, SortsSeveralOutliersWorstFirst) {
  for (const std::size_t i : {3u, 4u, 12u}) data.sensors[0].measurements[i].position.x() -= 1e4 * double(i);
  const auto outliers = found();
  ASSERT_EQ(outliers.size(), 3u);
  EXPECT_GT(outliers[0].sigmas, outliers[2].sigmas);
}

/// Gross outliers get no residual, so they cannot affect the estimate.
TEST_P(FarPositions, DoNotAffectRobustEstimate) {
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
    EXPECT_FALSE(tracking.measurements[7].block) << "gross outlier";
  }
}

/// The motion prior is stiff, but a tight turn must not give outliers. A large error in the turn must still be found.
TEST_P(Outliers, DoNotIncludeTightTurn) {
  run.target_twist = twist(2.0, 0.4);
  data = run.data({{.name = "usbl", .type = SensorType::position}}, every(1.0, 0.0, 40.0));
  data.noise.constant_twist.setConstant(1e-4);
  EXPECT_TRUE(found().empty());
  data.sensors[0].measurements[20].position.x() += 100;
  const auto outliers = found();
  ASSERT_EQ(outliers.size(), 1u);
  EXPECT_EQ(outliers[0].index, 20u);
}

/// One measurement has a large error. It must be the only outlier, and must not affect the robust estimate.
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
        TrackingData without = good;
        without.sensors[0].measurements[i].held_out = true;  // keeps its keyframe
        EXPECT_LE(largest_difference(without, data), 0.01) << "m";
      }
  }
  const std::vector<std::function<void(Measurement&)>> far_ranges = {[](Measurement& m) { m.range += 1e3; },
                                                                     [](Measurement& m) { m.range += 1e6; },
                                                                     [](Measurement& m) { m.range = 1e150; }};
  const std::vector<std::function<void(Measurement&)>> turned = {[](Measurement& m) { m.azimuth += M_PI / 2; },
                                                                 [](Measurement& m) { m.azimuth += 3; }};
};

TEST_P(FarMeasurement, BearingWithPositions) {
  const auto good =
      run.data({{.name = "camera", .type = SensorType::bearing}, {.name = "usbl", .type = SensorType::position}},
               every(1.0, 0.0, 40.0));
  check(good, turned);
}

TEST_P(FarMeasurement, RangeWithPositions) {
  const auto good =
      run.data({{.name = "modem", .type = SensorType::range}, {.name = "usbl", .type = SensorType::position}},
               every(1.0, 0.0, 40.0));
  check(good, far_ranges);
}

TEST_P(FarMeasurement, RangeAndBearing) {
  const auto good = run.data({{.name = "radar", .type = SensorType::range_bearing}}, every(1.0, 0.0, 40.0));
  check(good, far_ranges);
  check(good, turned);
}

/// Without positions, a measurement can only be compared with its neighbours.
TEST_P(FarMeasurement, BearingsOnly) {
  run.chaser_twist = (Vector<6>() << 1.4, 0.0, 0.0, 0.0, 0.0, 0.15).finished();
  run.target_twist = twist(0.5, 0.0);
  check(run.data({{.name = "camera", .type = SensorType::bearing}}, every(0.5, 0.0, 40.0)), turned);
}

TEST_P(FarMeasurement, RangesOnly) {
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
