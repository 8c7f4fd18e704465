#include <gtest/gtest.h>

#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/studies/tuning/contradicting_measurements.hpp>

namespace tandem {
namespace {

/// Returns the number of contradicting measurements of a camera that sees these headings [rad] of a standing target, at
/// x = 10 m or at `last` in the end, with this standard deviation.
int count(const std::vector<double>& headings, double sigma = 0.05, double last = 10) {
  Scenario scenario;
  TrackingData& data = scenario.data;
  data.noise.prior = data.noise.odometry = data.noise.constant_twist = Vector<6>::Constant(0.02);
  TargetSensor camera{.name = "camera", .type = SensorType::pose, .sigma = Vector<6>::Constant(sigma)};
  for (std::size_t k = 0; k < headings.size(); ++k) {
    data.odometry.push_back({double(k), SE3()});
    const double x = k + 1 == headings.size() ? last : 10;
    camera.measurements.push_back(
        {.t = double(k), .position = Vector<3>(x, 0, 0), .rotation = SO3::Exp({0, 0, headings[k]})});
  }
  data.sensors = {camera};
  TrackingOptions options;
  make_robust(options);
  CalibrationProblem problem(scenario, options, {});
  EXPECT_TRUE(solve(problem.problem(), GaussNewtonOptions{}).converged());
  return count_contradicting_measurements(problem);
}

TEST(ContradictingMeasurements, AreTurnedDetectionsWhereverTheyAre) {
  const std::vector<double> straight(12, 0.0);
  EXPECT_EQ(count(straight), 0);
  for (const std::size_t where : {0, 6, 11})
    for (const double turn : {1.57, 3.1}) {
      std::vector<double> headings = straight;
      headings[where] = turn;
      EXPECT_EQ(count(headings), 1) << where << ": " << turn;
    }
}

TEST(ContradictingMeasurements, IncludeGrossOutliers) { EXPECT_EQ(count(std::vector<double>(12, 0.0), 0.05, 1e4), 1); }

/// Residuals of 20 stated standard deviations at all measurements are a wrong noise.
TEST(ContradictingMeasurements, ExcludeNoiseThatIsStatedTooSmall) {
  std::vector<double> headings;
  for (int k = 0; k < 12; ++k) headings.push_back(k % 2 == 0 ? 0.1 : -0.1);
  EXPECT_EQ(count(headings, 0.005), 0);
}

}  // namespace
}  // namespace tandem
