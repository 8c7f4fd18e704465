#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/nlopt.hpp>

#include "needs_program.hpp"
#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsSupersetOf;
using testing::Not;

/// Returns the words of a plan from about 5 m behind the target, with a keep-out distance of 4 m.
std::vector<std::string> plan(std::vector<std::string> more) {
  std::vector<std::string> words{"plan",      "docking_a",  "--at", "60",      "--goal",
                                 "-6,0,-3.4", "--keep-out", "4",    "--depth", "1,20"};
  if (!ipopt_available()) words.insert(words.end(), {"--solver", "augmented-lagrangian"});
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

TEST(PlanCommand, PlansAndWritesFiles) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  const Outcome run = run_tandem(plan({"--horizon", "20", "--out", out, "--plots", "off"}));
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_THAT(run.output, HasSubstr("docking_a: REMUS 100 from 60.000 s, 20 steps of 1 s"));
  EXPECT_THAT(files(out), IsSupersetOf({"planned_chaser.csv", "predicted_target.csv", "commands.csv",
                                        "active_constraints.csv", "summary.json", "run.yaml"}));
  const auto summary = nlohmann::json::parse(read_file(out / "summary.json"));
  EXPECT_EQ(summary["accepted"], true);
  EXPECT_LE(summary["max_violation"].get<double>(), 1e-6);
  EXPECT_GE(summary["min_distance_m"].get<double>(), 4.0 - 1e-6);
  for (const char* miss : {"position_m", "orientation_deg", "speed_m_s"})
    EXPECT_GE(summary["end"][miss].get<double>(), 0.0) << miss;
  for (const char* difference : {"position_m", "heading_deg"})
    EXPECT_GT(summary["discretisation_error"][difference].get<double>(), 0.0) << difference;
  EXPECT_GT(summary["target_three_sigma_m"]["end"], summary["target_three_sigma_m"]["start"]);
  const std::string commands = read_file(out / "commands.csv");
  EXPECT_THAT(commands, HasSubstr("t,propeller_command,propeller,stern_command,stern,rudder_command,rudder\n"));
  EXPECT_EQ(std::count(commands.begin(), commands.end(), '\n'), 22);
}

TEST(PlanCommand, DrawsPlan) {
  TANDEM_NEEDS_GNUPLOT("plan's plots");
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  const Outcome run = run_tandem(plan({"--horizon", "20", "--out", out, "--quiet"}));
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(run.errors, "");
  EXPECT_THAT(files(out), IsSupersetOf({"plan.svg", "plan_commands.svg"}));
}

TEST(PlanCommand, SupportsOtherVehicle) {
  const Outcome run = run_tandem(plan({"--vehicle", "bluerov2_heavy", "--horizon", "8", "--json"}));
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(nlohmann::json::parse(run.output)["vehicle"], "BlueROV2 Heavy");
}

TEST(PlanCommand, CoupledPlanIsCloseToDecoupledPlan) {
  // Optical poses determine the motion of the target here, so that coupling changes little.
  const auto end = [](std::vector<std::string> more) {
    std::vector<std::string> words{"plan",      "docking_a", "--at", "400",   "--goal",
                                   "-6,0,-3.4", "--horizon", "8",    "--json"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome run = run_tandem(words);
    EXPECT_EQ(run.status, 0) << run.errors;
    return nlohmann::json::parse(run.output);
  };
  const auto decoupled = end({}), coupled = end({"--coupled"});
  EXPECT_EQ(decoupled["coupled"], false);
  EXPECT_EQ(coupled["coupled"], true);
  EXPECT_LE(coupled["max_violation"].get<double>(), 1e-6);
  EXPECT_NEAR(coupled["end"]["position_m"].get<double>(), decoupled["end"]["position_m"].get<double>(), 0.2);
}

TEST(PlanCommand, RejectsInvalidUsage) {
  const auto wrong = [](std::vector<std::string> words) { return rejection(plan(std::move(words))); };
  EXPECT_THAT(rejection({"plan", "docking_a"}), HasSubstr("--at"));
  EXPECT_THAT(rejection({"plan", "docking_a", "--at", "0"}), HasSubstr("--at 0 s is before"));
  EXPECT_THAT(rejection({"plan", "docking_a", "--at", "60", "--goal", "-3,0,0", "--keep-out", "4"}),
              HasSubstr("the wanted relative pose is 3.00 m from the target, inside the keep-out distance of 4.00 m"));
  EXPECT_THAT(rejection({"plan", "docking_a", "--at", "60", "--goal", "0,0,-4", "--view", "30"}),
              HasSubstr("outside the field of view"));
  EXPECT_THAT(rejection({"plan", "docking_a", "--at", "60", "--goal", "1,2"}), HasSubstr("--goal takes three numbers"));
  EXPECT_THAT(wrong({"--vehicle", "remus"}), HasSubstr("there is no vehicle 'remus'"));
  EXPECT_THAT(wrong({"--horizon", "1e9"}), HasSubstr("--horizon 1e+09 s in steps of 1 s"));
  EXPECT_THAT(wrong({"--view", "95"}), HasSubstr("--view must be below 90 degrees"));
  EXPECT_THAT(wrong({"--mode", "B"}), HasSubstr("mode A"));
  EXPECT_THAT(rejection({"plan", "docking_a", "--at", "60", "--solver", "ipop"}), HasSubstr("did you mean ipopt?"));
}

TEST(PlanCommand, ChanceConstraintIncreasesDistance) {
  const auto least_distance = [](const std::string& sigmas) {
    std::vector<std::string> words{"plan", "docking_a", "--at", "400",      "--goal", "-6,0,-3.4", "--keep-out",
                                   "3",    "--horizon", "8",    "--chance", sigmas,   "--json"};
    if (!ipopt_available()) words.insert(words.end(), {"--solver", "augmented-lagrangian"});
    const Outcome run = run_tandem(words);
    EXPECT_EQ(run.status, 0) << run.errors;
    return nlohmann::json::parse(run.output)["min_distance_m"].get<double>();
  };
  const double on_the_mean = least_distance("0");
  EXPECT_GE(on_the_mean, 3.0 - 1e-6);
  EXPECT_LT(on_the_mean, 4.0);
  EXPECT_GT(least_distance("2"), 5.0);
  EXPECT_THAT(rejection(plan({"--chance", "-1"})), HasSubstr("--chance"));
}

TEST(PlanCommand, InformationTermReducesFinalCovariance) {
  // The camera has a range of 3 m and also looks aft.
  const auto end = [](const std::string& weight) {
    std::vector<std::string> words{"plan", "docking_a", "--at",  "400",           "--goal", "-6,0,-3.4", "--horizon",
                                   "8",    "--sight",   "3,179", "--information", weight,   "--json"};
    if (!ipopt_available()) words.insert(words.end(), {"--solver", "augmented-lagrangian"});
    const Outcome run = run_tandem(words);
    EXPECT_EQ(run.status, 0) << run.errors;
    return nlohmann::json::parse(run.output)["target_three_sigma_m"];
  };
  const auto without = end("0"), with = end("10");
  EXPECT_EQ(with["end"], without["end"]);
  EXPECT_LT(with["end_with_fixes"], without["end_with_fixes"]);
  EXPECT_LE(without["end_with_fixes"], without["end"]);
  EXPECT_THAT(rejection(plan({"--sight", "9"})), HasSubstr("--sight takes a range and a half angle"));
}

TEST(PlanCommand, NamesBoundViolatedAtStart) {
  // The vehicle is 3 m deep; the bound requires 15 m one second later.
  const Outcome run = run_tandem(
      {"plan", "docking_a", "--at", "60", "--goal", "-6,0,-16", "--depth", "15,20", "--horizon", "10", "--quiet"});
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.errors, HasSubstr("no plan meets the hard constraints: --depth 15,20 (now 3.38 m)"));
}

/// The message names the violated limits with the present state, and no other limit.
TEST(LongPlanCommand, NamesConflictingLimits) {
  const auto errors = [](std::vector<std::string> more) {
    std::vector<std::string> words{"plan", "docking_a", "--at", "400", "--goal", "-6,0,-3.4", "--horizon", "4"};
    words.insert(words.end(), more.begin(), more.end());
    if (!ipopt_available()) words.insert(words.end(), {"--solver", "augmented-lagrangian"});
    const Outcome run = run_tandem(words);
    EXPECT_EQ(run.status, 2) << run.errors;
    return run.errors;
  };
  EXPECT_THAT(errors({"--depth", "0,1", "--keep-out", "2"}),
              AllOf(HasSubstr("--depth 0,1 (now 3.10 m) cannot be met from the current state; relax it"),
                    Not(HasSubstr("--keep-out"))));
  EXPECT_THAT(errors({"--most-roll-pitch", "0.5"}), HasSubstr("--most-roll-pitch 0.5 (now 1.9° and 2.1°)"));
  EXPECT_THAT(errors({"--view", "60"}), HasSubstr("--view 60° (now 144°) cannot be met"));
  EXPECT_THAT(errors({"--approach", "20"}), HasSubstr("--approach 20° (now 117°) cannot be met"));
}

TEST(PlanCommand, NloptFindsSamePlanOnShortHorizon) {
  if (nlopt_algorithms().empty()) GTEST_SKIP() << "this build has no NLopt";
  const auto planned = [](const std::string& solver) {
    const Outcome run = run_tandem({"plan", "docking_a", "--at", "400", "--goal", "-6,0,-3.4", "--horizon", "6",
                                    "--keep-out", "3", "--solver", solver, "--json"});
    EXPECT_EQ(run.status, 0) << run.errors;
    return nlohmann::json::parse(run.output);
  };
  const auto slsqp = planned("nlopt:slsqp"), other = planned("augmented-lagrangian");
  EXPECT_EQ(slsqp["solver"], "nlopt:slsqp");
  EXPECT_NEAR(slsqp["cost"].get<double>(), other["cost"].get<double>(), 1e-4 * (1 + other["cost"].get<double>()));
  EXPECT_LE(slsqp["max_violation"].get<double>(), 1e-6);
  EXPECT_THAT(rejection({"plan", "docking_a", "--at", "400", "--goal", "-6,0,-3.4", "--solver", "nlopt:slsqp"}),
              HasSubstr("a plan of 50 steps has 900 unknowns"));
  const Outcome coupled = run_tandem({"plan", "docking_a", "--at", "400", "--goal", "-6,0,-3.4", "--horizon", "6",
                                      "--coupled", "--solver", "nlopt:slsqp"});
  EXPECT_EQ(coupled.status, 2);
  EXPECT_THAT(coupled.errors, HasSubstr("no plan was computed: nlopt:slsqp works on dense matrices"));
}

}  // namespace
}  // namespace tandem
