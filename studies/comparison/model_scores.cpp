#include <memory>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/default_solve.hpp>
#include <tandem/studies/calibration/scored_measurements.hpp>
#include <tandem/studies/comparison/model_scores.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Scores models one after the other.
class ModelScores {
 public:
  ModelScores(const Scenario& scenario, const Stop& stop) : scenario_(scenario), stop_(stop) {}

  void score(const TrackingOptions& options, ModelResult& result) try {
    CalibrationProblems problems;
    problems.push_back(std::make_unique<CalibrationProblem>(scenario_, options, NavigationOptions{}, stop_));
    Problem* const raw[] = {&problems.front()->problem()};
    if (!(options_.block_length > 0)) {
      detail::solve_with_default(*raw[0], stop_);
      options_.block_length = held_out_block_length(problems, stop_);
      if (!(options_.block_length > 0)) throw Error("the recording is too short to hold out blocks of time");
    }
    options_.stop = stop_;
    PredictiveScore score = predictive_score(raw, scored_measurements(problems), options_);
    result.why_no_score = score.why;
    if (!score.valid()) return;
    if (!reference_) reference_ = score;
    result.score = completed(std::move(score), *reference_);
  } catch (const Stopped&) {
    throw;
  } catch (const Error& error) {
    result.why_no_score = error.what();
  }

 private:
  const Scenario& scenario_;
  const Stop& stop_;
  ScoreOptions options_;
  std::optional<PredictiveScore> reference_;
};

}  // namespace

void score_models(const Scenario& scenario, const std::vector<NamedModel>& models, std::vector<ModelResult>& results,
                  const Stop& stop, const std::function<void(std::size_t model)>& progress) {
  ModelScores scores(scenario, stop);
  try {
    for (std::size_t i = 0; i < results.size(); ++i) {
      if (!results[i].solved) continue;
      if (progress) progress(i);
      scores.score(models[i].options, results[i]);
    }
  } catch (const Stopped&) {  // the models so far have scores
  }
}

std::optional<std::size_t> best_score(const std::vector<ModelResult>& results) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < results.size(); ++i)
    if (results[i].score && (!best || results[i].score->total() > results[*best].score->total())) best = i;
  return best;
}

std::string recommendation(const std::vector<ModelResult>& results) {
  const auto best = best_score(results);
  if (!best) return "";
  std::vector<std::string> as_good;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (i == *best || !results[i].score) continue;
    const ScoreGain loss = score_gain(*results[i].score, *results[*best].score);
    if (loss.gain <= loss.standard_error) as_good.push_back(results[i].name);
  }
  const Coverage inside = results[*best].score->coverage()[1];
  return fmt::format(
      "Recommended: {}. It predicts held-out measurements best{}; {:.0f} ± {:.0f} % of them are inside of "
      "their 95 % intervals.",
      results[*best].name,
      as_good.empty() ? "" : fmt::format("; no worse by a standard error: {}", listed(as_good, "and")),
      100 * inside.share, 200 * inside.standard_error);
}

}  // namespace tandem
