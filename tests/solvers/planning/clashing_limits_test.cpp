#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/solvers/planning/clashing_limits.hpp>

#include "solvers/planning/hoverer.hpp"

namespace tandem::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

/// A hoverer 8 m deep, 10 m before a target at rest.
class ClashingLimits : public ::testing::Test {
 protected:
  static constexpr int kSteps = 8;
  VehicleModel<8> vehicle = hoverer();
  PlanOptions plan;
  PlannerOptions options{.solver = PlanSolver::augmented_lagrangian};
  VehicleState<8> start{.pose = SE3(SO3(), {0.0, 0.0, -8.0})};

  void SetUp() override {
    plan.steps = kSteps;
    plan.goal = SE3(SO3(), {-2.5, 0.0, 0.0});
    plan.twist = Bounds<6>{-Vector<6>::Ones(), Vector<6>::Ones()};
    plan.lowest = -20.0;
    plan.highest = -1.0;
    plan.most_roll_pitch = 0.3;
    plan.keep_out = 2.0;
    plan.view = Cone{0.9};
  }

  std::vector<PlanLimit> clash() const {
    TargetBelief belief;
    belief.now = belief.before = SE3(SO3(), {10.0, 0.0, -8.0});
    const auto target = predict_target(belief, Vector<6>::Constant(0.01), plan.dt, kSteps);
    return clashing_limits(vehicle, plan, options, start, Vector<3>(Vector<3>::Zero()), target);
  }
};

TEST_F(ClashingLimits, NoneWhereThereIsAPlan) { EXPECT_THAT(clash(), IsEmpty()); }

TEST_F(ClashingLimits, ATwistAboveItsBoundClashesWithWeakThrusters) {
  start.twist[0] = 0.9;
  plan.twist->upper[0] = -0.6;  // astern within a second
  EXPECT_THAT(clash(), UnorderedElementsAre(PlanLimit::commands, PlanLimit::twist));
}

TEST_F(ClashingLimits, ADepthThatIsTooFarToReach) {
  plan.highest = -12.0;
  EXPECT_THAT(clash(), UnorderedElementsAre(PlanLimit::twist, PlanLimit::depth));
}

TEST_F(ClashingLimits, AKeepOutThatBeginsBehindTheChaser) {
  plan.goal = SE3(SO3(), {-14.0, 0.0, 0.0});
  plan.keep_out = 13.5;
  EXPECT_THAT(clash(), UnorderedElementsAre(PlanLimit::twist, PlanLimit::keep_out));
}

TEST_F(ClashingLimits, AViewThatTheTargetIsFarOutOf) {
  for (const double yaw : {2.0, 2.8, 3.0, 3.1}) {
    start.pose = SE3(SO3::Exp({0.0, 0.0, yaw}), start.pose.translation());
    EXPECT_THAT(clash(), UnorderedElementsAre(PlanLimit::twist, PlanLimit::view)) << yaw;
  }
}

}  // namespace
}  // namespace tandem::testing
