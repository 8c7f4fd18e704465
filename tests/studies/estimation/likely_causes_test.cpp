#include <gtest/gtest.h>

#include <tandem/studies/estimation/estimate.hpp>

#include "paths.hpp"

namespace tandem {
namespace {

/// Returns the first part of docking_a, with each measurement of a sensor changed.
template <class Change>
Scenario changed(Change change, const std::string& name = "optical") {
  Scenario scenario = read_scenario(std::string(paths::source) + "/share/scenarios/docking_a");
  std::erase_if(scenario.data.odometry, [](const auto& at) { return at.t > 260; });
  for (TargetSensor& sensor : scenario.data.sensors) {
    std::erase_if(sensor.measurements, [](const Measurement& m) { return m.t > 260; });
    if (sensor.name == name)
      for (Measurement& m : sensor.measurements) change(m);
  }
  return scenario;
}

std::string best_cause(const Scenario& scenario, bool covariance = false) {
  GaussNewtonOptions solver;
  solver.max_iterations = 60;
  const Estimate found = estimate(scenario, {}, solver, false, {}, covariance);
  EXPECT_EQ(found.fit.consistent(), found.causes.empty());
  return found.causes.empty() ? "" : found.causes.front().sensor + ": " + found.causes.front().text;
}

TEST(LikelyCauses, NameOrderOfQuaternions) {
  EXPECT_EQ(best_cause(changed([](Measurement& m) {
              const Eigen::Quaterniond q = m.rotation.quaternion();
              m.rotation = SO3(Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()));  // w x y z read as x y z w
            })),
            "optical: quaternions are ordered w x y z");
}

TEST(LongLikelyCauses, NameTheMistake) {
  EXPECT_EQ(best_cause(changed([](Measurement&) {})), "");
  EXPECT_EQ(best_cause(changed(
                [](Measurement& m) { m.position = Vector<3>(m.position.y(), m.position.x(), m.position.z()); })),
            "optical: x and y are swapped");
  EXPECT_EQ(best_cause(changed([](Measurement& m) {
              const SE3 inverse = SE3(m.rotation, m.position).inverse();
              m.rotation = inverse.rotation();
              m.position = inverse.translation();
            })),
            "optical: poses are inverted (sensor in target)");
}

// The motion model bends, so that no residual is twice as large as expected.
TEST(LongLikelyCauses, NameAxesThatTheMotionHides) {
  const auto swapped = [](Measurement& m) { m.position = Vector<3>(m.position.y(), m.position.x(), m.position.z()); };
  EXPECT_EQ(best_cause(changed(swapped, "usbl"), true), "usbl: x and y are swapped");
}

}  // namespace
}  // namespace tandem
