#include <cmath>
#include <numeric>
#include <optional>

#include <tandem/solvers/calibration/default_solve.hpp>
#include <tandem/solvers/calibration/held_out.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem::detail {
namespace {

constexpr int kMaxIterations = 100;
constexpr double kHeldOutSigmaFactor = 1e5;  // leaves 1e-10 of the information

}  // namespace

void hold_out(std::span<Problem* const> problems, const std::vector<HeldOutMeasurement>& fold,
              std::vector<Gaussian>& noise) {
  noise.clear();
  for (const HeldOutMeasurement& m : fold) {
    Problem& problem = problem_at(problems, m.problem);
    noise.push_back(problem.noise(m.block));
    problem.set_noise(m.block, noise.back().scaled(kHeldOutSigmaFactor));
  }
}

std::optional<Summary> solve_all(std::size_t count, const Stop& stop, FunctionRef<Summary(std::size_t index)> solve) {
  for (std::size_t p = 0; p < count; ++p) {
    Summary summary = solve(p);
    // Without a fold, a direction may be nearly unobservable. An unconverged point still predicts, with a large
    // covariance.
    if (!summary.converged()) stop.check(kHeldOutTask);
    if (!summary.converged() && summary.status != Status::max_iterations) return summary;
  }
  return {};
}

std::optional<Summary> solve_all(std::span<Problem* const> problems, const CalibrationOptions& options) {
  return solve_all(problems.size(), options.stop, [&](std::size_t p) {
    return options.solve ? options.solve(*problems[p]) : solve_with_default(*problems[p], options.stop, kMaxIterations);
  });
}

std::vector<HeldOutPrediction> predictions(std::span<Problem* const> problems,
                                           const std::vector<HeldOutMeasurement>& fold, std::size_t f,
                                           const std::vector<Gaussian>& noise, const Stop& stop) {
  std::vector<HeldOutPrediction> all;
  std::vector<std::optional<Marginals>> marginals(problems.size());
  for (std::size_t i = 0; i < fold.size(); ++i) {
    const HeldOutMeasurement& m = fold[i];
    if (!m.scored) continue;
    Problem& problem = problem_at(problems, m.problem);
    auto& marginal = marginals[std::size_t(m.problem)];
    if (!marginal) {
      marginal = Marginals::without_gauges(problem, stop);
      marginal->require_regular();
    }
    const Problem::Linearization at = problem.linearization(m.block);
    HeldOutPrediction& p = all.emplace_back(HeldOutPrediction{
        f, i, at.residual, noise[i].covariance_matrix() + marginal->propagated(at.jacobian, at.variable_ids, at.dofs)});
    p.log_likelihood = p.log_density(m.loss);
    const Loss loss = problem.loss(m.block);
    if (loss.kind != m.loss.kind || loss.scale == m.loss.scale) continue;
    const int rows = static_cast<int>(at.residual.size());
    p.log_likelihood = p.log_density(loss) + log_constant(loss, rows) - log_constant(m.loss, rows);
  }
  return all;
}

double log_likelihood_gain(const std::vector<HeldOutPrediction>& a, const std::vector<HeldOutPrediction>& b) {
  double gain = 0;
  for (std::size_t i = 0; i < a.size(); ++i) gain += b[i].log_likelihood - a[i].log_likelihood;
  return gain;
}

double standard_error_of_sum(const std::vector<double>& gains) {
  const auto n = double(gains.size());
  if (gains.size() < 2) return 0;
  const double mean = std::accumulate(gains.begin(), gains.end(), 0.0) / n;
  double squares = 0;
  for (const double g : gains) squares += (g - mean) * (g - mean);
  return std::sqrt(squares * n / (n - 1));
}

}  // namespace tandem::detail
