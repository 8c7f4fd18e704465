#include <cstdlib>

#include <gtest/gtest.h>

#include "battery/first_order_conditions.hpp"
#include "cases.hpp"
#include "random_problems.hpp"
#include "sanitized.hpp"

/// Tests that augmented-lagrangian only converges where the first-order conditions hold, and that Ipopt finds no better
/// point nearby. The environment variable TANDEM_FUZZ_PROGRAMS sets the number of random problems; 10,000 take about a
/// minute.
namespace tandem::testing {
namespace {

std::uint64_t num_problems() {
  const char* text = std::getenv("TANDEM_FUZZ_PROGRAMS");
  return text ? std::strtoull(text, nullptr, 10) : kSanitized ? 100 : 400;
}

TEST(Optimality, ConvergedSolutionsMeetTheFirstOrderConditions) {
  std::uint64_t converged = 0;
  for (std::uint64_t seed = 0; seed < num_problems(); ++seed) {
    RandomProblem p = random_problem(seed);
    const Summary s = solve(p.problem, AugmentedLagrangianOptions{});
    EXPECT_EQ(describe(s.unobservable), "") << "seed " << seed;
    if (!s.converged()) continue;
    ++converged;
    EXPECT_LE(s.max_violation, 1e-8) << "seed " << seed;
    EXPECT_LE(FirstOrderConditions(p.problem).stationarity, 1e-4)
        << "seed " << seed << ": " << s.message << ", cost " << s.cost;
  }
  EXPECT_GE(double(converged), 0.95 * double(num_problems()));
}

TEST(Optimality, IpoptFindsNoBetterPointNearby) {
  if (!ipopt_present()) GTEST_SKIP() << "this build has no Ipopt";
  IpoptOptions options;
  options.hessian = Hessian::exact;
  std::uint64_t compared = 0;
  for (std::uint64_t seed = 0; seed < num_problems(); ++seed) {
    RandomProblem p = random_problem(seed);
    const Summary s = solve(p.problem, AugmentedLagrangianOptions{});
    if (!s.converged()) continue;
    const Eigen::VectorXd here = p.values();
    const double multipliers = FirstOrderConditions(p.problem).multipliers;
    const Summary t = solve(p.problem, options);
    if (!t.converged() || (p.values() - here).norm() > 0.1) continue;  // another minimum
    ++compared;
    // Both costs may differ by a relative 1e-7, and by the tolerance on the bounds times the multipliers.
    EXPECT_LE(s.cost, t.cost + 1e-7 * (1 + s.cost + multipliers)) << "seed " << seed;
  }
  EXPECT_GE(double(compared), 0.75 * double(num_problems()));
}

}  // namespace
}  // namespace tandem::testing
