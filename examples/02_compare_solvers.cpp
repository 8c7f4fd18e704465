// Solves one constrained problem with every solver that supports it and compares optimum and time.
#include <cmath>
#include <cstdio>
#include <optional>
#include <vector>

#include <tandem/lie/se2.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/nlopt.hpp>

using namespace tandem;

// Planar vehicle between two known poses. Its odometry reports sideways slip, but the constraints require zero sway and
// a surge of at most 1.1 m/s.
Problem make_problem() {
  const SE2 first, last(SO2(0.8), {18.0, 8.0}), step = SE2::Exp(Vector<3>(1.0, 0.05, 0.03));
  constexpr int n = 21;
  Problem problem;
  std::vector<Variable<SE2>> x;
  for (int k = 0; k < n; ++k) {
    x.push_back(problem.add(k == 0 ? first : problem.value(x.back()) * step, "pose " + std::to_string(k)));
    if (k == 0) continue;
    problem.minimize(RelativePose<SE2>{step}, Gaussian{0.1, 0.1, 0.05}, {x[k - 1], x[k]});
    problem.subject_to(TwistComponents<SE2, sway>{1.0}, equal_to(0.0), {x[k - 1], x[k]});
    problem.subject_to(TwistComponents<SE2, surge>{1.0}, between(0.0, 1.1), {x[k - 1], x[k]});
  }
  problem.minimize(Prior<SE2>{first}, Gaussian{0.01, 0.01, 0.01}, {x.front()});
  problem.minimize(Prior<SE2>{last}, Gaussian{0.1, 0.1, 0.05}, {x.back()});
  return problem;
}

// Returns true if the solver finds the same optimum as the previous solvers or reports that it does not support the
// problem.
template <class Options>
bool agrees(const char* name, const Options& options, std::optional<double>& optimum) {
  Problem problem = make_problem();
  if (const std::string why = why_unsupported(problem, options); !why.empty()) {
    std::printf("%-22s%s\n", name, why.c_str());
    return true;
  }
  const Summary s = solve(problem, options);
  std::printf("%-22scost %.6f, violation %.1e, %d iterations, %.1f ms\n", name, s.cost, s.max_violation, s.iterations,
              1e3 * s.seconds);
  if (!optimum) optimum = s.cost;
  return s.converged() && s.max_violation < 1e-6 && std::abs(s.cost - *optimum) < 1e-5 * *optimum;
}

int main() {
  NloptOptions slsqp;
  slsqp.algorithm = "slsqp";
  std::optional<double> optimum;
  const bool gauss_newton = agrees("gauss-newton", GaussNewtonOptions{}, optimum);  // supports soft residuals only
  const bool augmented = agrees("augmented-lagrangian", AugmentedLagrangianOptions{}, optimum);
  const bool ipopt = agrees("ipopt", IpoptOptions{}, optimum);
  const bool nlopt = agrees("nlopt:slsqp", slsqp, optimum);
  return optimum && gauss_newton && augmented && ipopt && nlopt ? 0 : 1;
}
