#include <algorithm>
#include <cmath>

#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/profile_evidence.hpp>

namespace tandem {
namespace {

/// Returns the Laplace evidence with x fixed at `value`. The other variables are solved from their present values. NaN
/// if the solve does not converge.
double evidence_at(const Problem& solved, const Variable<Rn<1>>& x, double value, const Stop& stop) {
  stop.check("profile evidence");
  Problem problem = solved.copy();
  const Variable<Rn<1>> held = problem.counterpart(x);
  problem.set_value(held, Rn<1>(Vector<1>(value)));
  problem.fix(held);
  GaussNewtonOptions options;
  stop.limit(options);
  const Summary summary = solve(problem, options);
  stop.check("profile evidence");
  if (!summary.converged()) return NAN;
  const Marginals marginals = Marginals::without_gauges(problem, stop);
  marginals.require_regular();
  return -summary.cost - 0.5 * marginals.log_determinant();
}

}  // namespace

std::optional<double> profile_evidence_sigma(const Problem& solved, const Variable<Rn<1>>& x, double step, double most,
                                             const Stop& stop) {
  constexpr int kTries = 4;
  constexpr double kNear = 1.25;  // largest accepted ratio of the step and the resulting standard deviation
  if (solved.num_hard_blocks() > 0 || !(step > 0)) return {};
  const double at = solved.value(x).vector()[0];
  try {
    const double here = evidence_at(solved, x, at, stop);
    double deviation = step;
    for (int i = 0; i < kTries; ++i) {
      step = std::min(deviation, most);
      const double ahead = evidence_at(solved, x, at + step, stop), behind = evidence_at(solved, x, at - step, stop);
      const double second = (ahead - 2 * here + behind) / (step * step);
      if (!std::isfinite(second)) return {};
      deviation = second < 0 ? 1 / std::sqrt(-second) : HUGE_VAL;
      if (std::min(deviation, most) < kNear * step && deviation > step / kNear) break;
    }
    return deviation;
  } catch (const NumericalError&) {  // no covariance exists at a trial value
    return {};
  }
}

std::vector<double> profile_evidence(const Problem& solved, const Variable<Rn<1>>& x, const std::vector<double>& values,
                                     const Stop& stop) {
  if (solved.num_hard_blocks() > 0) return {};
  const auto at = [&](double value) {
    try {
      return evidence_at(solved, x, value, stop);
    } catch (const NumericalError&) {
      return double(NAN);
    }
  };
  const double here = at(solved.value(x).vector()[0]);
  std::vector<double> along;
  for (const double value : values) along.push_back(at(value) - here);
  return along;
}

}  // namespace tandem
