#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/studies/rendezvous/rendezvous_study.hpp>
#include <tandem/studies/support/statistics.hpp>

namespace tandem {
namespace {

TEST(Rendezvous, DecoupledDocksKeepsOutAndIsReproducible) {
  if (!ipopt_available()) GTEST_SKIP() << "this build has no Ipopt";
  const Vehicle vehicle = read_vehicle("remus_100");
  RendezvousOptions options;
  options.seed = 3;
  const RendezvousRun run = run_rendezvous(vehicle, options), again = run_rendezvous(vehicle, options);
  EXPECT_EQ(run.outcome, RendezvousOutcome::docked) << run.why;
  EXPECT_LE(run.miss, 0.3);
  EXPECT_EQ(run.keep_out_violation, 0.0);
  EXPECT_LE(run.worst_violation, 1e-6);
  EXPECT_GT(run.plans, 20);
  ASSERT_EQ(run.steps.size(), again.steps.size());
  for (std::size_t k = 0; k < run.steps.size(); ++k) EXPECT_EQ(run.steps[k].command, again.steps[k].command) << k;
  EXPECT_EQ(run.miss, again.miss);
  bool docking = false;  // stays true: a retreat may enter the keep-out distance
  for (const RendezvousStep& step : run.steps) {
    docking |= step.phase == RendezvousPhase::docking;
    EXPECT_TRUE(docking || step.distance >= options.keep_out) << step.t;
  }
  EXPECT_TRUE(docking);
}

/// Without speed, the fins of a torpedo-shaped vehicle have no effect. A hovering vehicle needs control to stay level.
TEST(Rendezvous, HoldsSpeedAndLevelWhileSearching) {
  for (const char* name : {"remus_100", "bluerov2_heavy"}) {
    RendezvousOptions options;
    options.time_limit = 9.0;
    const RendezvousRun run = run_rendezvous(read_vehicle(name), options);
    ASSERT_EQ(run.steps.size(), 9u);
    for (std::size_t k = 5; k < run.steps.size(); ++k) {
      ASSERT_EQ(run.steps[k].phase, RendezvousPhase::searching);
      const SE3 moved = run.steps[k - 1].chaser.inverse() * run.steps[k].chaser;
      EXPECT_NEAR(moved.translation().x(), options.target_speed, 0.1) << name << ", " << k << " s";
      EXPECT_NEAR(run.steps[k].chaser.rotation().matrix()(2, 2), 1.0, 0.02) << name << ", " << k << " s";
    }
  }
}

TEST(Rendezvous, CoupledDocksAsWell) {
  if (!ipopt_available()) GTEST_SKIP() << "this build has no Ipopt";
  RendezvousOptions options;
  options.seed = 3;
  options.method = RendezvousMethod::coupled;
  const RendezvousRun run = run_rendezvous(read_vehicle("remus_100"), options);
  EXPECT_EQ(run.outcome, RendezvousOutcome::docked) << run.why;
  EXPECT_EQ(run.keep_out_violation, 0.0);
  EXPECT_LE(run.worst_violation, 1e-6);
  int coupled = 0;
  for (const RendezvousStep& step : run.steps) coupled += step.origin.find("coupled") != std::string::npos;
  EXPECT_GE(coupled, run.plans / 2);
}

/// Without expected fixes, the 2 σ margin at the end of the horizon would leave no room to dock.
TEST(Rendezvous, DocksWithChanceMargins) {
  if (!ipopt_available()) GTEST_SKIP() << "this build has no Ipopt";
  RendezvousOptions options;
  options.seed = 3;
  options.chance = 2.0;
  const RendezvousRun run = run_rendezvous(read_vehicle("remus_100"), options);
  EXPECT_EQ(run.outcome, RendezvousOutcome::docked) << run.why;
  EXPECT_EQ(run.keep_out_violation, 0.0);
  EXPECT_LE(run.worst_violation, 1e-6);
}

TEST(Rendezvous, RejectsInvalidOptions) {
  const Vehicle vehicle = read_vehicle("remus_100");
  RendezvousOptions options;
  options.standoff = options.keep_out;
  EXPECT_THROW(run_rendezvous(vehicle, options), Error);
  options = {};
  options.horizon = 1.0;
  EXPECT_THROW(run_rendezvous(vehicle, options), Error);
  options = {};
  options.turn_time = 0.0;
  EXPECT_THROW(run_rendezvous(vehicle, options), Error);
  options = {};
  options.time_limit = 0.0;
  EXPECT_THROW(run_rendezvous(vehicle, options), Error);
}

TEST(Rendezvous, DockingRateHasWilsonInterval) {
  // Wilson 1927: 95 of 100 gives 0.888 to 0.978.
  const std::optional<Interval> rate = share_interval(95, 100);
  EXPECT_NEAR(rate->low, 0.8882, 1e-4);
  EXPECT_NEAR(rate->high, 0.9785, 1e-4);
  EXPECT_EQ(share_interval(0, 20)->low, 0.0);
  EXPECT_EQ(share_interval(20, 20)->high, 1.0);
}

}  // namespace
}  // namespace tandem
