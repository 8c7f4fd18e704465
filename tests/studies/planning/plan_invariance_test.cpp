#include <cmath>

#include <gtest/gtest.h>

#include "studies/planning/docking_plans.hpp"

namespace tandem::testing {
namespace {

struct World {
  const char* name;
  double yaw;
  Vector<3> offset;
  double later;
};

/// A plan does not depend on the axes, the origin and the epoch of the world.
class PlanInvariance : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Vehicles, PlanInvariance, ::testing::Values("remus_100", "bluerov2_heavy"));

TEST_P(PlanInvariance, CostIsTheSameInEveryWorld) {
  const Vehicle vehicle = docking_vehicle(GetParam());
  const World worlds[] = {{"yaw 137°", 2.39, {0, 0, 0}, 0},
                          {"yaw 180°", M_PI, {0, 0, 0}, 0},
                          {"yaw −100°", -1.75, {0, 0, 0}, 0},
                          {"UTM", 0.0, {5e5, 4.5e6, 0}, 0},
                          {"Unix time", 0.0, {0, 0, 0}, 1.7e9}};
  for (const double at : {200.0, 300.0}) {
    const auto run = [&](const Scenario& scenario, double later) {
      return plan_scenario(scenario, {}, vehicle, plan_at(at + later, vehicle, Vector<3>(-2, 0, 0), 30));
    };
    const PlannedRun reference = run(docking(), 0.0);
    ASSERT_TRUE(reference.accepted()) << reference.summary.message;
    for (const World& world : worlds) {
      const PlannedRun other = run(docking(world.yaw, world.offset, world.later), world.later);
      EXPECT_TRUE(other.accepted()) << world.name << ", " << at << " s: " << other.summary.message;
      EXPECT_NEAR(other.summary.cost, reference.summary.cost, 1e-4 * reference.summary.cost)
          << world.name << ", " << at << " s";
    }
  }
}

}  // namespace
}  // namespace tandem::testing
