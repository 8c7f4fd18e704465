#include <cstdlib>

#include <gtest/gtest.h>

#include "cases.hpp"
#include "random_programs.hpp"

/// What augmented-lagrangian calls converged meets the first-order conditions. TANDEM_FUZZ_PROGRAMS says on how many
/// random programs; 10,000 take some seconds.
namespace tandem::testing {
namespace {

std::uint64_t num_programs() {
  const char* text = std::getenv("TANDEM_FUZZ_PROGRAMS");
  return text ? std::strtoull(text, nullptr, 10) : 400;
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

}  // namespace
}  // namespace tandem::testing
