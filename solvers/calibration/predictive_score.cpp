#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <span>

#include <Eigen/Cholesky>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/problem/quantile.hpp>
#include <tandem/solvers/calibration/default_solve.hpp>
#include <tandem/solvers/calibration/held_out.hpp>
#include <tandem/solvers/calibration/predictive_score.hpp>
#include <tandem/solvers/calibration/saved_noise.hpp>
#include <tandem/solvers/calibration/score_folds.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem {
namespace {

constexpr int kMaxRows = 6;
constexpr int kMinBlocks = 5, kBlocks = 8;  // blocks of time in a recording: minimum, and preferred minimum
constexpr double kDegreesOfFreedom = 4;
/// Factors c(d) on the covariance of d rows, the roots of E[(ν + d) q / (ν c + q)] = d with q ~ χ²_d and ν = 4: with
/// them, the expected log density of Gaussian errors is stationary at the right covariance.
constexpr std::array<double, kMaxRows> kScale = {0.6906, 0.7267, 0.7559, 0.7798, 0.7997, 0.8166};
/// log Γ((ν + d) / 2) for d rows; log Γ(ν / 2) is 0. A table, because std::lgamma() writes a global variable.
constexpr std::array<double, kMaxRows> kLogGamma = {0.284682870473, 0.693147180560, 1.200973602347,
                                                    1.791759469228, 2.453736570842, 3.178053830348};
/// Quantiles of χ² with 1 to 6 degrees of freedom at kCoverageLevels.
constexpr std::array<std::array<double, kCoverageLevels.size()>, kMaxRows> kQuantiles = {{{0.4549, 3.8415, 6.6349},
                                                                                          {1.3863, 5.9915, 9.2103},
                                                                                          {2.3660, 7.8147, 11.3449},
                                                                                          {3.3567, 9.4877, 13.2767},
                                                                                          {4.3515, 11.0705, 15.0863},
                                                                                          {5.3481, 12.5916, 16.8119}}};

// Decrease of the cost in a step below which the solve of a fold ends, the second one for a quick look at many models. A
// cost is the negative logarithm of a density, and a parameter has to gain 1.
constexpr double kLastDecrease = 0.01, kQuickLastDecrease = 0.1;

/// Returns the number of each measurement among those of its sensor with the same time stamp.
std::vector<int> occurrences(const std::vector<ScoredMeasurement>& all) {
  std::map<std::tuple<int, int, double>, int> seen;
  std::vector<int> numbers;
  for (const ScoredMeasurement& m : all) numbers.push_back(m.parts.empty() ? 0 : seen[{m.problem, m.sensor, m.t}]++);
  return numbers;
}

ScoredPart scored_part(const Eigen::VectorXd& residual, const Eigen::MatrixXd& noise, const Eigen::MatrixXd& predicted,
                       const ScoredRows& rows) {
  const Eigen::VectorXd r = residual.segment(rows.first, rows.count);
  const Eigen::LLT<Eigen::MatrixXd> llt(rows.noise_share * noise.block(rows.first, rows.first, rows.count, rows.count) +
                                        predicted.block(rows.first, rows.first, rows.count, rows.count));
  ScoredPart part;
  part.rows = rows.count;
  part.squared_distance = r.dot(llt.solve(r));
  const double log_determinant = 2 * llt.matrixLLT().diagonal().array().log().sum();
  part.log_density = detail::robust_log_density(part.squared_distance, log_determinant, rows.count);
  return part;
}

/// Holds out the folds one by one and predicts them.
class FoldPredictor {
 public:
  FoldPredictor(std::span<Problem* const> problems, const std::vector<ScoredMeasurement>& measurements,
                const ScoreOptions& options)
      : problems_(problems), measurements_(measurements), options_(options), number_(occurrences(measurements)) {
    for (Problem* problem : problems) reused_.push_back(std::make_unique<Reused>(*problem));
  }

  /// Returns why a solve failed, or an empty string.
  std::string solve() const {
    // If other models start from this solution, it needs more iterations. Otherwise they would gain only by continuing
    // the solve.
    const int iterations = !options_.start ? 200 : options_.every > 1 ? 30 : 50;
    const auto failed = detail::solve_all(reused_.size(), options_.stop, [&](std::size_t p) {
      return reused_[p]->solver.solve(options_.stop, iterations, reused_[p]->cost_tolerance);
    });
    return failed ? failed->message : "";
  }

  void keep_solution(PredictiveScore& score) {
    solved_ = values();
    for (const auto& problem : reused_)
      problem->cost_tolerance =
          (options_.every > 1 ? kQuickLastDecrease : kLastDecrease) / std::max(problem->cost(), 1.0);
    score.solutions.emplace(detail::kNothingHeldOut, solved_);
  }
  void restore_solution() const { set_values(solved_); }

  /// Predicts a fold from the other measurements. Sets the reason in `score` if that fails.
  void predict(const detail::Fold& fold, PredictiveScore& score) const {
    detail::SavedNoise saved(problems_, {});
    std::vector<HeldOutMeasurement> held_out;
    for (const std::size_t i : fold.held_out) {
      saved.save(measurements_[i].problem, measurements_[i].block);
      held_out.push_back({measurements_[i].block, measurements_[i].problem});
    }
    std::vector<Gaussian> noise;
    try {
      detail::hold_out(problems_, held_out, noise);
      choose_start(fold);
      score.why = solve();
      if (score.valid()) {
        add_parts(fold, noise, score.parts);
        score.solutions.emplace(fold.key, values());
      }
    } catch (...) {
      saved.restore();
      restore_solution();
      throw;
    }
    saved.restore();
    restore_solution();
  }

 private:
  /// Solver and evaluator of a problem for all folds.
  struct Reused {
    explicit Reused(Problem& of) : problem(of), solver(of) {}

    double cost() {
      if (!evaluator) evaluator = std::make_unique<NlpEvaluator>(problem);
      evaluator->reset();
      return evaluator->cost();
    }

    Problem& problem;
    detail::ApproximateSolver solver;
    std::unique_ptr<NlpEvaluator> evaluator;
    double cost_tolerance = 1e-6;
  };

  std::vector<detail::SavedValues> values() const {
    std::vector<detail::SavedValues> all;
    for (const Problem* problem : problems_) all.emplace_back(*problem);
    return all;
  }

  void set_values(const std::vector<detail::SavedValues>& all) const {
    for (std::size_t p = 0; p < problems_.size(); ++p) all[p].copy_to(*problems_[p]);
  }

  /// Returns the cost, infinite where a residual is undefined.
  double cost() const try {
    double sum = 0;
    for (const auto& problem : reused_) sum += problem->cost();
    return sum;
  } catch (const UndefinedResidualError&) {
    return HUGE_VAL;
  }

  /// Starts where the cost is lowest: at the solution of all measurements, at the solution of this fold by a similar
  /// model, or at the solution of all measurements moved as that of the similar model.
  void choose_start(const detail::Fold& fold) const {
    if (!options_.start) return;
    const auto similar = options_.start->find(fold.key);
    if (similar == options_.start->end() || similar->second.size() != problems_.size()) return;
    const std::vector<detail::SavedValues>* best = &solved_;
    double lowest = cost();
    const auto consider = [&](const std::vector<detail::SavedValues>& start) {
      set_values(start);
      if (const double here = cost(); here < lowest) {
        lowest = here;
        best = &start;
      }
    };
    const std::vector<detail::SavedValues>& before = options_.start->at(detail::kNothingHeldOut);
    for (std::size_t p = 0; p < problems_.size(); ++p) similar->second[p].move(before[p], *problems_[p]);
    const std::vector<detail::SavedValues> moved = values();
    restore_solution();  // values that the similar model does not have
    consider(similar->second);
    consider(moved);
    set_values(*best);
  }

  void add_parts(const detail::Fold& fold, const std::vector<Gaussian>& noise, std::vector<ScoredPart>& parts) const {
    std::vector<std::optional<Marginals>> marginals(problems_.size());
    for (std::size_t k = 0; k < fold.held_out.size(); ++k) {
      const ScoredMeasurement& m = measurements_[fold.held_out[k]];
      const double weight = fold.weight.empty() ? 1 : fold.weight[k];
      if (m.parts.empty() || weight == 0) continue;
      Problem& problem = *problems_[std::size_t(m.problem)];
      auto& marginal = marginals[std::size_t(m.problem)];
      if (!marginal) {
        marginal = Marginals::without_gauges(problem, options_.stop);
        marginal->require_regular();
      }
      const Problem::Linearization at = problem.linearization(m.block);
      const Eigen::MatrixXd predicted = marginal->propagated(at.jacobian, at.variable_ids, at.dofs);
      const Eigen::MatrixXd own = noise[k].covariance_matrix();
      for (std::size_t i = 0; i < m.parts.size(); ++i) {
        ScoredPart& part = parts.emplace_back(scored_part(at.residual, own, predicted, m.parts[i]));
        part.log_density *= weight;
        part.key = {fold.key,         m.problem,
                    m.sensor,         std::int64_t(std::llround(1e6 * m.t)),
                    m.parts[i].first, number_[fold.held_out[k]]};
        part.time_block = detail::time_block(m, options_);
        if (!std::isfinite(part.log_density))
          throw NumericalError("the prediction of a held-out measurement is not finite");
      }
    }
  }

  std::span<Problem* const> problems_;
  const std::vector<ScoredMeasurement>& measurements_;
  const ScoreOptions& options_;
  std::vector<int> number_;
  std::vector<std::unique_ptr<Reused>> reused_;  // by problem
  std::vector<detail::SavedValues> solved_;
};

void check(std::span<Problem* const> problems, const std::vector<ScoredMeasurement>& measurements,
           const ScoreOptions& options) {
  if (!(options.block_length > 0)) throw BadInputError("predictive_score: block_length must be positive");
  if (options.folds < 2 || options.every < 1)
    throw BadInputError("predictive_score: at least two folds are needed, and `every` must be positive");
  for (const ScoredMeasurement& m : measurements) {
    const int rows = static_cast<int>(detail::problem_at(problems, m.problem).noise(m.block).dim());
    for (const ScoredRows& part : m.parts)
      if (part.first < 0 || part.count < 1 || part.count > kMaxRows || part.first + part.count > rows)
        throw BadInputError("predictive_score: a part has rows that its block does not have, or more than six");
  }
}

/// Returns the standard error of the sum of values in independent groups.
double error_of_sum(const std::map<std::pair<int, std::int64_t>, double>& groups) {
  std::vector<double> sums;
  for (const auto& [group, sum] : groups) sums.push_back(sum);
  return detail::standard_error_of_sum(sums);
}

std::pair<int, std::int64_t> group_of(const ScoredPart& part) { return {std::get<1>(part.key), part.time_block}; }

}  // namespace

double PredictiveScore::total() const {
  return std::accumulate(parts.begin(), parts.end(), 0.0,
                         [](double sum, const ScoredPart& part) { return sum + part.log_density; });
}

std::array<Coverage, kCoverageLevels.size()> PredictiveScore::coverage() const {
  std::array<Coverage, kCoverageLevels.size()> all;
  for (std::size_t level = 0; level < all.size() && !parts.empty(); ++level) {
    const auto inside = [&](const ScoredPart& part) {
      return part.squared_distance <= kQuantiles[std::size_t(part.rows) - 1][level];
    };
    Coverage& coverage = all[level];
    coverage.share = double(std::count_if(parts.begin(), parts.end(), inside)) / double(parts.size());
    std::map<std::pair<int, std::int64_t>, double> excess;
    for (const ScoredPart& part : parts) excess[group_of(part)] += double(inside(part)) - coverage.share;
    coverage.standard_error = error_of_sum(excess) / double(parts.size());
  }
  return all;
}

PredictiveScore predictive_score(std::span<Problem* const> problems, const std::vector<ScoredMeasurement>& measurements,
                                 const ScoreOptions& options) {
  check(problems, measurements, options);
  PredictiveScore score;
  std::set<int> kinds;
  FoldPredictor predictor(problems, measurements, options);
  try {
    score.why = predictor.solve();
    if (!score.valid()) return score;
    predictor.keep_solution(score);
    const std::vector<detail::Fold> folds = detail::folds_of(measurements, options);
    for (const detail::Fold& fold : folds) kinds.insert(std::get<0>(fold.key));
    for (std::size_t f = 0; f < folds.size() && score.valid(); f += std::size_t(options.every)) {
      options.stop.check(detail::kHeldOutTask);
      predictor.predict(folds[f], score);
    }
  } catch (const Stopped&) {
    throw;
  } catch (const NumericalError& error) {
    score.why = error.what();
  }
  if (!score.valid()) score.parts.clear();
  // Averages over the kinds of prediction.
  for (ScoredPart& part : score.parts) part.log_density /= double(kinds.size());
  std::sort(score.parts.begin(), score.parts.end(),
            [](const ScoredPart& a, const ScoredPart& b) { return a.key < b.key; });
  return score;
}

PredictiveScore completed(PredictiveScore score, const PredictiveScore& reference) {
  std::vector<ScoredPart> parts;
  auto own = score.parts.begin();
  for (const ScoredPart& part : reference.parts) {
    while (own != score.parts.end() && own->key < part.key) ++own;
    parts.push_back(own != score.parts.end() && own->key == part.key ? *own : part);
  }
  score.parts = std::move(parts);
  return score;
}

ScoreGain score_gain(const PredictiveScore& a, const PredictiveScore& b) {
  constexpr const char* kDifferent =
      "score_gain: the scores have different measurements; complete both by the same reference (completed())";
  if (a.parts.size() != b.parts.size()) throw BadInputError(kDifferent);
  std::map<std::pair<int, std::int64_t>, double> gains;
  for (std::size_t i = 0; i < a.parts.size(); ++i) {
    if (a.parts[i].key != b.parts[i].key) throw BadInputError(kDifferent);
    gains[group_of(a.parts[i])] += b.parts[i].log_density - a.parts[i].log_density;
  }
  ScoreGain gain;
  for (const auto& [group, sum] : gains) gain.gain += sum;
  gain.standard_error = error_of_sum(gains);
  gain.blocks = static_cast<int>(gains.size());
  return gain;
}

double score_block_length(double correlation_time, std::vector<double> times) {
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  if (times.size() < std::size_t(kMinBlocks)) return 0;
  const double gap = detail::longest_step(times), span = times.back() - times.front(),
               least = 2 * detail::median_step(times);
  if (!(span >= kMinBlocks * least)) return 0;
  return std::max(least, std::min(std::max(3 * correlation_time, gap), span / kBlocks));
}

double detail::robust_log_density(double squared_distance, double log_determinant, int rows) {
  constexpr double nu = kDegreesOfFreedom;
  const double scale = kScale[std::size_t(rows) - 1];
  return kLogGamma[std::size_t(rows) - 1] - 0.5 * rows * std::log(nu * std::numbers::pi * scale) -
         0.5 * log_determinant - 0.5 * (nu + rows) * std::log1p(squared_distance / (nu * scale));
}

}  // namespace tandem
