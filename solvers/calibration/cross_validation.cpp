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
#include <tandem/solvers/calibration/saved_values.hpp>
#include <tandem/solvers/calibration/scale_noise.hpp>

namespace tandem {
namespace {

using Key = std::tuple<int, int, int>;
Key key_of(int problem, const Block& block) { return {problem, block.pool, block.id}; }

/// Returns the groups without the rows of a fold.
std::vector<NoiseGroup> without(const std::vector<NoiseGroup>& groups, const std::vector<HeldOutMeasurement>& fold) {
  std::set<Key> out;
  for (const HeldOutMeasurement& m : fold) out.insert(key_of(m.problem, m.block));
  std::vector<NoiseGroup> rest;
  for (const NoiseGroup& group : groups) {
    NoiseGroup& remaining = rest.emplace_back(NoiseGroup{group.name, {}, group.prior});
    for (const NoiseRows& rows : group.rows)
      if (!out.contains(key_of(rows.problem, rows.block))) remaining.rows.push_back(rows);
    if (remaining.rows.empty())
      throw BadInputError("calibrate: a fold holds out all rows of " + group.name + "; use more folds");
  }
  return rest;
}

/// The calibration without one fold.
struct Found {
  Calibration noise;
  // Problems built from the calibrated parameters, with nothing held out; empty without parameters.
  std::vector<std::shared_ptr<Problem>> built;
};
/// `problems`: with the given noise, except that the fold is held out.
using Find = std::function<Found(std::span<Problem* const> problems, const std::vector<HeldOutMeasurement>& fold,
                                 const CalibrationOptions& options)>;

CrossValidation cross_validate_by(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                                  const std::vector<std::vector<HeldOutMeasurement>>& folds,
                                  const CalibrationOptions& options, const Find& find);

}  // namespace

double HeldOutPrediction::squared_distance() const { return residual.dot(covariance.llt().solve(residual)); }

double HeldOutPrediction::log_density(const Loss& loss) const {
  const Eigen::LLT<Eigen::MatrixXd> llt(covariance);
  const double s = residual.dot(llt.solve(residual));
  const int rows = static_cast<int>(residual.size());
  const double log_scale = llt.matrixLLT().diagonal().array().log().sum() / rows + 0.5 * std::log(2 * std::numbers::pi);
  return -0.5 * loss(s).rho - counted_rows(loss, rows) * log_scale;
}

CrossValidation cross_validate(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                               const std::vector<std::vector<HeldOutMeasurement>>& folds,
                               const CalibrationOptions& options) {
  const auto find = [&](std::span<Problem* const> held, const std::vector<HeldOutMeasurement>& fold,
                        const CalibrationOptions& quick) {
    return Found{calibrate(held, without(detail::counterparts(held, groups), fold), quick), {}};
  };
  return cross_validate_by(problems, groups, folds, options, find);
}

CrossValidation cross_validate(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                               const std::vector<std::vector<HeldOutMeasurement>>& folds, const BuildProblems& build,
                               const std::vector<BuiltParameter>& parameters, const CalibrationOptions& options) {
  const auto find = [&](std::span<Problem* const> held, const std::vector<HeldOutMeasurement>& fold,
                        const CalibrationOptions& quick) {
    std::set<Key> out;
    for (const HeldOutMeasurement& m : fold) out.insert(key_of(m.problem, m.block));
    const BuildProblems build_without = [&](const Eigen::VectorXd& values) {
      BuiltProblems built = build(values);
      built.groups = without(built.groups, fold);
      std::erase_if(built.measured, [&](const MeasuredBlock& m) { return out.contains(key_of(m.problem, m.block)); });
      std::vector<Gaussian> ignored;
      const std::vector<Problem*> by = detail::pointers_to(built.problems);
      detail::hold_out(by, detail::counterparts(by, fold), ignored);
      for (std::size_t p = 0; p < built.problems.size(); ++p) detail::copy_values(*held[p], *built.problems[p]);
      return built;
    };
    BuiltCalibration found = calibrate_built(build_without, parameters, quick);
    quick.stop.check(detail::kHeldOutTask);
    std::vector<std::shared_ptr<Problem>> built = build(found.values).problems;
    for (std::size_t p = 0; p < built.size(); ++p) detail::copy_values(*held[p], *built[p]);
    return Found{std::move(found.noise), std::move(built)};
  };
  return cross_validate_by(problems, groups, folds, options, find);
}

namespace {

CrossValidation cross_validate_by(std::span<Problem* const> given, const std::vector<NoiseGroup>& given_groups,
                                  const std::vector<std::vector<HeldOutMeasurement>>& folds,
                                  const CalibrationOptions& options, const Find& find) {
  CrossValidation result;
  std::vector<double> gains;
  const std::vector<std::shared_ptr<Problem>> copies = detail::copies_of(given);
  const std::vector<Problem*> problems = detail::pointers_to(copies);
  const std::vector<NoiseGroup> groups = detail::counterparts(problems, given_groups);
  for (std::size_t f = 0; f < folds.size(); ++f) {
    if (options.stop.reached()) {
      result.why = "stopped";
      return result;
    }
    const std::vector<HeldOutMeasurement> fold = detail::counterparts(problems, folds[f]);
    if (fold.empty()) continue;
    detail::SavedNoise saved(problems, groups);
    for (const HeldOutMeasurement& m : fold) saved.save(m.problem, m.block);
    const auto predict = [&](std::span<Problem* const> by, std::vector<HeldOutPrediction>& all,
                             double& log_likelihood) {
      std::vector<Gaussian> noise;
      const std::vector<HeldOutMeasurement> held = detail::counterparts(by, fold);
      detail::hold_out(by, held, noise);
      if (const auto failed = detail::solve_all(by, options)) {
        result.why = failed->message;
        result.unobservable = describe(failed->unobservable);
        return false;
      }
      all = detail::predictions(by, held, f, noise, options.stop);
      for (const HeldOutPrediction& p : all) log_likelihood += p.log_likelihood;
      return true;
    };
    try {
      std::vector<HeldOutPrediction> by_given, by_found;
      if (predict(problems, by_given, result.given_log_likelihood)) {
        CalibrationOptions quick = options;
        quick.ranges = false;
        const Found found = find(problems, fold, quick);
        options.stop.check(detail::kHeldOutTask);
        saved.restore();
        const std::vector<Problem*> built = detail::pointers_to(found.built);
        const std::span<Problem* const> with = built.empty() ? problems : std::span<Problem* const>(built);
        detail::scale_noise(with, detail::counterparts(with, groups), found.noise);
        if (predict(with, by_found, result.found_log_likelihood)) {
          gains.push_back(detail::log_likelihood_gain(by_given, by_found));
          result.given.insert(result.given.end(), by_given.begin(), by_given.end());
          result.found.insert(result.found.end(), by_found.begin(), by_found.end());
        }
      }
    } catch (const NotObservableError& error) {
      result.why = error.what();
      result.unobservable = error.states();
    } catch (const NumericalError& error) {
      result.why = error.what();
    }
    saved.restore();
    if (!result.why.empty()) return result;
  }
  result.complete = true;
  result.gain = result.found_log_likelihood - result.given_log_likelihood;
  result.gain_error = detail::standard_error_of_sum(gains);
  return result;
}

}  // namespace
}  // namespace tandem
