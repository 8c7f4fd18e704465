#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/program.hpp>
#include <tandem/studies/comparison/compare_report.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::ContainsRegex;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(Compare, ReadsLists) {
  const auto names = [](const std::string& text) {
    std::vector<std::string> result;
    for (const Contender& c : parse_contenders("--solvers", text)) result.push_back(c.name);
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
  EXPECT_THAT(error(""), HasSubstr("knows no solver ''"));
  EXPECT_THAT(parse_constraints("--constraints", "hard,none"), ElementsAre(Role::hard, Role::off));
  EXPECT_THAT(error_of([] { parse_constraints("--constraints", "soft,hart"); }), HasSubstr("did you mean hard?"));
}

TEST(Compare, ConstraintsAreHeldInEachWay) {
  TrackingOptions options;
  options.non_holonomic = Role::soft;
  options.max_yaw_rate = 0.2;
  const TargetConstraints constraints = constraints_of(options);
  EXPECT_EQ(describe(constraints), "non-holonomic and yaw rate within ±0.2 rad/s");
  EXPECT_EQ(with_constraints(options, constraints, Role::hard).non_holonomic, Role::hard);
  EXPECT_EQ(with_constraints(options, constraints, Role::hard).limits, Role::hard);
  EXPECT_EQ(with_constraints(options, constraints, Role::hard).roll_pitch, Role::soft) << "part of the problem";
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
    return compare_one(scenario, problem, parse_contenders("--solvers", solver).front());
  }

  ScratchFolder folder_;
  Scenario scenario;
  ComparedProblem problem;
};

TEST_F(CompareScenario, MeasuresConstraintsAsTheProblemDoes) {
  problem.role = Role::soft;
  const TrackingOptions options = with_constraints(problem.tracking, problem.constraints, Role::soft);
  TrackingProblem with = make_tracking_problem(scenario.data, options);
  TrackingProblem without =
      make_tracking_problem(scenario.data, with_constraints(problem.tracking, problem.constraints, Role::off));
  const ConstraintCheck start = check(with, scenario.data.noise, problem.constraints);
  EXPECT_GT(start.cost, 0);
  EXPECT_NEAR(Program(with.problem).cost() - Program(without.problem).cost(), start.cost, 1e-9 * start.cost);
  TrackingProblem hard =
      make_tracking_problem(scenario.data, with_constraints(problem.tracking, problem.constraints, Role::hard));
  Program program(hard.problem);
  Eigen::VectorXd c(program.num_rows());
  program.constraints(c);
  EXPECT_NEAR(program.violation(c).size, start.violation, 1e-12);
}

TEST_F(CompareScenario, HoldingConstraintsCostsMeasurements) {
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

TEST_F(CompareScenario, OneProcessTellsAnotherAllOfIt) {
  ComparedSolve here = solve(Role::hard, "augmented-lagrangian");
  here.initial_cost = HUGE_VAL;
  const ComparedSolve there = compared_solve(to_text(here));
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
  EXPECT_EQ(here.peak_memory, 0) << "nobody measured it";
}

TEST_F(CompareScenario, ASolverThatCannotSaysWhy) {
  const ComparedSolve refused = solve(Role::hard, "gauss-newton");
  EXPECT_FALSE(refused.solved);
  EXPECT_EQ(refused.status, "unsupported");
  Comparison comparison{
      "small", Mode::A, problem.constraints, 60, {refused, solve(Role::hard, "augmented-lagrangian")}};
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

TEST(CompareReport, TheBestHoldsItsConstraintsAndTheFastestIsMarked) {
  const std::vector<ComparedSolve> solves = {solved("cheat", 9, 1e-3, 0.1), solved("slow", 10, 1e-9, 3),
                                             solved("fast", 10.000001, 1e-9, 2), solved("worse", 11, 0, 1)};
  EXPECT_EQ(best_cost(solves), 10);
  const std::string text = report({"x", Mode::A, {true, false, {}, {}}, 60, solves});
  EXPECT_THAT(text, ContainsRegex("cheat +converged +9\\.0+ +– "));
  EXPECT_THAT(text, ContainsRegex("slow .* best .* 3.000 "));
  EXPECT_THAT(text, ContainsRegex("fast .* 1e-07 .* 2.000\\*"));
  EXPECT_THAT(text, Not(HasSubstr("1.000*")));
}

TEST(CompareReport, AProblemStandsByItself) {
  ComparedSolve small = solved("a", 1, 0, 1), soft = solved("a", 1, 0, 1);
  small.keyframes = 4;
  soft.role = Role::soft;
  const Comparison comparison{"x", Mode::A, {}, 60, {solved("a", 1, 0, 1), solved("b", 1, 0, 1), soft, small}};
  EXPECT_EQ(by_problem(comparison).size(), 3u);
  EXPECT_THAT(report(comparison), HasSubstr("first 4 keyframes, hard constraints"));
}

}  // namespace
}  // namespace tandem
