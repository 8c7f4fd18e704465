#include <cmath>
#include <numeric>
#include <optional>

#include <tandem/solvers/calibration/held_out.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>
#include <tandem/solvers/calibration/solve_plainly.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem::detail {
namespace {

constexpr int kEnough = 100;      // iterations
constexpr double kLeftOut = 1e5;  // times a noise: 1e-10 of its information is none

}  // namespace

void leave_out(std::span<Problem* const> problems, const std::vector<LeftOut>& fold, std::vector<Gaussian>& noise) {
  noise.clear();
  for (const LeftOut& m : fold) {
    Problem& problem = *problems[std::size_t(m.problem)];
    noise.push_back(problem.noise(m.block));
    problem.set_noise(m.block, noise.back().scaled(kLeftOut));
  }
}

bool solve_all(std::span<Problem* const> problems, const CalibrationOptions& options, std::string& why) {
  for (Problem* problem : problems) {
    const Summary summary = options.solve ? options.solve(*problem) : solve_plainly(*problem, options.stop, kEnough);
    // Without a fold some direction may be all but free: the best point has a prediction, as uncertain as that.
    if (!summary.converged()) options.stop.check(kHeldOut);
    if (!summary.converged() && summary.status != Status::max_iterations) {
      why = summary.message;
      return false;
    }
  }
  return true;
}

std::vector<LeftOutPrediction> predictions(std::span<Problem* const> problems, const std::vector<LeftOut>& fold,
                                           std::size_t f, const std::vector<Gaussian>& noise, const Stop& stop) {
  std::vector<LeftOutPrediction> all;
  std::vector<std::optional<Marginals>> marginals(problems.size());
  for (std::size_t i = 0; i < fold.size(); ++i) {
    const LeftOut& m = fold[i];
    if (!m.scored) continue;
    Problem& problem = *problems[std::size_t(m.problem)];
    auto& of_problem = marginals[std::size_t(m.problem)];
    if (!of_problem) of_problem.emplace(problem, std::span<const Marginals::Pair>(), stop);
    const Problem::Linearization at = problem.linearization(m.block);
    const Eigen::MatrixXd taken = at.jacobian * of_problem->joint(at.variable_ids, at.dofs);
    LeftOutPrediction& p = all.emplace_back(
        LeftOutPrediction{f, i, at.residual, noise[i].covariance_matrix() + taken * at.jacobian.transpose()});
    p.log_likelihood = p.log_density(m.loss);
    const Loss loss = problem.loss(m.block);
    if (loss.kind != m.loss.kind || loss.scale == m.loss.scale) continue;
    const int rows = static_cast<int>(at.residual.size());
    p.log_likelihood = p.log_density(loss) + log_constant(loss, rows) - log_constant(m.loss, rows);
  }
  return all;
}

double gain_of(const std::vector<LeftOutPrediction>& a, const std::vector<LeftOutPrediction>& b) {
  double gain = 0;
  for (std::size_t i = 0; i < a.size(); ++i) gain += b[i].log_likelihood - a[i].log_likelihood;
  return gain;
}

double error_of_sum(const std::vector<double>& gains) {
  const auto n = double(gains.size());
  if (gains.size() < 2) return 0;
  const double mean = std::accumulate(gains.begin(), gains.end(), 0.0) / n;
  double squares = 0;
  for (const double g : gains) squares += (g - mean) * (g - mean);
  return std::sqrt(squares * n / (n - 1));
}

}  // namespace tandem::detail
