#include <set>

#include <gtest/gtest.h>

#include "solvers/battery/first_order_conditions.hpp"
#include "solvers/battery/hock_schittkowski.hpp"
#include "solvers/cases.hpp"

/// Tests all solvers on problems of Hock & Schittkowski with known minima.
namespace tandem::testing {
namespace {

constexpr double kLeastCurvature = 1e-4;  // all unknowns are of order 1

class HockSchittkowskiCollection : public ::testing::TestWithParam<AnySolver> {};

/// No solver claims to have converged elsewhere than at a first-order point, nor that a problem is infeasible.
TEST_P(HockSchittkowskiCollection, ClaimsAreTrue) {
  const bool nlopt = GetParam().name.starts_with("nlopt");
  for (HockSchittkowski& p : hock_schittkowski()) {
    const Summary s = GetParam()(p.problem, {.max_iterations = nlopt ? 5000 : 500});
    const FirstOrderConditions at(p.problem, kLeastCurvature);
    EXPECT_NE(s.status, Status::infeasible) << "problem " << p.number << ": " << s.message;
    if (!s.converged()) continue;
    EXPECT_LE(at.violation, 1e-7) << "problem " << p.number;
    EXPECT_LE(at.stationarity, nlopt ? 1e-3 : 1e-4) << "problem " << p.number << ": " << s.message;
  }
}

INSTANTIATE_TEST_SUITE_P(Solvers, HockSchittkowskiCollection, ::testing::ValuesIn(hard_solvers()), name_of);

/// Problems outside of `elsewhere` must end at their minimum.
void expect_known_minima(const AnySolver& solver, const std::set<int>& elsewhere) {
  for (HockSchittkowski& p : hock_schittkowski()) {
    const Summary s = solver(p.problem);
    const double tolerance = 1e-5 * (1 + std::abs(p.minimum));
    if (!elsewhere.contains(p.number))
      EXPECT_NEAR(p.objective(s.cost), p.minimum, tolerance) << "problem " << p.number << ": " << s.message;
  }
}

TEST(HockSchittkowskiMinima, AugmentedLagrangianFindsThem) {
  // Problems 2, 16 and 20 have other minima. The constraints of problem 13 have no multipliers at the minimum. In
  // problem 7, a curvature of the Gauss-Newton model vanishes at the minimum.
  expect_known_minima(any_solver("augmented_lagrangian", true, AugmentedLagrangianOptions{}), {2, 7, 13, 16, 20});
}

TEST(HockSchittkowskiMinima, IpoptFindsThem) {
  if (!ipopt_present()) GTEST_SKIP() << "this build has no Ipopt";
  for (const AnySolver& solver : {ipopt(Hessian::automatic), ipopt(Hessian::exact), ipopt_mumps()})
    expect_known_minima(solver, {2, 13, 16, 20});
}

}  // namespace
}  // namespace tandem::testing
