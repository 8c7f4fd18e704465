#include <algorithm>
#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <pty.h>

#include <tandem/studies/comparison/compare.hpp>

#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using Json = nlohmann::json;

TEST(CompareCommand, ComparesSolversAndWritesFiles) {
  const ScratchFolder scratch;
  const std::string out = (scratch.path() / "out").string();
  const std::string dense = nlopt_algorithms().empty() ? "" : ",nlopt:slsqp,nlopt:lbfgs";
  const Outcome run = run_tandem({"compare", "docking_a", "--max-keyframes", "60", "--solvers",
                                  "gauss-newton,augmented-lagrangian" + dense, "--dense-keyframes", "24", "--plots",
                                  "off", "--out", out});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(run.errors, "");
  EXPECT_THAT(run.output, HasSubstr("Constraints: non-holonomic and surge ≥ 0 m/s."));
  EXPECT_THAT(run.output, HasSubstr("\n60 keyframes, no constraints"));
  EXPECT_THAT(run.output, HasSubstr("first 24 keyframes, hard constraints"));
  EXPECT_THAT(run.output, ContainsRegex("augmented-lagrangian +converged +13\\.7"));
  const std::string csv = read_file(out + "/compare.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 6 * (dense.empty() ? 2 : 4));
  EXPECT_THAT(csv, HasSubstr("docking_a,60,hard,gauss-newton,unsupported,"));
  if (!dense.empty()) {
    EXPECT_THAT(csv, HasSubstr("docking_a,60,off,nlopt:slsqp,unsupported,"));
    EXPECT_THAT(csv, HasSubstr("docking_a,24,hard,nlopt:slsqp,converged,"));
  }
  EXPECT_THAT(read_file(out + "/compare_progress.csv"), HasSubstr("60,hard,augmented-lagrangian,"));
}

TEST(CompareCommand, SolversAgree) {
  if (!ipopt_available()) GTEST_SKIP() << "only one solver for hard constraints";
  const Outcome run = run_tandem({"compare", "docking_a", "--max-keyframes", "60", "--solvers",
                                  "augmented-lagrangian,ipopt,ipopt:exact", "--constraints", "hard", "--json"});
  ASSERT_EQ(run.status, 0) << run.errors;
  const Json solves = Json::parse(run.output)["solves"];
  ASSERT_EQ(solves.size(), 3u);
  for (const Json& s : solves) {
    EXPECT_EQ(s["status"], "converged");
    EXPECT_NEAR(s["cost"], double(solves[0]["cost"]), 1e-6 * double(solves[0]["cost"]));
    EXPECT_LT(s["violation"], 1e-6);
    EXPECT_GT(s["peak_memory_bytes"], 1e6);
  }
}

/// A solve in a subprocess gives the same result as in this process.
TEST(CompareCommand, SubprocessGivesSameResult) {
  const Outcome run = run_tandem({"compare", "docking_a", "--max-keyframes", "60", "--solvers", "augmented-lagrangian",
                                  "--constraints", "hard", "--noise", "usbl=3,3,3", "--json"});
  ASSERT_EQ(run.status, 0) << run.errors;
  const Json there = Json::parse(run.output)["solves"][0];
  Scenario scenario = read_scenario(std::filesystem::path(paths::source) / "share/scenarios/docking_a");
  for (TargetSensor& sensor : scenario.data.sensors)
    if (sensor.name == "usbl") sensor.sigma = Vector<3>(3, 3, 3);
  ComparedProblem problem;
  problem.role = Role::hard;
  problem.tracking.max_keyframes = 60;
  problem.constraints.non_holonomic = true;
  problem.constraints.surge = at_least(0);
  const ComparedSolve here =
      run_compared_solve(scenario, problem, parse_solver_list("--solvers", "augmented-lagrangian").front());
  EXPECT_EQ(there["status"], here.status);
  EXPECT_EQ(there["cost"], here.cost);
  EXPECT_EQ(there["violation"], here.violation);
  EXPECT_EQ(there["iterations"], here.iterations);
}

TEST(CompareCommand, InterruptKeepsResultsSoFar) {
  if (nlopt_algorithms().empty()) GTEST_SKIP() << "no solver is slow enough";
  const ScratchFolder scratch;
  int terminal = -1, error_fd = -1;
  ASSERT_EQ(openpty(&terminal, &error_fd, nullptr, nullptr, nullptr), 0);
  const pid_t child = start_tandem({"compare", "docking_a", "--solvers", "gauss-newton,nlopt:ccsaq,nlopt:mma",
                                    "--constraints", "soft", "--json", "--time-limit", "60"},
                                   scratch.path() / "output", error_fd);
  close(error_fd);
  std::string errors;
  char buffer[4096];
  bool signalled = false;  // once the progress of the second solve is shown
  for (ssize_t n; (n = read(terminal, buffer, sizeof buffer)) > 0;) {
    errors.append(buffer, static_cast<std::size_t>(n));
    if (!signalled && errors.find("nlopt:ccsaq: iteration ") != std::string::npos) signalled = kill(child, SIGINT) == 0;
  }
  close(terminal);
  EXPECT_EQ(exit_status(child), 2) << errors;
  EXPECT_TRUE(signalled);
  EXPECT_THAT(errors, HasSubstr("interrupted after 2 of 3 solves"));
  const Json solves = Json::parse(read_file(scratch.path() / "output"))["solves"];
  ASSERT_EQ(solves.size(), 2u);
  EXPECT_EQ(solves[0]["status"], "converged");
  EXPECT_EQ(solves[1]["status"], "interrupted");
  EXPECT_GT(solves[1]["iterations"], 0) << "its best point is kept";
}

TEST(CompareCommand, NonFiniteProblemHasReasonAndNoNumbers) {
  const ScratchFolder scratch;
  write_small_scenario(scratch);
  scratch.write("usbl.csv", "t,x,y,z\n1,5,1,0\n2,5,-1,0\n4.5,5,0,1\n");
  const std::string out = (scratch.path() / "out").string();
  const Outcome run = run_tandem(
      {"compare", scratch.path().string(), "--solvers", "gauss-newton,augmented-lagrangian", "--constraints", "off",
       "--noise", "constant_twist=1e-200,1e-200,1e-200,1e-200,1e-200,1e-200", "--plots", "off", "--out", out});
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.errors, HasSubstr("2 of 2 solves did not converge: gauss-newton, augmented-lagrangian"));
  EXPECT_THAT(run.output, ContainsRegex("gauss-newton +failed +not finite at the initial guess"));
  EXPECT_THAT(run.output + read_file(out + "/compare.csv") + read_file(out + "/compare_progress.csv"),
              testing::Not(HasSubstr("nan")));
}

TEST(CompareCommand, RejectsInvalidUsage) {
  EXPECT_THAT(rejection_as_given({"compare", "docking_a", "--solvers", "gauss-newtn"}),
              HasSubstr("did you mean gauss-newton?"));
  EXPECT_THAT(rejection_as_given({"compare", "docking_a", "--constraints", "maybe"}), HasSubstr("off, soft and hard"));
  EXPECT_THAT(rejection_as_given({"compare", "docking_a", "--dense-keyframes", "0"}), HasSubstr("--dense-keyframes"));
  EXPECT_THAT(rejection_as_given({"compare", "docking_a", "--limits", "soft", "--surge", "0,1"}),
              HasSubstr("unknown option '--limits'"));
  EXPECT_THAT(rejection_as_given({"compare", "docking_a", "--hold-out", "2"}),
              HasSubstr("unknown option '--hold-out'"));
  EXPECT_THAT(rejection_as_given({"compare", "docking_a", "--dvl-scale"}),
              HasSubstr("--dvl-scale needs a chaser that moves by its own sensors"));
  EXPECT_THAT(rejection_as_given({"compare", "docking_a", "--model", "constant-velocity"}),
              HasSubstr("with soft constraints: the constant-velocity model"));
  EXPECT_THAT(rejection_as_given({"compare", "dokcing_a"}), HasSubstr("docking_a"));
}

TEST(CompareCommand, HelpOmitsUnsupportedOptions) {
  for (const char* command : {"compare", "models"}) {
    const Outcome help = run_tandem({command, "--help-all"});
    EXPECT_EQ(help.status, 0);
    for (const char* not_there : {"--limits", "--hold-out", "--one", "--line"})
      EXPECT_THAT(help.output, testing::Not(HasSubstr(not_there))) << command;
    for (const char* heading : {"Target:", "Sensors:", "Chaser's own sensors:", "Output:"})
      EXPECT_THAT(help.output, HasSubstr(heading)) << command;
  }
}

TEST(ModelsCommand, ComparesModelsAndWritesFiles) {
  const ScratchFolder scratch;
  const Outcome run = run_tandem({"models", "docking_a", "--max-keyframes", "250", "--models",
                                  "constant-twist,mode-b,non-holonomic:hard+surge:0,2.5,steady-course+surge:hard",
                                  "--out", scratch.path().string()});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(run.errors, "");
  EXPECT_THAT(run.output, ContainsRegex("non-holonomic:hard.surge:0,2.5 +converged"));
  EXPECT_THAT(run.output, ContainsRegex("steady-course.surge:hard +refused +the steady-course model"));
  EXPECT_THAT(run.output, HasSubstr("Least position error over all keyframes: "));
  EXPECT_THAT(read_file(scratch.path() / "models.csv"), HasSubstr("docking_a,mode-b,gauss-newton,converged,"));
}

TEST(LongModelsCommand, JsonContainsEveryModel) {
  const Outcome run = run_tandem({"models", "docking_a", "--max-keyframes", "60", "--json"});
  ASSERT_EQ(run.status, 0) << run.errors;
  const Json models = Json::parse(run.output)["models"];
  EXPECT_EQ(models.size(), 17u);
  for (const Json& model : models) EXPECT_EQ(model["status"], "converged") << model["model"];
}

TEST(ModelsCommand, RejectsInvalidUsage) {
  EXPECT_THAT(rejection_as_given({"models", "docking_a", "--models", "constant-twits"}),
              HasSubstr("did you mean constant-twist?"));
  EXPECT_THAT(rejection_as_given({"models", "docking_a", "--models", "surge:2,1"}), HasSubstr("lower limit"));
  EXPECT_THAT(rejection_as_given({"models", "docking_a", "--solver", "ipop"}), HasSubstr("did you mean ipopt?"));
  EXPECT_THAT(rejection_as_given({"models", "docking_a", "--max-keyframes", "0"}), HasSubstr("--max-keyframes"));
  EXPECT_THAT(rejection_as_given({"models", "docking_a", "--limits", "soft"}), HasSubstr("unknown option '--limits'"));
}

}  // namespace
}  // namespace tandem
