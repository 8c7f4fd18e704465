#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/studies/comparison/compare_report.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::ContainsRegex;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(Compare, ParsesLists) {
  const auto names = [](const std::string& text) {
    std::vector<std::string> result;
    for (const NamedSolver& c : parse_solver_list("--solvers", text)) result.push_back(c.name);
    return result;
  };
  EXPECT_THAT(names("ipopt:exact, gauss-newton,ipopt:exact"), ElementsAre("ipopt:exact", "gauss-newton"));
  EXPECT_EQ(names("all").size(), 6 + nlopt_algorithms().size());
  if (!nlopt_algorithms().empty()) {
    EXPECT_EQ(names("nlopt").size(), nlopt_algorithms().size());
  }
  const auto error = [&](const std::string& text) { return error_of([&] { names(text); }); };
  EXPECT_THAT(error("gauss-newtn"), HasSubstr("did you mean gauss-newton?"));
  EXPECT_THAT(error("ipopt:exakt"), HasSubstr("did you mean ipopt:exact?"));
  EXPECT_THAT(error(""), HasSubstr("--solvers: unknown solver ''"));
  EXPECT_THAT(parse_constraints("--constraints", "hard,off"), ElementsAre(Role::hard, Role::off));
  EXPECT_THAT(error_of([] { parse_constraints("--constraints", "soft,hart"); }), HasSubstr("did you mean hard?"));
}

TEST(Compare, AppliesConstraintsByRole) {
  TrackingOptions options;
  options.non_holonomic = Role::soft;
  options.max_yaw_rate = 0.2;
  const TargetConstraints constraints = constraints_of(options);
  EXPECT_EQ(describe(constraints), "non-holonomic and yaw rate within ±0.2 rad/s");
  EXPECT_EQ(with_constraints(options, constraints, Role::hard).non_holonomic, Role::hard);
  EXPECT_EQ(with_constraints(options, constraints, Role::hard).limits, Role::hard);
  EXPECT_EQ(with_constraints(options, constraints, Role::hard).roll_pitch, Role::soft) << "part of every problem";
  const TrackingOptions none = with_constraints(options, constraints, Role::off);
  EXPECT_EQ(none.non_holonomic, Role::off);
  EXPECT_FALSE(none.max_yaw_rate);
}

class CompareScenario : public testing::Test {
 protected:
  CompareScenario() {
    write_small_scenario(folder_);
    folder_.write("usbl.csv", "t,x,y,z\n1,5,0.4,0\n4.5,4,-0.5,0.3\n");  // sideways
    scenario = read_scenario(folder_.path());
    problem.constraints = {true, true, between(0.9, 1.1), 0.01};
  }
  ComparedSolve solve(Role role, const std::string& solver) {
    problem.role = role;
    return run_compared_solve(scenario, problem, parse_solver_list("--solvers", solver).front());
  }

  ScratchFolder folder_;
  Scenario scenario;
  ComparedProblem problem;
};

TEST_F(CompareScenario, ConstraintCheckMatchesProblem) {
  problem.role = Role::soft;
  const TrackingOptions options = with_constraints(problem.tracking, problem.constraints, Role::soft);
  TrackingProblem with = make_tracking_problem(scenario.data, options);
  TrackingProblem without =
      make_tracking_problem(scenario.data, with_constraints(problem.tracking, problem.constraints, Role::off));
  const ConstraintCheck start = check(with, scenario.data.noise, problem.constraints);
  EXPECT_GT(start.cost, 0);
  EXPECT_NEAR(NlpEvaluator(with.problem).cost() - NlpEvaluator(without.problem).cost(), start.cost, 1e-9 * start.cost);
  TrackingProblem hard =
      make_tracking_problem(scenario.data, with_constraints(problem.tracking, problem.constraints, Role::hard));
  NlpEvaluator nlp(hard.problem);
  Eigen::VectorXd c(nlp.num_rows());
  nlp.constraints(c);
  EXPECT_NEAR(nlp.violation(c).size, start.violation, 1e-12);
}

TEST_F(CompareScenario, ConstraintsRaiseCost) {
  const ComparedSolve none = solve(Role::off, "gauss-newton"), soft = solve(Role::soft, "gauss-newton"),
                      hard = solve(Role::hard, "augmented-lagrangian");
  for (const ComparedSolve* s : {&none, &soft, &hard}) {
    EXPECT_TRUE(s->converged()) << s->message;
    EXPECT_EQ(s->keyframes, 7u);
    EXPECT_TRUE(s->position && s->heading);
    ASSERT_FALSE(s->curve.empty());
    EXPECT_EQ(s->curve.back().cost, s->cost);
  }
  EXPECT_EQ(none.constraint_cost, 0);
  EXPECT_GT(soft.constraint_cost, 0);
  EXPECT_GT(none.violation, soft.violation);
  EXPECT_GT(soft.violation, 1e-4);
  EXPECT_LT(hard.violation, 1e-7);
  EXPECT_LT(none.cost, soft.cost - soft.constraint_cost);
  EXPECT_LT(soft.cost, hard.cost);
}

TEST_F(CompareScenario, TransfersResultBetweenProcesses) {
  ComparedSolve here = solve(Role::hard, "augmented-lagrangian");
  here.initial_cost = HUGE_VAL;
  const ComparedSolve there = parse_compared_solve(to_text(here));
  EXPECT_EQ(there.solver, here.solver);
  EXPECT_EQ(there.role, here.role);
  EXPECT_EQ(there.keyframes, here.keyframes);
  EXPECT_EQ(there.status, here.status);
  EXPECT_EQ(there.message, here.message);
  EXPECT_EQ(there.solved, here.solved);
  EXPECT_FALSE(std::isfinite(there.initial_cost)) << "JSON has no infinity";
  EXPECT_EQ(there.cost, here.cost);
  EXPECT_EQ(there.constraint_cost, here.constraint_cost);
  EXPECT_EQ(there.violation, here.violation);
  EXPECT_EQ(there.iterations, here.iterations);
  EXPECT_EQ(there.evaluations, here.evaluations);
  EXPECT_EQ(there.seconds, here.seconds);
  EXPECT_EQ(there.position, here.position);
  EXPECT_EQ(there.heading, here.heading);
  ASSERT_EQ(there.curve.size(), here.curve.size());
  EXPECT_EQ(there.curve.back().cost, here.curve.back().cost);
  EXPECT_EQ(here.peak_memory, 0) << "not measured";
}

TEST_F(CompareScenario, ReportsUnsupportedSolver) {
  const ComparedSolve unsupported = solve(Role::hard, "gauss-newton");
  EXPECT_FALSE(unsupported.solved);
  EXPECT_EQ(unsupported.status, "unsupported");
  Comparison comparison{
      "small", Mode::A, problem.constraints, 60, {unsupported, solve(Role::hard, "augmented-lagrangian")}};
  const std::string text = report(comparison);
  EXPECT_THAT(text, ContainsRegex("gauss-newton +unsupported +takes soft residuals only, and"));
  EXPECT_THAT(text, ContainsRegex("augmented-lagrangian +converged .* best .*\\*"));
  EXPECT_THAT(compare_csv(comparison), HasSubstr("small,7,hard,gauss-newton,unsupported,,,"));
  EXPECT_THAT(compare_json(comparison), HasSubstr("\"unsupported\""));
}

ComparedSolve solved(const std::string& name, double cost, double violation, double seconds) {
  ComparedSolve s;
  s.solver = name;
  s.role = Role::hard;
  s.keyframes = 9;
  s.status = "converged";
  s.solved = true;
  s.cost = cost;
  s.violation = violation;
  s.seconds = seconds;
  return s;
}

TEST(CompareReport, MarksBestFeasibleAndFastestSolve) {
  const std::vector<ComparedSolve> solves = {solved("infeasible", 9, 1e-3, 0.1), solved("slow", 10, 1e-9, 3),
                                             solved("fast", 10.000001, 1e-9, 2), solved("worse", 11, 0, 1)};
  EXPECT_EQ(best_cost(solves), 10);
  const std::string text = report({"x", Mode::A, {true, false, {}, {}}, 60, solves});
  EXPECT_THAT(text, ContainsRegex("infeasible +converged +9\\.0+ +– "));
  EXPECT_THAT(text, ContainsRegex("slow .* best .* 3.000 "));
  EXPECT_THAT(text, ContainsRegex("fast .* 1e-07 .* 2.000\\*"));
  EXPECT_THAT(text, Not(HasSubstr("1.000*")));
}

TEST(CompareReport, StartsWithConclusion) {
  const auto text = [](std::vector<ComparedSolve> solves) {
    return report({"x", Mode::A, {true, false, {}, {}}, 60, std::move(solves)});
  };
  EXPECT_THAT(text({solved("slow", 10, 0, 3), solved("fast", 10, 0, 0.08), solved("worse", 11, 0, 0.01)}),
              StartsWith("fast: fastest of 2 solvers that converged to the least cost, 0.08 s\n"));
  EXPECT_THAT(text({solved("one", 10, 0, 3)}),
              StartsWith("one: the only solver that converged to the least cost, 3 s\n"));
  ComparedSolve stopped = solved("stopped", 9, 0, 1);
  stopped.status = "time-limit";
  EXPECT_THAT(text({stopped}), StartsWith("no solver converged\n"));
  EXPECT_THAT(text({stopped, solved("other", 10, 0, 1)}), StartsWith("no solver converged to the least cost\n"));
}

TEST(CompareReport, EndsWithRecommendation) {
  ComparedSolve soft = solved("steady", 3, 0, 2);
  soft.role = Role::soft;
  Comparison comparison{"x", Mode::A, {}, 60, {solved("steady", 10, 0, 2), solved("quick", 10, 0, 1), soft}};
  EXPECT_THAT(report(comparison),
              EndsWith("Recommended: steady. It converges to the least cost of all 2 problems, in 4 s together.\n"));
  comparison.solves.pop_back();
  EXPECT_THAT(report(comparison), EndsWith("Recommended: quick. It converges to the least cost known, in 1 s.\n"));
  EXPECT_THAT(compare_json(comparison), HasSubstr("\"recommendation\": \"Recommended: quick."));
  for (ComparedSolve& s : comparison.solves) s.status = "time-limit";
  EXPECT_THAT(report(comparison), Not(HasSubstr("Recommended")));
}

TEST(CompareReport, SummaryShowsBestSolves) {
  Comparison comparison{"x", Mode::A, {}, 60, {}};
  for (int i = 30; i-- > 0;) comparison.solves.push_back(solved("solver" + std::to_string(i), 10, 0, 1 + i));
  const std::string summary = report(comparison), full = report(comparison, true);
  EXPECT_THAT(summary, ContainsRegex("seconds .*\nsolver0 .*\nsolver1 .*\nsolver2 "));
  EXPECT_THAT(summary, Not(HasSubstr("\nsolver15 ")));
  EXPECT_THAT(summary, HasSubstr("… and 15 more\n"));
  EXPECT_THAT(summary, HasSubstr("--full"));
  EXPECT_THAT(full, ContainsRegex("seconds .*\nsolver29 .*\nsolver28 "));
  EXPECT_THAT(full, HasSubstr("\nsolver0 "));
}

TEST(CompareReport, GroupsSolvesByProblem) {
  ComparedSolve small = solved("a", 1, 0, 1), soft = solved("a", 1, 0, 1);
  small.keyframes = 4;
  soft.role = Role::soft;
  const Comparison comparison{"x", Mode::A, {}, 60, {solved("a", 1, 0, 1), solved("b", 1, 0, 1), soft, small}};
  EXPECT_EQ(by_problem(comparison).size(), 3u);
  EXPECT_THAT(report(comparison), HasSubstr("first 4 keyframes, hard constraints"));
}

}  // namespace
}  // namespace tandem
