#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/solvers/replanning/conflicting_limits.hpp>

#include "solvers/replanning/hovering_vehicle.hpp"

namespace tandem::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

/// A hovering vehicle at a depth of 8 m, 10 m from a target at rest.
class ConflictingLimits : public ::testing::Test {
 protected:
  static constexpr int kSteps = 8;
  VehicleModel<8> vehicle = hovering_vehicle();
  PlanOptions plan;
  PlannerOptions options{.solver = PlanSolver::augmented_lagrangian};
  VehicleState<8> start{.pose = SE3(SO3(), {0.0, 0.0, -8.0})};

  void SetUp() override {
    plan.steps = kSteps;
    plan.goal = SE3(SO3(), {-2.5, 0.0, 0.0});
    plan.twist = Bounds<6>{-Vector<6>::Ones(), Vector<6>::Ones()};
    plan.lowest = -20.0;
    plan.highest = -1.0;
    plan.max_roll_pitch = 0.3;
    plan.keep_out = 2.0;
    plan.view = Cone{0.9};
  }

  std::vector<PlanLimit> conflict() const {
    TargetBelief belief;
    belief.now = belief.before = SE3(SO3(), {10.0, 0.0, -8.0});
    const auto target = predict_target(belief, Vector<6>::Constant(0.01), plan.dt, kSteps);
    return conflicting_limits(vehicle, plan, options, start, Vector<3>(Vector<3>::Zero()), target);
  }
};

TEST_F(ConflictingLimits, AreEmptyForAFeasibleRequest) { EXPECT_THAT(conflict(), IsEmpty()); }

TEST_F(ConflictingLimits, CommandsAndTwistForATooFastChaser) {
  start.twist[0] = 0.9;
  plan.twist->upper[0] = -0.6;  // reverse within a second
  EXPECT_THAT(conflict(), UnorderedElementsAre(PlanLimit::commands, PlanLimit::twist));
}

TEST_F(ConflictingLimits, TwistAndDepthForAnUnreachableDepth) {
  plan.highest = -12.0;
  EXPECT_THAT(conflict(), UnorderedElementsAre(PlanLimit::twist, PlanLimit::depth));
}

TEST_F(ConflictingLimits, TwistAndKeepOutForAChaserWithinTheKeepOut) {
  plan.goal = SE3(SO3(), {-14.0, 0.0, 0.0});
  plan.keep_out = 13.5;
  EXPECT_THAT(conflict(), UnorderedElementsAre(PlanLimit::twist, PlanLimit::keep_out));
}

TEST_F(ConflictingLimits, TwistAndViewForATargetOutOfView) {
  for (const double yaw : {2.0, 2.8, 3.0, 3.1}) {
    start.pose = SE3(SO3::Exp({0.0, 0.0, yaw}), start.pose.translation());
    EXPECT_THAT(conflict(), UnorderedElementsAre(PlanLimit::twist, PlanLimit::view)) << yaw;
  }
}

}  // namespace
}  // namespace tandem::testing
