#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <tuple>

#include <Eigen/Cholesky>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/counted_rows.hpp>
#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>
#include <tandem/solvers/calibration/saved_noise.hpp>
#include <tandem/solvers/calibration/scale_noise.hpp>
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

void leave_out(std::span<Problem* const> problems, const std::vector<LeftOut>& fold) {
  for (const LeftOut& m : fold) {
    Problem& problem = *problems[std::size_t(m.problem)];
    problem.set_noise(m.block, problem.noise(m.block).scaled(kLeftOut));
  }
}

/// What is found of all but a fold: noise, and parameters where problems are built by them.
struct Found {
  Calibration noise;
  std::vector<std::shared_ptr<Problem>> built;  // by the parameters as found, nothing left out; none: there are none
};
using Find = std::function<Found(const std::vector<LeftOut>& fold, const CalibrationOptions& options)>;

std::vector<Problem*> plain(const std::vector<std::shared_ptr<Problem>>& built) {
  std::vector<Problem*> all;
  for (const auto& problem : built) all.push_back(problem.get());
  return all;
}

CrossValidation cross_validate_by(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                                  const std::vector<std::vector<LeftOut>>& folds, const CalibrationOptions& options,
                                  const Find& find);

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
  const auto find = [&](const std::vector<LeftOut>& fold, const CalibrationOptions& quick) {
    return Found{calibrate(problems, without(groups, fold), quick), {}};
  };
  return cross_validate_by(problems, groups, folds, options, find);
}

CrossValidation cross_validate(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                               const std::vector<std::vector<LeftOut>>& folds, const BuildProblems& build,
                               const std::vector<BuiltParameter>& parameters, const CalibrationOptions& options) {
  const auto find = [&](const std::vector<LeftOut>& fold, const CalibrationOptions& quick) {
    std::set<Key> out;
    for (const LeftOut& m : fold) out.insert(key_of(m.problem, m.block));
    const BuildProblems build_without = [&](const Eigen::VectorXd& values) {
      BuiltProblems built = build(values);
      built.groups = without(built.groups, fold);
      std::erase_if(built.measured, [&](const MeasuredBlock& m) { return out.contains(key_of(m.problem, m.block)); });
      leave_out(plain(built.problems), fold);
      for (std::size_t p = 0; p < built.problems.size(); ++p) detail::take_values(*problems[p], *built.problems[p]);
      return built;
    };
    BuiltCalibration found = calibrate_built(build_without, parameters, quick);
    quick.stop.check(kWhat);
    std::vector<std::shared_ptr<Problem>> built = build(found.values).problems;
    for (std::size_t p = 0; p < built.size(); ++p) detail::take_values(*problems[p], *built[p]);
    return Found{std::move(found.noise), std::move(built)};
  };
  return cross_validate_by(problems, groups, folds, options, find);
}

namespace {

CrossValidation cross_validate_by(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                                  const std::vector<std::vector<LeftOut>>& folds, const CalibrationOptions& options,
                                  const Find& find) {
  CrossValidation result;
  const auto solve = [&](std::span<Problem* const> solved, std::string& why) {
    for (Problem* problem : solved) {
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
  // Residuals and covariances of a fold at solved problems; `noise`: what the measurements would have.
  const auto predictions = [&](std::span<Problem* const> solved, std::size_t f, const std::vector<Gaussian>& noise) {
    std::vector<LeftOutPrediction> all;
    std::vector<std::optional<Marginals>> marginals(solved.size());
    for (std::size_t i = 0; i < folds[f].size(); ++i) {
      const LeftOut& m = folds[f][i];
      if (!m.scored) continue;
      auto& of_problem = marginals[std::size_t(m.problem)];
      if (!of_problem)
        of_problem.emplace(*solved[std::size_t(m.problem)], std::span<const Marginals::Pair>(), options.stop);
      const Problem& problem = *solved[std::size_t(m.problem)];
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
      if (solve(problems, result.why)) {
        const auto by_given = predictions(problems, f, given);
        CalibrationOptions quick = options;
        quick.ranges = false;
        const Found found = find(fold, quick);
        options.stop.check(kWhat);
        saved.restore();
        const std::vector<Problem*> built = plain(found.built);
        const std::span<Problem* const> with = built.empty() ? problems : std::span<Problem* const>(built);
        detail::scale_noise(with, groups, found.noise);
        std::vector<Gaussian> noise;
        for (const LeftOut& m : fold) noise.push_back(with[std::size_t(m.problem)]->noise(m.block));
        leave_out(with, fold);
        if (solve(with, result.why)) {
          const auto by_found = predictions(with, f, noise);
          double gain = 0;
          for (std::size_t i = 0; i < by_given.size(); ++i) {
            const double a = by_given[i].log_likelihood, b = by_found[i].log_likelihood;
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
    solve(problems, ignored);
  } catch (const Stopped&) {  // the answer is there
  }
  return result;
}

}  // namespace
}  // namespace tandem
