#include <algorithm>
#include <chrono>
#include <optional>
#include <set>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/solvers/calibration/default_solve.hpp>
#include <tandem/studies/calibration/scored_measurements.hpp>
#include <tandem/studies/support/text.hpp>
#include <tandem/studies/tuning/contradicting_measurements.hpp>
#include <tandem/studies/tuning/proposed_changes.hpp>
#include <tandem/studies/tuning/tune.hpp>

namespace tandem {
namespace {

/// Returns the names by which a setting is known: for "error usbl.delay" also error, usbl, usbl.delay and delay.
std::set<std::string> names_of(const std::string& setting) {
  std::set<std::string> names = {setting};
  for (const std::string_view word : split(setting, ' ')) {
    names.emplace(word);
    for (const std::string_view part : split(word, '.')) names.emplace(part);
  }
  return names;
}

bool is_named(const ModelChange& change, const std::vector<std::string>& names) {
  return std::any_of(change.settings.begin(), change.settings.end(), [&](const auto& setting) {
    const std::set<std::string> own = names_of(setting.first);
    return std::any_of(names.begin(), names.end(), [&](const std::string& name) { return own.contains(name); });
  });
}

bool has_outliers(const std::vector<Misfit>& residuals) {
  constexpr double kLargeRms = 2;
  return std::any_of(residuals.begin(), residuals.end(),
                     [](const Misfit& m) { return m.down_weighted > 0 || (!m.value.empty() && m.rms() > kLargeRms); });
}

/// Returns the first sensor with a tenth less measurements in `found` than in `before`, or an empty string.
std::string sensor_with_less_data(const NavigationData& before, const NavigationData& found) {
  const auto fewer = [](std::size_t now, std::size_t once) { return double(now) < 0.9 * double(once); };
  if (before.imu && found.imu && fewer(found.imu->samples.size(), before.imu->samples.size())) return found.imu->name;
  for (const EgoSensor& sensor : found.sensors)
    for (const EgoSensor& other : before.sensors)
      if (other.name == sensor.name && fewer(sensor.measurements.size(), other.measurements.size())) return sensor.name;
  return "";
}

/// The problems of all recordings with the same settings.
struct Recordings {
  CalibrationProblems problems;
  std::vector<TunedProblem> with_options;
};

class Tuner {
 public:
  Tuner(const std::vector<Scenario>& scenarios, const TuneOptions& options)
      : scenarios_(scenarios), options_(options) {}

  Tuning run() {
    const auto begin = std::chrono::steady_clock::now();
    Tuning result;
    for (const Scenario& scenario : scenarios_) result.scenarios.push_back(scenario.name);
    result.given = result.start = options_.start;
    std::vector<ModelStep> needed;
    Recordings first = solved_start(result.start, needed);
    check_same_sensors(first);
    for (const auto& problem : first.problems) navigations_.push_back(problem->navigation);
    result.before = all_misfits(first);
    result.block_length = held_out_block_length(first.problems, options_.stop);
    if (!(result.block_length > 0))
      throw Error(
          fmt::format("{} is too short to hold out blocks of time; record for longer, or choose the model "
                      "yourself",
                      result.scenarios.front()));
    result.ahead = options_.ahead > 0 ? options_.ahead : held_out_time_ahead(first.problems, result.block_length);
    result.candidates =
        proposed_changes(first.with_options.front().scenario, first.with_options.front().target, result.before);
    check_names(result.candidates, first);
    select(result.candidates);
    if (options_.dry_run) {
      result.selection.settings = result.start;
    } else {
      result.selection = search(result);
      result.selection.steps.insert(result.selection.steps.begin(), needed.begin(), needed.end());
      Recordings found = solved(result.selection.settings, Stop());
      result.after = all_misfits(found);
      for (const CalibratedEntry& entry : found.problems.front()->entries)
        if (!entry.name.ends_with(".error") && std::ranges::min(entry.sigmas) > 0)  // zero: the model does not use it
          result.noise.push_back({entry.name, entry.sigmas});
    }
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return result;
  }

 private:
  Recordings built(const ModelSettings& settings, const Stop& stop) const {
    Recordings all;
    for (const Scenario& scenario : scenarios_) {
      TunedProblem one = options_.apply(scenario, settings);
      NavigationOptions own = one.own;
      stop.limit(own.solver);
      const EgoTrack* const similar = navigations_.empty() ? nullptr : navigations_[all.problems.size()].get();
      all.problems.push_back(
          std::make_unique<CalibrationProblem>(one.scenario, one.target, own, stop.with_grace(), similar));
      all.with_options.push_back(std::move(one));
    }
    return all;
  }

  Recordings solved(const ModelSettings& settings, const Stop& stop) const {
    Recordings all = built(settings, stop);
    for (const auto& problem : all.problems) {
      const Summary summary = detail::solve_with_default(problem->problem(), stop);
      stop.check("tune");
      if (summary.status != Status::converged && summary.status != Status::max_iterations)
        throw Error(fmt::format("{} cannot be solved: {}", problem->scenario, summary.message));
    }
    return all;
  }

  /// Returns nothing, and why, if the recordings cannot be solved with these settings.
  std::optional<Recordings> solved_if_possible(const ModelSettings& settings, std::string& why) const try {
    return solved(settings, options_.stop);
  } catch (const Stopped&) {
    throw;
  } catch (const Error& error) {
    why = error.what();
    return std::nullopt;
  }

  /// Solves the recordings with the settings of the start. Adds robust losses to them, and the step to `steps`, if
  /// measurements contradict the others, or if the recordings cannot be solved without. Held-out predictions do not
  /// show this need: a measurement that is wrong by far moves the states near it, whose measurements are held out
  /// together with it.
  Recordings solved_start(ModelSettings& start, std::vector<ModelStep>& steps) const {
    const ModelChange robust{{{"robust", "true"}}, "", 1};
    const bool allowed = !start.contains("robust") && !is_named(robust, options_.fixed) &&
                         (options_.only.empty() || is_named(robust, options_.only)) &&
                         !scenarios_.front().data.sensors.empty();
    if (!allowed) return solved(start, options_.stop);
    const ModelSettings with_losses = changed(start, robust);
    std::string why;
    std::optional<Recordings> all = solved_if_possible(with_losses, why);  // the user's options may exclude losses
    int count = 0;
    if (all)
      for (const auto& problem : all->problems) count += count_contradicting_measurements(*problem);
    if (count > 0) {
      why = fmt::format("measurements that contradict the others: {}", count);
    } else if (std::optional<Recordings> without = solved_if_possible(start, why)) {
      return std::move(*without);
    }
    start = with_losses;
    steps.push_back({robust, {}, ModelVerdict::needed, why});
    return all ? std::move(*all) : solved(start, options_.stop);
  }

  /// Returns why commands cannot use a model: from its own initial guess, it is not solved, or not with the same data.
  /// Empty if they can.
  std::string why_unusable(const ModelSettings& settings) const try {
    for (std::size_t i = 0; i < scenarios_.size(); ++i) {
      TunedProblem one = options_.apply(scenarios_[i], settings);
      options_.stop.limit(one.own.solver);
      one.own.covariance = false;
      Summary summary;
      if (scenarios_[i].data.sensors.empty()) {
        const Navigation found = navigate(one.scenario.navigation.value(), one.own);
        summary = found.summary;
        if (const std::string sensor = sensor_with_less_data(navigations_[i]->data, found.data); !sensor.empty())
          return fmt::format("{}: navigation from the initial guess rejects measurements of {}", scenarios_[i].name,
                             sensor);
      } else {
        CalibrationProblem problem(one.scenario, one.target, one.own, options_.stop);
        summary = detail::solve_with_default(problem.problem(), options_.stop);
      }
      options_.stop.check("tune");
      if (!summary.converged())
        return fmt::format("{} cannot be solved from the initial guess: {}", scenarios_[i].name, summary.message);
    }
    return "";
  } catch (const Stopped&) {
    throw;
  } catch (const Error& error) {
    return error.what();
  }

  std::vector<Misfit> all_misfits(const Recordings& recordings) const {
    std::vector<Misfit> all;
    for (const auto& problem : recordings.problems)
      for (Misfit& m : misfits(*problem)) all.push_back(std::move(m));
    return all;
  }

  void check_same_sensors(const Recordings& all) const {
    const auto sensors = [](const CalibrationProblem& problem) {
      std::vector<std::string> names;
      for (const CalibratedEntry& entry : problem.entries)
        if (entry.sensor) names.push_back(entry.name);
      return names;
    };
    const CalibrationProblem& first = *all.problems.front();
    for (const auto& other : all.problems)
      if (sensors(*other) != sensors(first))
        throw Error(fmt::format(
            "{} and {} have different sensors ({}; {}); tune recordings of different systems "
            "separately",
            first.scenario, other->scenario, listed(sensors(first), "and"), listed(sensors(*other), "and")));
  }

  void check_names(const std::vector<ModelChange>& candidates, const Recordings& first) const {
    std::set<std::string> known;
    const auto add = [&](const std::vector<ModelChange>& changes) {
      for (const ModelChange& change : changes)
        for (const auto& [setting, value] : change.settings) known.merge(names_of(setting));
    };
    add(candidates);
    const TunedProblem& one = first.with_options.front();
    add(refined_changes(one.scenario, one.target, options_.start));
    for (const auto& [option, names] : {std::pair{"--only", &options_.only}, {"--fixed", &options_.fixed}})
      for (const std::string& name : *names)
        if (!known.contains(name))
          throw Error(fmt::format("{} {}: no option or sensor of this name can change{}", option, quote(name),
                                  did_you_mean(name, {known.begin(), known.end()})));
    for (const std::string& name : options_.only)
      if (std::find(options_.fixed.begin(), options_.fixed.end(), name) != options_.fixed.end())
        throw Error(fmt::format("{} is in --only and in --fixed; remove one of them", quote(name)));
  }

  /// Removes the changes that --only and --fixed exclude.
  void select(std::vector<ModelChange>& changes) const {
    std::erase_if(changes, [&](const ModelChange& change) {
      return (!options_.only.empty() && !is_named(change, options_.only)) || is_named(change, options_.fixed);
    });
  }

  ModelSelection search(const Tuning& tuning) const {
    const BuildModel build = [&](const ModelSettings& settings) {
      const auto all = std::make_shared<Recordings>(built(settings, options_.stop));
      BuiltModel model;
      for (const auto& problem : all->problems) model.problems.emplace_back(all, &problem->problem());
      model.measurements = scored_measurements(all->problems);
      return model;
    };
    ModelSelectionOptions options;
    options.start = tuning.start;
    options.stop = options_.stop;
    options.score.block_length = tuning.block_length;
    options.score.ahead = tuning.ahead;
    options.propose = [&](const ModelSettings& current) {
      const TunedProblem one = options_.apply(scenarios_.front(), current);
      std::vector<ModelChange> changes = refined_changes(one.scenario, one.target, current);
      // The noise of data with outliers means little until the losses handle them.
      if (current == tuning.start && !current.contains("robust") && has_outliers(tuning.before))
        std::erase_if(changes,
                      [](const ModelChange& change) { return change.settings.begin()->first.starts_with("noise "); });
      select(changes);
      return changes;
    };
    options.allowed =
        [this, stated = options_.apply(scenarios_.front(), tuning.start).scenario](const ModelSettings& settings) {
          try {
            return keeps_stated_noise(stated, options_.apply(scenarios_.front(), settings).scenario);
          } catch (const Error&) {
            return true;  // select_model() reports why the model cannot be built
          }
        };
    options.why_unusable = [this](const ModelSettings& settings) { return why_unusable(settings); };
    if (options_.progress)
      options.progress = [&](int models, double gain) {
        options_.progress(fmt::format("{} models, gain {:+.1f}", models, gain));
      };
    return select_model(build, tuning.candidates, options);
  }

  const std::vector<Scenario>& scenarios_;
  const TuneOptions& options_;
  std::vector<std::shared_ptr<const EgoTrack>> navigations_;  // by the first model; null if by odometry
};

}  // namespace

Tuning tune(const std::vector<Scenario>& scenarios, const TuneOptions& options) {
  if (scenarios.empty()) throw Error("tune: no scenario is given");
  return Tuner(scenarios, options).run();
}

}  // namespace tandem
