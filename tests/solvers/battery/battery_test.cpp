#include <gtest/gtest.h>

#include "sanitized.hpp"
#include "solvers/battery/first_order_conditions.hpp"
#include "solvers/battery/random_programs.hpp"
#include "solvers/cases.hpp"

/// Tests the claims of all solvers on 700 random programs: a converged solution meets the first-order conditions, and
/// an infeasible one is a stationary point of the violation. The environment variable TANDEM_BATTERY sets the number of
/// programs of each difficulty.
namespace tandem::testing {
namespace {

std::uint64_t programs_of_each_difficulty() {
  const char* text = std::getenv("TANDEM_BATTERY");
  return text ? std::strtoull(text, nullptr, 10) : kSanitized ? 10 : 100;
}

struct Case {
  Difficulty difficulty;
  AnySolver solver;
};
std::ostream& operator<<(std::ostream& out, const Case& c) {
  return out << name_of(c.difficulty) << " by " << c.solver;
}

/// NLopt's augmented Lagrangian takes long with large rows.
bool is_tested(Difficulty difficulty, const AnySolver& solver) {
  return difficulty != Difficulty::large_rows || !solver.name.starts_with("nlopt") || solver.name == "nlopt_slsqp";
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const Difficulty difficulty : kDifficulties)
    for (const AnySolver& solver : hard_solvers())
      if (is_tested(difficulty, solver)) all.push_back({difficulty, solver});
  return all;
}

/// Returns the tolerance on the stationarity of a converged solution. The tolerance of NLopt is relative to the
/// residuals.
double stationarity_tolerance(const AnySolver& solver, double cost) {
  return solver.name.starts_with("nlopt") ? 3e-4 * (1 + std::sqrt(2 * cost)) : 1e-4;
}

/// Returns the tolerance on the violation of a converged solution, in the units of the rows. Rounding of large rows
/// exceeds the constraint tolerance.
double violation_tolerance(Difficulty difficulty) { return difficulty == Difficulty::large_rows ? 1e-4 : 1e-7; }

class Battery : public ::testing::TestWithParam<Case> {};

TEST_P(Battery, ClaimsAreTrue) {
  const auto& [difficulty, solver] = GetParam();
  std::map<Status, int> count;
  std::string others;
  for (std::uint64_t seed = 0; seed < programs_of_each_difficulty(); ++seed) {
    RandomProblem p = random_program(difficulty, seed);
    const Summary s = solver(p.problem, {.max_iterations = solver.name.starts_with("ipopt") ? 300 : 3000});
    ++count[s.status];
    const FirstOrderConditions at(p.problem);
    const auto text = ::testing::Message() << "seed " << seed << ", cost " << s.cost << ", violation " << at.violation
                                           << ", " << s.iterations << " iterations: " << s.message;
    if (s.converged()) {
      EXPECT_LE(at.violation, violation_tolerance(difficulty)) << text;
      EXPECT_LE(at.stationarity, stationarity_tolerance(solver, s.cost)) << text;
    } else if (s.status == Status::infeasible) {
      EXPECT_GT(at.violation, 1e-8) << text;
      EXPECT_LE(at.infeasibility, 1e-2) << text;
    } else {
      others += text.GetString() + "\n";
    }
  }
  const double programs = double(programs_of_each_difficulty());
  for (const auto& [status, times] : count) RecordProperty(std::string(name(status)), times);
  if (solver.name != "augmented_lagrangian" && solver.name != "ipopt_automatic") return;
  const Status right = difficulty == Difficulty::infeasible ? Status::infeasible : Status::converged;
  // Without regular constraints there are no multipliers, which an augmented Lagrangian needs to converge.
  const bool irregular = difficulty == Difficulty::degenerate && solver.name == "augmented_lagrangian";
  EXPECT_GE(count[right], (irregular ? 0.5 : 0.85) * programs) << others;
}

INSTANTIATE_TEST_SUITE_P(Solvers, Battery, ::testing::ValuesIn(cases()), [](const auto& info) {
  std::string name = name_of(info.param.difficulty) + "_" + info.param.solver.name;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

/// Tandem's linear solver converges wherever MUMPS does. Nonconvex programs may end in different minima.
TEST(BatteryOfLinearSolvers, OwnLinearSolverEqualsMumps) {
  if (!ipopt_present()) GTEST_SKIP() << "this build has no Ipopt";
  const AnySolver own = ipopt(Hessian::automatic), mumps = ipopt_mumps();
  int same = 0, own_converged = 0, mumps_converged = 0, both = 0;
  for (const Difficulty difficulty : kDifficulties)
    for (std::uint64_t seed = 0; seed < programs_of_each_difficulty(); seed += 2) {
      RandomProblem p = random_program(difficulty, seed), q = random_program(difficulty, seed);
      const Summary a = own(p.problem), b = mumps(q.problem);
      own_converged += a.converged();
      mumps_converged += b.converged();
      if (!a.converged() || !b.converged()) continue;
      ++both;
      same += std::abs(a.cost - b.cost) <= 1e-6 * (1 + b.cost);
    }
  EXPECT_GE(own_converged, mumps_converged);
  EXPECT_GE(both, 0.95 * mumps_converged);
  EXPECT_GE(same, 0.9 * both);
}

}  // namespace
}  // namespace tandem::testing
