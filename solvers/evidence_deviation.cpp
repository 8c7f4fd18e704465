#include <cmath>

#include <tandem/solvers/evidence_deviation.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem {

std::optional<double> evidence_deviation(const Problem& solved, const Variable<Rn<1>>& x, double step,
                                         const Stop& stop) {
  if (solved.num_hard_blocks() > 0 || !(step > 0)) return {};
  Problem problem = solved.copy();
  const Variable<Rn<1>> held = problem.counterpart(x);
  const double at = solved.value(x).vector()[0];
  problem.fix(held);
  GaussNewtonOptions options;
  stop.limit(options);
  const auto evidence = [&](double value) -> double {
    stop.check("the evidence along a variable");
    problem.set_value(held, Rn<1>(Vector<1>(value)));
    const Summary summary = solve(problem, options);
    if (!summary.converged()) return NAN;
    return -summary.cost - 0.5 * Marginals(problem, {}, stop).log_determinant();
  };
  const double below = evidence(at - step), here = evidence(at), above = evidence(at + step);
  const double second = (above - 2 * here + below) / (step * step);
  if (!std::isfinite(second)) return {};
  return second < 0 ? 1 / std::sqrt(-second) : HUGE_VAL;
}

}  // namespace tandem
