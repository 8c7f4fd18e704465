#include <algorithm>
#include <cmath>

#include <tandem/solvers/evidence_deviation.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem {
namespace {

/// With x at a value, and all else from where it was solved.
double evidence(const Problem& solved, const Variable<Rn<1>>& x, double value, const Stop& stop) {
  stop.check("the evidence along a variable");
  Problem problem = solved.copy();
  const Variable<Rn<1>> held = problem.counterpart(x);
  problem.set_value(held, Rn<1>(Vector<1>(value)));
  problem.fix(held);
  GaussNewtonOptions options;
  stop.limit(options);
  const Summary summary = solve(problem, options);
  stop.check("the evidence along a variable");
  if (!summary.converged()) return NAN;
  return -summary.cost - 0.5 * Marginals(problem, {}, stop).log_determinant();
}

}  // namespace

std::optional<double> evidence_deviation(const Problem& solved, const Variable<Rn<1>>& x, double step, double most,
                                         const Stop& stop) {
  constexpr int kTries = 4;
  constexpr double kNear = 1.25;  // a step by which the parabola is of the deviation that comes out
  if (solved.num_hard_blocks() > 0 || !(step > 0)) return {};
  const double at = solved.value(x).vector()[0];
  try {
    const double here = evidence(solved, x, at, stop);
    double deviation = step;
    for (int i = 0; i < kTries; ++i) {
      step = std::min(deviation, most);
      const double ahead = evidence(solved, x, at + step, stop), behind = evidence(solved, x, at - step, stop);
      const double second = (ahead - 2 * here + behind) / (step * step);
      if (!std::isfinite(second)) return {};
      deviation = second < 0 ? 1 / std::sqrt(-second) : HUGE_VAL;
      if (std::min(deviation, most) < kNear * step && deviation > step / kNear) break;
    }
    return deviation;
  } catch (const Stopped&) {
    throw;
  } catch (const Error&) {  // there is no covariance so far away
    return {};
  }
}

std::vector<double> evidence_along(const Problem& solved, const Variable<Rn<1>>& x, const std::vector<double>& values,
                                   const Stop& stop) {
  if (solved.num_hard_blocks() > 0) return {};
  const auto at = [&](double value) {
    try {
      return evidence(solved, x, value, stop);
    } catch (const Stopped&) {
      throw;
    } catch (const Error&) {
      return double(NAN);
    }
  };
  const double here = at(solved.value(x).vector()[0]);
  std::vector<double> along;
  for (const double value : values) along.push_back(at(value) - here);
  return along;
}

}  // namespace tandem
