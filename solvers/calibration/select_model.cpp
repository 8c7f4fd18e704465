#include <algorithm>
#include <cmath>
#include <set>

#include <tandem/problem/parallel_tasks.hpp>
#include <tandem/solvers/calibration/default_solve.hpp>
#include <tandem/solvers/calibration/select_model.hpp>

namespace tandem {
namespace {

constexpr int kMaxSearchRounds = 8;
constexpr int kScreening = 3;          // candidates are screened by every third group of blocks
constexpr std::size_t kFinalists = 8;  // candidates in each round that are scored by all measurements
constexpr int kStartIterations = 50;   // to choose between two starts
constexpr std::size_t kAtOnce = 3;     // finalists that are scored at the same time; the best acceptable one is kept

/// Returns the score of a model that cannot be built or solved.
PredictiveScore impossible(const std::string& why) {
  PredictiveScore score;
  score.why = why.empty() ? "the model cannot be built" : why;
  return score;
}

class GreedySearch {
 public:
  GreedySearch(const BuildModel& build, const ModelSelectionOptions& options) : build_(build), options_(options) {
    options_.score.stop = options.stop;
  }

  ModelSelection run(std::vector<ModelChange> candidates) {
    found_.settings = options_.start;
    // The first model is scored even if the time is short: without it, there is nothing to return.
    const auto [score, problems] = scored(options_.start);
    if (!score.valid()) throw NumericalError("the model to start from cannot be validated: " + score.why);
    found_.start = found_.found = score;
    solved_ = problems;
    try {
      for (int round = 0; round < kMaxSearchRounds; ++round) {
        const bool kept = forward(with_proposals(candidates));
        const bool removed = backward();
        if (!kept && !removed) break;
        keep_promising(candidates);
      }
    } catch (const Stopped&) {
      found_.cut_short = true;
    }
    found_.gain = score_gain(found_.start, found_.found);
    return std::move(found_);
  }

 private:
  struct Scored {
    PredictiveScore score;
    std::vector<std::shared_ptr<Problem>> problems;
  };
  struct Evaluated {
    ModelChange change;
    Scored result;
    ScoreGain gain{};
    bool valid() const { return result.score.valid(); }
  };

  /// Scores a model by every n-th group of blocks; measurements of the others count as in the current model.
  Scored scored(const ModelSettings& settings, int every = 1) const {
    if (every > 1) {
      Scored quick = scored_from(settings, every, true);
      if (quick.score.valid() || quick.problems.empty()) return quick;  // empty: it cannot be built
    }
    return scored_from(settings, every, false);
  }

  /// Does the same with the current solution as the start (`warm`), or with the better one of two starts.
  Scored scored_from(const ModelSettings& settings, int every, bool warm) const try {
    BuiltModel built = build_(settings);
    std::vector<Problem*> raw;
    for (std::size_t p = 0; p < built.problems.size(); ++p) {
      raw.push_back(built.problems[p].get());
      if (p >= solved_.size()) continue;
      if (warm)
        detail::copy_values(*solved_[p], *raw[p]);
      else
        start_at_better_minimum(*solved_[p], *raw[p]);
    }
    ScoreOptions options = options_.score;
    options.every = every;
    if (!found_.found.solutions.empty()) options.start = &found_.found.solutions;
    PredictiveScore score = predictive_score(raw, built.measurements, options);
    if (score.valid() && !found_.start.parts.empty())
      score = completed(std::move(score), every > 1 ? found_.found : found_.start);
    return {std::move(score), std::move(built.problems)};
  } catch (const Stopped&) {
    throw;
  } catch (const Error& error) {
    return {impossible(error.what()), {}};
  }

  /// Solves a problem from its initial guess and from the solution of a similar one, and keeps the lower cost.
  void start_at_better_minimum(const Problem& similar, Problem& problem) const {
    Problem warm = problem.copy();
    detail::copy_values(similar, warm);
    const Summary from_similar = detail::ApproximateSolver(warm).solve(options_.stop, kStartIterations);
    const Summary from_guess = detail::ApproximateSolver(problem).solve(options_.stop, kStartIterations);
    options_.stop.check("select_model");
    if (std::isfinite(from_similar.cost) && !(from_guess.cost <= from_similar.cost)) detail::copy_values(warm, problem);
  }

  bool is_allowed(const ModelChange& change) const {
    return !options_.allowed || options_.allowed(changed(found_.settings, change));
  }

  /// Scores changes of the current model at the same time.
  std::vector<Evaluated> evaluate(const std::vector<ModelChange>& changes, int every = 1) {
    std::vector<Evaluated> all;
    for (std::size_t first = 0; first < changes.size(); first += detail::kMaxTasks) {
      const int count = static_cast<int>(std::min(changes.size() - first, std::size_t(detail::kMaxTasks)));
      std::vector<Evaluated> some(static_cast<std::size_t>(count));
      tasks_.run(count, [&](int task) {
        some[std::size_t(task)] = {changes[first + std::size_t(task)],
                                   scored(changed(found_.settings, changes[first + std::size_t(task)]), every)};
      });
      for (Evaluated& one : some) {
        if (one.valid()) one.gain = score_gain(found_.found, one.result.score);
        ++found_.models;
        all.push_back(std::move(one));
      }
      if (options_.progress) options_.progress(found_.models, score_gain(found_.start, found_.found).gain);
    }
    return all;
  }

  ModelVerdict verdict(const Evaluated& one) const {
    if (!one.valid()) return ModelVerdict::impossible;
    if (!(one.gain.gain > std::max(one.gain.standard_error, one.change.parameters))) return ModelVerdict::not_better;
    constexpr std::size_t k95 = 1;
    const Coverage before = found_.found.coverage()[k95], after = one.result.score.coverage()[k95];
    const double allowed = 2 * std::hypot(before.standard_error, after.standard_error);
    const bool worse = after.share < before.share - allowed && after.share < kCoverageLevels[k95] - allowed;
    return worse ? ModelVerdict::inconsistent : ModelVerdict::kept;
  }

  /// Returns whether the model after a change can be used. If not, makes the result invalid with the reason.
  bool is_usable(Evaluated& one) const {
    if (!options_.why_unusable) return true;
    one.result.score.why = options_.why_unusable(changed(found_.settings, one.change));
    return one.valid();
  }

  void record(const Evaluated& one, ModelVerdict verdict) {
    const bool rejected = verdict != ModelVerdict::kept && verdict != ModelVerdict::removed;
    if (rejected && !recorded_.insert(one.change.settings).second) return;
    found_.steps.push_back({one.change, one.gain, verdict, one.result.score.why});
  }

  void keep(Evaluated one) {
    found_.settings = changed(std::move(found_.settings), one.change);
    found_.found = std::move(one.result.score);
    solved_ = std::move(one.result.problems);
  }

  std::vector<ModelChange> with_proposals(const std::vector<ModelChange>& candidates) const {
    std::vector<ModelChange> all;
    std::set<ModelSettings> seen = {found_.settings};
    const auto add = [&](const std::vector<ModelChange>& changes) {
      for (const ModelChange& change : changes)
        if (seen.insert(changed(found_.settings, change)).second && is_allowed(change)) all.push_back(change);
    };
    add(candidates);
    if (options_.propose) add(options_.propose(found_.settings));
    return all;
  }

  static bool by_gain(const Evaluated& a, const Evaluated& b) {
    return a.valid() != b.valid() ? a.valid() : a.valid() && a.gain.gain > b.gain.gain;
  }

  /// Screens the candidates by a part of the measurements. Then scores the best ones by all measurements, a few
  /// at a time and each on top of those kept before. Keeps the best of them. Returns whether one was kept.
  bool forward(const std::vector<ModelChange>& candidates) {
    std::vector<Evaluated> screened = evaluate(candidates, kScreening);
    std::stable_sort(screened.begin(), screened.end(), by_gain);
    promising_.clear();
    std::vector<ModelChange> best;
    for (const Evaluated& one : screened) {
      const bool promising = one.valid() && one.gain.gain > 0;
      if (promising) promising_.insert(one.change.settings);
      if (promising && best.size() < kFinalists) best.push_back(one.change);
      if (!promising) record(one, one.valid() ? ModelVerdict::not_better : ModelVerdict::impossible);
    }
    bool kept = false;
    std::set<std::string> changed_settings;
    const auto is_open = [&](const ModelChange& change) {  // not decided in this round, and allowed
      return is_allowed(change) && std::none_of(change.settings.begin(), change.settings.end(),
                                                [&](const auto& s) { return changed_settings.contains(s.first); });
    };
    for (std::size_t first = 0; first < best.size();) {
      std::vector<ModelChange> some;  // scored at the same time
      for (; first < best.size() && some.size() < kAtOnce; ++first)
        if (is_open(best[first])) some.push_back(best[first]);
      std::vector<Evaluated> all = evaluate(some);
      std::stable_sort(all.begin(), all.end(), by_gain);
      for (std::size_t i = 0; i < all.size(); ++i) {
        ModelVerdict found = verdict(all[i]);
        if (found == ModelVerdict::kept && !is_usable(all[i])) found = ModelVerdict::impossible;
        record(all[i], found);
        if (found != ModelVerdict::kept) continue;
        for (std::size_t j = all.size(); j-- > i + 1;)
          best[--first] = all[j].change;  // scored again on top of this one
        for (const auto& [setting, value] : all[i].change.settings) changed_settings.insert(setting);
        keep(std::move(all[i]));
        kept = true;
        break;
      }
    }
    return kept;
  }

  /// Removes changes without which the model is no worse. Returns whether one was removed.
  bool backward() {
    bool removed = false;
    for (;;) {
      std::vector<ModelChange> removals;
      for (const auto& [setting, value] : found_.settings) {
        const auto at = options_.start.find(setting);
        const std::string before = at == options_.start.end() ? "" : at->second;
        const ModelChange removal{{{setting, before}}, "", 0};
        if (before != value && is_allowed(removal)) removals.push_back(removal);
      }
      if (removals.empty() || found_.settings.size() < options_.start.size() + 2) return removed;
      std::vector<Evaluated> screened = evaluate(removals, kScreening);
      const auto best = std::max_element(screened.begin(), screened.end(), [](const Evaluated& a, const Evaluated& b) {
        return a.valid() != b.valid() ? b.valid() : a.valid() && a.gain.gain < b.gain.gain;
      });
      // A parameter costs one, as for the candidates.
      const auto is_worse = [](const Evaluated& one) {
        return !one.valid() || -one.gain.gain > std::min(one.gain.standard_error, 1.0);
      };
      if (is_worse(*best)) return removed;
      Evaluated full = std::move(evaluate({best->change}).front());
      if (is_worse(full) || !is_usable(full)) return removed;
      record(full, ModelVerdict::removed);
      keep(std::move(full));
      removed = true;
    }
  }

  /// Removes candidates that did not gain.
  void keep_promising(std::vector<ModelChange>& candidates) const {
    std::erase_if(candidates, [&](const ModelChange& change) { return !promising_.contains(change.settings); });
  }

  const BuildModel& build_;
  ModelSelectionOptions options_;
  ModelSelection found_;
  std::vector<std::shared_ptr<Problem>> solved_;  // problems solved with the current model
  std::set<ModelSettings> promising_, recorded_;
  detail::TaskRunner tasks_;
};

}  // namespace

std::string_view name(ModelVerdict verdict) {
  switch (verdict) {
    case ModelVerdict::kept:
      return "kept";
    case ModelVerdict::not_better:
      return "not better";
    case ModelVerdict::inconsistent:
      return "inconsistent";
    case ModelVerdict::impossible:
      return "impossible";
    case ModelVerdict::needed:
      return "needed";
    case ModelVerdict::removed:
      return "removed";
  }
  return "";
}

ModelSettings changed(ModelSettings settings, const ModelChange& change) {
  for (const auto& [setting, value] : change.settings) {
    if (value.empty())
      settings.erase(setting);
    else
      settings[setting] = value;
  }
  return settings;
}

ModelSelection select_model(const BuildModel& build, const std::vector<ModelChange>& candidates,
                            const ModelSelectionOptions& options) {
  return GreedySearch(build, options).run(candidates);
}

}  // namespace tandem
