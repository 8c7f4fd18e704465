#include <cstdlib>

#include <gtest/gtest.h>

#include "cases.hpp"
#include "random_programs.hpp"
#include "sanitized.hpp"

/// What augmented-lagrangian calls converged meets the first-order conditions, and Ipopt finds nothing better nearby.
/// TANDEM_FUZZ_PROGRAMS says how many random programs; 10,000 take about a minute.
namespace tandem::testing {
namespace {

std::uint64_t num_programs() {
  const char* text = std::getenv("TANDEM_FUZZ_PROGRAMS");
  return text ? std::strtoull(text, nullptr, 10) : kSanitized ? 100 : 400;
}

TEST(Optimality, WhatConvergedMeetsTheFirstOrderConditions) {
  std::uint64_t converged = 0;
  for (std::uint64_t seed = 0; seed < num_programs(); ++seed) {
    RandomProgram p = random_program(seed);
    const Summary s = solve(p.problem, AugmentedLagrangianOptions{});
    EXPECT_NE(s.status, Status::unconstrained) << "seed " << seed << ": " << s.message;
    if (!s.converged()) continue;  // and says so
    ++converged;
    EXPECT_LE(s.max_violation, 1e-8) << "seed " << seed;
    EXPECT_LE(optimality(p.problem).residual, 1e-4) << "seed " << seed << ": " << s.message << ", cost " << s.cost;
  }
  EXPECT_GE(double(converged), 0.95 * double(num_programs()));
}

TEST(Optimality, IpoptFindsNothingBetterNearby) {
  if (!ipopt_present()) GTEST_SKIP() << "this build has no Ipopt";
  IpoptOptions options;
  options.hessian = Hessian::exact;
  std::uint64_t compared = 0;
  for (std::uint64_t seed = 0; seed < num_programs(); ++seed) {
    RandomProgram p = random_program(seed);
    const Summary s = solve(p.problem, AugmentedLagrangianOptions{});
    if (!s.converged()) continue;
    const Eigen::VectorXd here = p.values();
    const double multipliers = optimality(p.problem).multipliers;
    const Summary t = solve(p.problem, options);
    if (!t.converged() || (p.values() - here).norm() > 0.1) continue;  // it went to another minimum
    ++compared;
    // To seven digits of the cost, and of what bounds that both may be off by are worth.
    EXPECT_LE(s.cost, t.cost + 1e-7 * (1 + s.cost + multipliers)) << "seed " << seed;
  }
  EXPECT_GE(double(compared), 0.75 * double(num_programs()));
}

}  // namespace
}  // namespace tandem::testing
