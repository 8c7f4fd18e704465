#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/problem/file/problem_file.hpp>
#include <tandem/problem/navigation/navigation_checks.hpp>
#include <tandem/studies/navigation/navigate.hpp>
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/simulation/simulate_dive_files.hpp>
#include <tandem/studies/support/solver_choice.hpp>

#include "run_tandem.hpp"

/// `--write-problem` and `tandem solve` with the real executable; files and copies of tracking and navigation problems.
namespace tandem {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Json = nlohmann::json;

/// Returns the summary of a run with --json that must converge.
Json json_of(std::vector<std::string> arguments) {
  arguments.push_back("--json");
  const Outcome outcome = run_tandem(arguments);
  EXPECT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_EQ(outcome.errors, "");
  return Json::parse(outcome.output, nullptr, false);
}

void expect_same_solve(const Json& a, const Json& b) {
  for (const char* key : {"solver", "status", "initial_cost", "cost", "iterations", "evaluations"})
    EXPECT_EQ(a[key], b[key]) << key;
}

/// Expects that a problem, a copy of it, and the problem read from its file have identical solves.
template <class Options>
void expect_exact(Problem& problem, const Options& options) {
  const std::string text = problem_text(problem);
  Problem read = parse_problem(text, "it"), copy = problem.copy();
  EXPECT_EQ(problem_text(read), text);
  EXPECT_EQ(problem_text(copy), text);
  const Summary summary = solve(problem, options);
  const std::string solved = problem_text(problem);
  EXPECT_NE(solved, text);
  for (Problem* other : {&read, &copy}) {
    const Summary of_other = solve(*other, options);
    EXPECT_EQ(of_other.iterations, summary.iterations);
    EXPECT_EQ(of_other.initial_cost, summary.initial_cost);
    EXPECT_EQ(of_other.cost, summary.cost);
    EXPECT_EQ(problem_text(*other), solved);
  }
}

TEST(ProblemFile, TrackingProblemIsExact) {
  Scenario scenario = read_scenario(std::filesystem::path(paths::source) / "share/scenarios/docking_a");
  for (TargetSensor& sensor : scenario.data.sensors) {
    sensor.delay = 0.25;
    sensor.error = SystematicError{.bias_sigma = Eigen::VectorXd::Constant(sensor.sigma.size(), 0.05),
                                   .scale_sigma = 0.01,
                                   .misalignment_sigma = 0.01,
                                   .delay_sigma = 0.1};
  }
  for (const Mode mode : {Mode::A, Mode::B})
    for (const Role limits : {Role::soft, Role::hard}) {
      TrackingOptions options;
      options.mode = mode;
      options.loss = Cauchy(2.0);
      options.non_holonomic = Role::hard;
      options.surge = Bounds<1>{Vector<1>(0.0), Vector<1>(2.5)};
      options.max_yaw_rate = 0.3;
      options.limits = limits;
      options.max_keyframes = 250;
      TrackingProblem tracking = make_tracking_problem(scenario.data, options);
      ASSERT_GT(tracking.problem.num_hard_blocks(), 0);
      ASSERT_EQ(problem_text(tracking.problem).find("Boundary<") != std::string::npos, mode == Mode::B);
      ASSERT_FALSE(tracking.constants.empty());
      AugmentedLagrangianOptions solver;
      solver.max_iterations = 25;
      expect_exact(tracking.problem, solver);
    }
}

TEST(ProblemFile, NavigationProblemIsExact) {
  const ScratchFolder scratch;
  DiveOptions options;
  options.grade = Grade::tactical;
  options.minutes = 1;
  write_dive(simulate_dive(options), options, scratch.path());
  int built = 0;
  NavigationOptions navigation;
  navigation.covariance = false;
  navigation.built = [&](const Problem& problem) {
    ++built;
    Problem copy = problem.copy();
    expect_exact(copy, GaussNewtonOptions{});
  };
  const Navigation navigated = navigate(*read_scenario(scratch.path()).navigation, navigation);
  EXPECT_EQ(built, navigated.solves);

  // The commands navigate and solve give the same result.
  const std::string file = scratch.path() / "problem.json";
  const Json of_navigate = json_of({"navigate", scratch.path(), "--no-covariance", "--write-problem", file});
  const Json solved = json_of({"solve", file});
  EXPECT_EQ(of_navigate["cost"], solved["cost"]);
  EXPECT_EQ(of_navigate["iterations"], solved["iterations"]);
}

class Solve : public testing::Test {
 protected:
  Solve() { write_small_scenario(scratch_); }

  std::string file(const std::string& name = "problem.json") const { return scratch_.path() / name; }
  Json write(std::vector<std::string> options = {}) const {
    options.insert(options.begin(), {"estimate", scratch_.path(), "--write-problem", file(), "--no-covariance"});
    return json_of(options);
  }
  /// Returns the error message for a file with this text.
  std::string rejection_of(const std::string& text) const {
    scratch_.write("wrong.json", text);
    return rejection({"solve", file("wrong.json")});
  }

  ScratchFolder scratch_;
};

TEST_F(Solve, HelpListsOptions) {
  const Outcome help = run_tandem({"solve", "--help-all"});
  EXPECT_EQ(help.status, 0);
  for (const char* option : {"FILE", "--solver", "--ipopt", "--max-iterations", "--time-limit", "--threads",
                             "--from-multipliers", "--write-solution", "--json", "--quiet", "Exit status"})
    EXPECT_THAT(help.output, HasSubstr(option));
  for (const char* command : {"estimate", "navigate"})
    EXPECT_THAT(run_tandem({command, "--help-all"}).output, HasSubstr("--write-problem"));
}

TEST_F(Solve, RepeatsSolveOfEstimate) {
  const Json estimated = write({"--loss", "huber:1"});
  const Json solved = json_of({"solve", file()});
  expect_same_solve(estimated, solved);
  EXPECT_EQ(solved["costs"], estimated["residual_blocks"]);
  EXPECT_EQ(solved["solver"], "gauss-newton");
}

TEST_F(Solve, RepeatsSolveOfDockingA) {
  const Json estimated =
      json_of({"estimate", "docking_a", "--mode", "B", "--robust", "--non-holonomic", "hard", "--surge", "0,2.5",
               "--max-keyframes", "300", "--no-covariance", "--max-iterations", "200", "--write-problem", file()});
  const Json solved = json_of({"solve", file(), "--max-iterations", "200"});
  EXPECT_EQ(solved["solver"], "augmented-lagrangian");
  expect_same_solve(estimated, solved);
  EXPECT_GT(solved["equalities"], 0);
  EXPECT_GT(solved["inequalities"], 0);
}

TEST_F(Solve, PrintsSummary) {
  write({"--non-holonomic", "hard", "--surge", "0,2.5"});
  const Outcome outcome = run_tandem({"solve", file()});
  EXPECT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(
      outcome.output,
      ContainsRegex("problem.json: [0-9]+ variables \\(0 fixed\\), [0-9]+ unknowns, [0-9]+ costs, [0-9]+ constraints "
                    "\\([0-9]+ equalities, [0-9]+ inequalities\\)\n"));
  EXPECT_THAT(outcome.output,
              ContainsRegex("augmented-lagrangian: converged, cost [-0-9.e]+ \\(from [-0-9.e+]+\\), [0-9]+ iterations, "
                            "[0-9]+ evaluations, [0-9.]+ s\n"));
  EXPECT_THAT(outcome.output, ContainsRegex("largest violation of a hard constraint: [0-9.e-]+"));
  const Outcome quiet = run_tandem({"solve", file(), "--quiet"});
  EXPECT_EQ(quiet.status, 0);
  EXPECT_THAT(quiet.output, IsEmpty());
}

TEST_F(Solve, WritesSolution) {
  write();
  const std::string before = read_file(file());
  const Outcome outcome = run_tandem({"solve", file(), "--write-solution", file("solved.json")});
  EXPECT_THAT(outcome.output, HasSubstr("Written to "));
  EXPECT_EQ(read_file(file()), before);
  const Json again = json_of({"solve", file("solved.json")});
  EXPECT_LE(again["iterations"], 1);
  EXPECT_EQ(again["initial_cost"], json_of({"solve", file()})["cost"]);
}

TEST_F(Solve, RejectsUnsupportedSolver) {
  write({"--non-holonomic", "hard"});
  EXPECT_THAT(rejection({"solve", file(), "--solver", "gauss-newton"}), HasSubstr("problem.json: "));
}

TEST_F(Solve, UnconvergedSolveHasStatus2) {
  write();
  Json json = Json::parse(read_file(file()));
  for (Json& variable : json["variables"])
    if (variable["value"].size() == 7) variable["value"][4] = 30.0;
  scratch_.write("far.json", json.dump());
  const Outcome outcome = run_tandem({"solve", file("far.json"), "--max-iterations", "1"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.errors, HasSubstr("gauss-newton did not converge (max-iterations)"));
}

TEST_F(Solve, ReportsUnwritableFileBeforeSolve) {
  EXPECT_THAT(rejection({"estimate", scratch_.path(), "--write-problem", file("no/folder.json")}),
              HasSubstr("cannot write the problem to "));
}

TEST_F(Solve, RejectsInvalidFiles) {
  write();
  const std::string text = read_file(file());
  const Json right = Json::parse(text);
  const auto with = [&](auto change) {
    Json json = right;
    change(json);
    return json.dump();
  };
  EXPECT_THAT(rejection({"solve", file("none.json")}), HasSubstr("none.json is missing"));
  EXPECT_THAT(rejection({"solve", scratch_.path()}), HasSubstr("is a folder"));
  EXPECT_THAT(rejection({"solve", "/dev/zero"}), HasSubstr("a pipe or a device"));
  EXPECT_THAT(rejection_of(""), HasSubstr("invalid JSON at byte 1"));
  EXPECT_THAT(rejection_of(text.substr(0, text.size() / 2)), HasSubstr("invalid JSON at byte"));
  EXPECT_THAT(rejection_of("{}"), HasSubstr("not a problem file"));
  EXPECT_THAT(rejection_of(with([](Json& j) { j["version"] = 99; })), HasSubstr("format version 99 is not supported"));
  EXPECT_THAT(rejection_of(with([](Json& j) { j["blocks"][0]["residual"] = "mine::Range"; })),
              HasSubstr("block 0: the residual mine::Range as a cost is not compiled"));
  EXPECT_THAT(rejection_of(with([](Json& j) { j["blocks"][0]["data"].push_back(0); })),
              HasSubstr("block 0: data must be 7 numbers, not 8"));
  EXPECT_THAT(rejection_of(with([](Json& j) { j["blocks"][0]["variables"][0] = 9999; })),
              HasSubstr("block 0: variable 9999 does not exist"));
  EXPECT_THAT(rejection_of(with([](Json& j) { j["variables"][0]["value"][4] = nullptr; })),
              HasSubstr("variable 0: value accepts only finite numbers, not null"));
  EXPECT_THAT(rejection_of(with([](Json& j) { j["blocks"][0]["noise"]["diagonal"].erase(0); })),
              HasSubstr("block 0: the noise has 5 numbers"));
  EXPECT_THAT(rejection_of(with([](Json& j) {
                j["blocks"] = Json::array();
                j["variables"] = Json::array();
              })),
              HasSubstr("no free variable"));
}

}  // namespace
}  // namespace tandem
