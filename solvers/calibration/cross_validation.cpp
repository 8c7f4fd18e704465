#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <tuple>

#include <Eigen/Cholesky>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/counted_rows.hpp>
#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/solvers/calibration/saved_noise.hpp>
#include <tandem/solvers/calibration/solve_plainly.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem {
namespace {

constexpr const char* kWhat = "held-out measurements";
constexpr int kEnough = 100;      // iterations
constexpr double kLeftOut = 1e5;  // times a noise: 1e-10 of its information is none

using Key = std::tuple<int, int, int>;
Key key_of(int problem, const Block& block) { return {problem, block.pool, block.id}; }

/// The groups without the rows of a fold.
std::vector<NoiseGroup> without(const std::vector<NoiseGroup>& groups, const std::vector<LeftOut>& fold) {
  std::set<Key> out;
  for (const LeftOut& m : fold) out.insert(key_of(m.problem, m.block));
  std::vector<NoiseGroup> rest;
  for (const NoiseGroup& group : groups) {
    NoiseGroup& kept = rest.emplace_back(NoiseGroup{group.name, {}, group.prior});
    for (const NoiseRows& rows : group.rows)
      if (!out.contains(key_of(rows.problem, rows.block))) kept.rows.push_back(rows);
    if (kept.rows.empty()) throw Error("calibrate: a fold leaves nothing of " + group.name + "; take more folds");
  }
  return rest;
}

void scale_noise(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups, const Calibration& found) {
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const NoiseRows& rows : groups[g].rows) {
      Problem& problem = *problems[std::size_t(rows.problem)];
      const Gaussian noise = problem.noise(rows.block);
      Eigen::VectorXd factor = Eigen::VectorXd::Ones(noise.dim());
      factor.segment(rows.first, rows.count < 0 ? noise.dim() - rows.first : rows.count)
          .setConstant(found.noise[g].factor);
      problem.set_noise(rows.block, noise.scaled(factor));
    }
}

void leave_out(std::span<Problem* const> problems, const std::vector<LeftOut>& fold) {
  for (const LeftOut& m : fold) {
    Problem& problem = *problems[std::size_t(m.problem)];
    problem.set_noise(m.block, problem.noise(m.block).scaled(kLeftOut));
  }
}

}  // namespace

double LeftOutPrediction::squared_distance() const { return residual.dot(covariance.llt().solve(residual)); }

double LeftOutPrediction::log_density(const Loss& loss) const {
  const Eigen::LLT<Eigen::MatrixXd> llt(covariance);
  const double s = residual.dot(llt.solve(residual));
  const int rows = static_cast<int>(residual.size());
  const double log_scale = llt.matrixLLT().diagonal().array().log().sum() / rows + 0.5 * std::log(2 * std::numbers::pi);
  return -0.5 * loss(s).rho - counted_rows(loss, rows) * log_scale;
}

CrossValidation cross_validate(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                               const std::vector<std::vector<LeftOut>>& folds, const CalibrationOptions& options) {
  CrossValidation result;
  const auto solve = [&](std::string& why) {
    for (Problem* problem : problems) {
      const Summary summary =
          options.solve ? options.solve(*problem) : detail::solve_plainly(*problem, options.stop, kEnough);
      // Without a fold some direction may be all but free: the best point has a prediction, as uncertain as that.
      if (!summary.converged()) options.stop.check(kWhat);
      if (!summary.converged() && summary.status != Status::max_iterations) {
        why = summary.message;
        return false;
      }
    }
    return true;
  };
  // Residuals and covariances of a fold at the problems' solution; `noise`: what the measurements would have.
  const auto predictions = [&](std::size_t f, const std::vector<Gaussian>& noise) {
    std::vector<LeftOutPrediction> all;
    std::vector<std::optional<Marginals>> marginals(problems.size());
    for (std::size_t i = 0; i < folds[f].size(); ++i) {
      const LeftOut& m = folds[f][i];
      if (!m.scored) continue;
      auto& of_problem = marginals[std::size_t(m.problem)];
      if (!of_problem)
        of_problem.emplace(*problems[std::size_t(m.problem)], std::span<const Marginals::Pair>(), options.stop);
      const Problem::Linearization at = problems[std::size_t(m.problem)]->linearization(m.block);
      const Eigen::MatrixXd taken = at.jacobian * of_problem->joint(at.variable_ids, at.dofs);
      all.push_back({f, i, at.residual, noise[i].covariance_matrix() + taken * at.jacobian.transpose()});
    }
    return all;
  };
  std::vector<double> gains;
  for (std::size_t f = 0; f < folds.size(); ++f) {
    if (options.stop.reached()) {
      result.why = "cut short";
      return result;
    }
    const std::vector<LeftOut>& fold = folds[f];
    if (fold.empty()) continue;
    detail::SavedNoise saved(problems, groups);
    for (const LeftOut& m : fold) saved.keep(m.problem, m.block);
    std::vector<Gaussian> given;
    for (const LeftOut& m : fold) given.push_back(problems[std::size_t(m.problem)]->noise(m.block));
    try {
      leave_out(problems, fold);
      if (solve(result.why)) {
        const auto by_given = predictions(f, given);
        CalibrationOptions quick = options;
        quick.ranges = false;
        const Calibration found = calibrate(problems, without(groups, fold), quick);
        options.stop.check(kWhat);
        saved.restore();
        scale_noise(problems, groups, found);
        std::vector<Gaussian> noise;
        for (const LeftOut& m : fold) noise.push_back(problems[std::size_t(m.problem)]->noise(m.block));
        leave_out(problems, fold);
        if (solve(result.why)) {
          const auto by_found = predictions(f, noise);
          double gain = 0;
          for (std::size_t i = 0; i < by_given.size(); ++i) {
            const Loss& loss = fold[by_given[i].index].loss;
            const double a = by_given[i].log_density(loss), b = by_found[i].log_density(loss);
            result.given_log_likelihood += a;
            result.found_log_likelihood += b;
            gain += b - a;
          }
          gains.push_back(gain);
          result.given.insert(result.given.end(), by_given.begin(), by_given.end());
          result.found.insert(result.found.end(), by_found.begin(), by_found.end());
        }
      }
    } catch (const Error& error) {
      result.why = error.what();
    }
    saved.restore();
    if (!result.why.empty()) return result;
  }
  result.complete = true;
  result.gain = result.found_log_likelihood - result.given_log_likelihood;
  double mean = result.gain / double(std::max<std::size_t>(gains.size(), 1)), squares = 0;
  for (const double g : gains) squares += (g - mean) * (g - mean);
  if (gains.size() > 1) result.gain_error = std::sqrt(squares * double(gains.size()) / double(gains.size() - 1));
  try {
    std::string ignored;
    solve(ignored);
  } catch (const Stopped&) {  // the answer is there
  }
  return result;
}

}  // namespace tandem
