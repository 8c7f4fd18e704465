#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <set>
#include <tuple>

#include <Eigen/Cholesky>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/counted_rows.hpp>
#include <tandem/solvers/calibration/cross_validation.hpp>
#include <tandem/solvers/calibration/held_out.hpp>
#include <tandem/solvers/calibration/saved_noise.hpp>
#include <tandem/solvers/calibration/scale_noise.hpp>

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
      std::vector<Gaussian> ignored;
      detail::leave_out(plain(built.problems), fold, ignored);
      for (std::size_t p = 0; p < built.problems.size(); ++p) detail::take_values(*problems[p], *built.problems[p]);
      return built;
    };
    BuiltCalibration found = calibrate_built(build_without, parameters, quick);
    quick.stop.check(detail::kHeldOut);
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
    const auto predict = [&](std::span<Problem* const> by, std::vector<LeftOutPrediction>& all,
                             double& log_likelihood) {
      std::vector<Gaussian> noise;
      detail::leave_out(by, fold, noise);
      if (!detail::solve_all(by, options, result.why)) return false;
      all = detail::predictions(by, fold, f, noise, options.stop);
      for (const LeftOutPrediction& p : all) log_likelihood += p.log_likelihood;
      return true;
    };
    try {
      std::vector<LeftOutPrediction> by_given, by_found;
      if (predict(problems, by_given, result.given_log_likelihood)) {
        CalibrationOptions quick = options;
        quick.ranges = false;
        const Found found = find(fold, quick);
        options.stop.check(detail::kHeldOut);
        saved.restore();
        const std::vector<Problem*> built = plain(found.built);
        const std::span<Problem* const> with = built.empty() ? problems : std::span<Problem* const>(built);
        detail::scale_noise(with, groups, found.noise);
        if (predict(with, by_found, result.found_log_likelihood)) {
          gains.push_back(detail::gain_of(by_given, by_found));
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

}  // namespace
}  // namespace tandem
