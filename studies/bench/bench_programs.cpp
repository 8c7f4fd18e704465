/// Solves the problems of Hock & Schittkowski 1981 by all solvers, with the options' defaults. Prints a line per solver
/// with these numbers: problems, converged problems, those of them at the minimum of the collection, and the median and
/// the largest number of iterations. Independent code checks the largest stationarity and violation of converged
/// problems.
///   bench_programs

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <tandem/problem/quantile.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/nlopt.hpp>

#include "solvers/battery/first_order_conditions.hpp"
#include "solvers/battery/hock_schittkowski.hpp"

namespace {

using namespace tandem;

constexpr double kLeastCurvature = 1e-4;  // all unknowns are of order 1
constexpr double kTolerance = 1e-5;       // error of the minimum, relative to 1 + |minimum|

void measure(const std::string& name, const std::function<Summary(Problem&)>& solve_by) {
  std::size_t problems = 0, converged = 0, at_minimum = 0;
  double stationarity = 0, violation = 0;
  std::vector<double> iterations;
  for (testing::HockSchittkowski& p : testing::hock_schittkowski()) {
    ++problems;
    const Summary s = solve_by(p.problem);
    if (!s.converged()) continue;
    ++converged;
    at_minimum += std::abs(p.objective(s.cost) - p.minimum) <= kTolerance * (1 + std::abs(p.minimum));
    iterations.push_back(s.iterations);
    const testing::FirstOrderConditions at(p.problem, kLeastCurvature);
    stationarity = std::max(stationarity, at.stationarity);
    violation = std::max(violation, at.violation);
  }
  if (iterations.empty()) return;
  const double most = *std::max_element(iterations.begin(), iterations.end());
  fmt::print("{} {} {} {} {:.0f} {:.0f} {:.1e} {:.1e}\n", name, problems, converged, at_minimum,
             detail::median(iterations), most, stationarity, violation);
}

}  // namespace

int main() {
  using namespace tandem;
  measure("augmented-lagrangian", [](Problem& p) { return solve(p, AugmentedLagrangianOptions{}); });
  if (ipopt_available()) {
    IpoptOptions exact, mumps;
    exact.hessian = Hessian::exact;
    mumps.linear_solver = IpoptLinearSolver::mumps;
    measure("ipopt", [](Problem& p) { return solve(p, IpoptOptions{}); });
    measure("ipopt,exact-hessian", [&](Problem& p) { return solve(p, exact); });
    measure("ipopt,mumps", [&](Problem& p) { return solve(p, mumps); });
  }
  if (!nlopt_algorithms().empty())
    measure("nlopt:slsqp", [](Problem& p) {
      NloptOptions options;
      options.algorithm = "slsqp";
      return solve(p, options);
    });
}
