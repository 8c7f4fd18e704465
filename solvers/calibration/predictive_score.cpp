#include <algorithm>
#include <cmath>
#include <map>
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
#include <tandem/solvers/marginals.hpp>

namespace tandem {
namespace {

constexpr int kMaxRows = 6;
constexpr int kMinBlocks = 5, kBlocks = 8;  // blocks of time in a recording: minimum, and preferred minimum
constexpr std::size_t kOrigins = 6;         // number of origins of predictions ahead
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

constexpr double kShortGap = 0.25;  // length of short gaps, relative to that of the blocks

enum Kind { gap, short_gap, sensor, ahead, nothing };

const FoldKey kNothingHeldOut = {nothing, 0, 0};

/// Measurements that are held out at once, by index.
struct Fold {
  FoldKey key;
  std::vector<std::size_t> held_out{};
  std::vector<double> weight{};  // 0: held out but not scored; empty: all 1
};

std::int64_t time_block(const ScoredMeasurement& m, const ScoreOptions& options, double share = 1) {
  return std::int64_t(std::floor(m.t / (share * options.block_length)));
}

void add_folds(const std::vector<ScoredMeasurement>& all, const ScoreOptions& options, Kind kind, int sensor,
               std::vector<Fold>& folds) {
  // If one sensor is held out, the others remain. A larger share of it can therefore be held out at once.
  const std::int64_t n = kind == Kind::sensor ? std::max(2, options.folds / 2) : options.folds;
  std::vector<Fold> group;
  for (int g = 0; g < n; ++g) group.push_back({{kind, sensor, g}});
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (kind == Kind::sensor && all[i].sensor != sensor) continue;
    const std::int64_t rest = time_block(all[i], options, kind == short_gap ? kShortGap : 1) % n;
    group[std::size_t(rest < 0 ? rest + n : rest)].held_out.push_back(i);
  }
  for (Fold& fold : group)
    if (!fold.held_out.empty()) folds.push_back(std::move(fold));
}

/// Adds folds for predictions ahead. Each fold has an origin in time and holds out all later measurements. The origins
/// divide the time span of each recording into equal parts. A measurement that several origins predict has a smaller
/// weight.
void add_predictions_ahead(const std::vector<ScoredMeasurement>& all, const ScoreOptions& options,
                           std::vector<Fold>& folds) {
  std::map<int, std::pair<double, double>> spans;  // by problem
  for (const ScoredMeasurement& m : all) {
    auto& [from, to] = spans.emplace(m.problem, std::pair(m.t, m.t)).first->second;
    from = std::min(from, m.t);
    to = std::max(to, m.t);
  }
  const std::size_t first = folds.size();
  std::vector<double> predictions(all.size());  // number of origins that predict each measurement
  for (std::size_t k = 1; k <= kOrigins; ++k) {
    Fold fold{{ahead, 0, static_cast<int>(k)}};
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto& [from, to] = spans.at(all[i].problem);
      const double origin = from + (to - from) * double(k) / double(kOrigins + 1);
      if (!(all[i].t > origin)) continue;
      fold.held_out.push_back(i);
      fold.weight.push_back(all[i].t <= origin + options.ahead ? 1 : 0);
      predictions[i] += fold.weight.back();
    }
    if (!fold.held_out.empty()) folds.push_back(std::move(fold));
  }
  for (Fold& fold : std::span(folds).subspan(first))
    for (std::size_t k = 0; k < fold.weight.size(); ++k)
      if (fold.weight[k] > 0) fold.weight[k] /= predictions[fold.held_out[k]];
}

std::vector<Fold> folds_of(const std::vector<ScoredMeasurement>& all, const ScoreOptions& options) {
  std::vector<Fold> folds;
  add_folds(all, options, gap, 0, folds);
  add_folds(all, options, short_gap, 0, folds);
  std::set<int> sensors;
  for (const ScoredMeasurement& m : all) sensors.insert(m.sensor);
  if (options.by_sensor && sensors.size() > 1)
    for (const int s : sensors) add_folds(all, options, Kind::sensor, s, folds);
  if (options.ahead > 0) add_predictions_ahead(all, options, folds);
  return folds;
}

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
    solve_options_.stop = options.stop;
    // If other models start from this solution, it needs more iterations. Otherwise they would gain only by continuing
    // the solve.
    const int iterations = !options.start ? 200 : options.every > 1 ? 30 : 50;
    solve_options_.solve = [stop = options.stop, iterations](Problem& problem) {
      return detail::solve_approximately(problem, stop, iterations);
    };
  }

  /// Returns why a solve failed, or an empty string.
  std::string solve() const {
    const auto failed = detail::solve_all(problems_, solve_options_);
    return failed ? failed->message : "";
  }

  void keep_solution(PredictiveScore& score) {
    solved_ = values();
    score.solutions.emplace(kNothingHeldOut, solved_);
  }
  void restore_solution() const { set_values(solved_); }

  /// Predicts a fold from the other measurements. Sets the reason in `score` if that fails.
  void predict(const Fold& fold, PredictiveScore& score) const {
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
    for (Problem* problem : problems_) sum += NlpEvaluator(*problem).cost();
    return sum;
  } catch (const UndefinedResidualError&) {
    return HUGE_VAL;
  }

  /// Starts where the cost is lowest: at the solution of all measurements, at the solution of this fold by a similar
  /// model, or at the solution of all measurements moved as that of the similar model.
  void choose_start(const Fold& fold) const {
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
    const std::vector<detail::SavedValues>& before = options_.start->at(kNothingHeldOut);
    for (std::size_t p = 0; p < problems_.size(); ++p) similar->second[p].move(before[p], *problems_[p]);
    const std::vector<detail::SavedValues> moved = values();
    restore_solution();  // values that the similar model does not have
    consider(similar->second);
    consider(moved);
    set_values(*best);
  }

  void add_parts(const Fold& fold, const std::vector<Gaussian>& noise, std::vector<ScoredPart>& parts) const {
    std::vector<std::optional<Marginals>> marginals(problems_.size());
    for (std::size_t k = 0; k < fold.held_out.size(); ++k) {
      const ScoredMeasurement& m = measurements_[fold.held_out[k]];
      const double weight = fold.weight.empty() ? 1 : fold.weight[k];
      if (m.parts.empty() || weight == 0) continue;
      Problem& problem = *problems_[std::size_t(m.problem)];
      auto& marginal = marginals[std::size_t(m.problem)];
      if (!marginal) {
        marginal.emplace(problem, std::span<const Marginals::Pair>(), options_.stop);
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
        part.time_block = time_block(m, options_);
        if (!std::isfinite(part.log_density))
          throw NumericalError("the prediction of a held-out measurement is not finite");
      }
    }
  }

  std::span<Problem* const> problems_;
  const std::vector<ScoredMeasurement>& measurements_;
  const ScoreOptions& options_;
  std::vector<int> number_;
  CalibrationOptions solve_options_;
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
    const std::vector<Fold> folds = folds_of(measurements, options);
    for (const Fold& fold : folds) kinds.insert(std::get<0>(fold.key));
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
