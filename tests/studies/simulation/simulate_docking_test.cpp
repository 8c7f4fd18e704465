#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/simulation/simulate_docking_files.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

TEST(SimulateDocking, DefaultsResembleDockingA) {
  const SimulatedDocking docking = simulate_docking();
  ASSERT_EQ(docking.data.sensors.size(), 2u);
  EXPECT_EQ(docking.data.odometry.size(), 12'001u);
  const auto &usbl = docking.data.sensors[0].measurements, &optical = docking.data.sensors[1].measurements;
  EXPECT_NEAR(double(usbl.size()), 158, 40);
  EXPECT_NEAR(double(optical.size()), 624, 150);
  const SE3 drift = docking.truth_chaser.back().value.inverse() * docking.data.odometry.back().value;
  EXPECT_GT(drift.translation().norm(), 0.1);
  EXPECT_LT(drift.translation().norm(), 20.0);
  for (std::size_t k = 1; k < docking.truth_target.size(); ++k) {
    const SE3 step = docking.truth_target[k - 1].value.inverse() * docking.truth_target[k].value;
    EXPECT_LT(step.Log().head<3>().norm(), 0.15) << "jump at step " << k;
    EXPECT_LT(step.Log().tail<3>().norm(), 0.02);
    const SE3 own = docking.truth_chaser[k - 1].value.inverse() * docking.truth_chaser[k].value;
    EXPECT_LT(own.Log().head<3>().norm(), 0.4);
    EXPECT_LT(own.Log().tail<3>().norm(), 0.02);
  }
}

/// Normalised errors of odometry steps and of both sensors have unit variance.
TEST(SimulateDocking, NoiseHasTheStatedSigmas) {
  const SimulatedDocking docking = simulate_docking({.minutes = 60, .seed = 3});
  const auto expect_unit = [](double sum, double count, const char* what) {
    EXPECT_NEAR(sum / count, 1.0, 5 * std::sqrt(2 / count)) << what;
  };
  double sum = 0, count = 0;
  const auto& odometry = docking.data.odometry;
  for (std::size_t k = 1; k < odometry.size(); ++k) {
    const SE3 truth = docking.truth_chaser[k - 1].value.inverse() * docking.truth_chaser[k].value;
    const SE3 reckoned = odometry[k - 1].value.inverse() * odometry[k].value;
    const Vector<6> e = (truth.inverse() * reckoned).Log();
    sum += e.cwiseQuotient(Vector<6>(docking.data.noise.odometry) * std::sqrt(0.1)).squaredNorm();
    count += 6;
  }
  expect_unit(sum, count, "odometry");
  for (const TargetSensor& sensor : docking.data.sensors) {
    sum = count = 0;
    for (const Measurement& m : sensor.measurements) {
      const auto k = std::size_t(std::lround(m.t / 0.1));
      const SE3 seen = docking.truth_chaser[k].value.inverse() * docking.truth_target[k].value;
      sum += ((m.position - seen.translation()) / sensor.sigma[0]).squaredNorm();
      count += 3;
      if (sensor.type != SensorType::pose) continue;
      sum += ((seen.rotation().inverse() * m.rotation).Log() / sensor.sigma[3]).squaredNorm();
      count += 3;
    }
    expect_unit(sum, count, sensor.name.c_str());
  }
}

TEST(SimulateDocking, FolderReadsBackAndSolves) {
  const ScratchFolder folder;
  const DockingOptions options{.minutes = 5, .seed = 7};
  const SimulatedDocking docking = simulate_docking(options);
  write_docking(docking, options, folder.path());
  EXPECT_THAT(files(folder.path()),
              testing::UnorderedElementsAre("scenario.yaml", "chaser_odometry.tum", "usbl.csv", "optical.csv",
                                            "truth_chaser.tum", "truth_target.tum"));
  const Scenario scenario = read_scenario(folder.path());
  EXPECT_TRUE(scenario.has_truth());
  EXPECT_EQ(scenario.data.odometry.size(), docking.data.odometry.size());
  EXPECT_EQ(scenario.data.noise.constant_twist, docking.data.noise.constant_twist);
  for (std::size_t s = 0; s < 2; ++s) {
    const TargetSensor &a = scenario.data.sensors[s], &b = docking.data.sensors[s];
    EXPECT_EQ(a.sigma, b.sigma);
    ASSERT_EQ(a.measurements.size(), b.measurements.size());
    EXPECT_LE((a.measurements.back().position - b.measurements.back().position).norm(), 1e-4);
  }
  EXPECT_TRUE(estimate(scenario, {}, GaussNewtonOptions{}).summary.converged());
}

TEST(SimulateDocking, ResultDependsOnTheSeed) {
  const auto last = [](std::uint64_t seed) {
    return simulate_docking({.minutes = 1, .seed = seed}).data.odometry.back().value.translation();
  };
  EXPECT_EQ(last(1), last(1));
  EXPECT_NE(last(1), last(2));
}

TEST(SimulateDocking, RejectsOptionsOutOfRange) {
  EXPECT_THAT(error_of([] { simulate_docking({.minutes = 0.1}); }),
              HasSubstr("minutes must be 1 to 6000 for a docking, not 0.1"));
}

}  // namespace
}  // namespace tandem
