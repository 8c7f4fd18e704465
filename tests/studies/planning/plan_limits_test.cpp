#include <algorithm>
#include <array>

#include <gtest/gtest.h>

#include <tandem/studies/planning/plan_report.hpp>

#include "studies/planning/docking_plans.hpp"

namespace tandem::testing {
namespace {

/// A limit that a user can request, with the option that it belongs to.
struct Limit {
  PlanLimit limit;
  const char* option;
};
constexpr std::array<Limit, 5> kLimits{{{PlanLimit::depth, "--depth"},
                                        {PlanLimit::roll_pitch, "--most-roll-pitch"},
                                        {PlanLimit::keep_out, "--keep-out"},
                                        {PlanLimit::approach, "--approach"},
                                        {PlanLimit::view, "--view"}}};

void request(const Limit& limit, PlanOptions& plan) {
  switch (limit.limit) {
    case PlanLimit::depth:
      plan.highest = -0.5, plan.lowest = -2.0;
      return;
    case PlanLimit::roll_pitch:
      plan.max_roll_pitch = 0.05;
      return;
    case PlanLimit::keep_out:
      plan.keep_out = 5.5;
      return;
    case PlanLimit::approach:
      plan.approach = Cone{0.5, SE3(SO3::Exp({0.0, 0.0, M_PI}), Vector<3>(Vector<3>::Zero()))};
      return;
    case PlanLimit::view:
      plan.view = Cone{0.7};
      return;
    default:
      FAIL();
  }
}

class PlanLimits : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(LongVehicles, PlanLimits, ::testing::Values("remus_100", "bluerov2_heavy"));

/// Plans with each limit alone and with each pair of limits. A plan exists without limits, so the message of each
/// failure must name the option of a limit.
TEST_P(PlanLimits, AreKeptOrNamedByTheirOption) {
  const Scenario scenario = docking();
  const Vehicle vehicle = docking_vehicle(GetParam());
  const PlanRequest free = plan_at(200.0, vehicle, Vector<3>(-6, 0, 0), 8);
  ASSERT_TRUE(plan_scenario(scenario, {}, vehicle, free).accepted());
  int planned = 0, named = 0;
  for (std::size_t i = 0; i < kLimits.size(); ++i)
    for (std::size_t j = i; j < kLimits.size(); ++j) {
      PlanRequest limited = free;
      request(kLimits[i], limited.plan);
      request(kLimits[j], limited.plan);
      const PlannedRun run = plan_scenario(scenario, {}, vehicle, limited);
      const std::string message = why_not_accepted(run);
      if (run.accepted()) {
        ++planned;
        continue;
      }
      const auto names = [&](const Limit& limit) { return message.find(limit.option) != std::string::npos; };
      EXPECT_TRUE(names(kLimits[i]) || names(kLimits[j]))
          << kLimits[i].option << ", " << kLimits[j].option << ": " << message;
      ++named;
    }
  RecordProperty("planned", planned);
  EXPECT_GT(named, 0);
}

}  // namespace
}  // namespace tandem::testing
