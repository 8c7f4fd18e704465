#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <tuple>

#include <Eigen/Cholesky>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/counted_rows.hpp>
#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/solvers/calibration/held_out.hpp>
#include <tandem/solvers/calibration/saved_noise.hpp>

namespace tandem {
namespace {

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
    const auto predict = [&](std::vector<LeftOutPrediction>& all, double& log_likelihood) {
      std::vector<Gaussian> noise;
      detail::leave_out(problems, fold, noise);
      if (!detail::solve_all(problems, options, result.why)) return false;
      all = detail::predictions(problems, fold, f, noise, options.stop);
      for (const LeftOutPrediction& p : all) log_likelihood += p.log_density(fold[p.index].loss);
      return true;
    };
    try {
      std::vector<LeftOutPrediction> by_given, by_found;
      if (predict(by_given, result.given_log_likelihood)) {
        CalibrationOptions quick = options;
        quick.ranges = false;
        const Calibration found = calibrate(problems, without(groups, fold), quick);
        options.stop.check("held-out measurements");
        saved.restore();
        scale_noise(problems, groups, found);
        if (predict(by_found, result.found_log_likelihood)) {
          gains.push_back(detail::gain_of(fold, by_given, by_found));
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
  result.gain_error = detail::error_of_sum(gains);
  try {
    std::string ignored;
    detail::solve_all(problems, options, ignored);
  } catch (const Stopped&) {  // the answer is there
  }
  return result;
}

}  // namespace tandem
