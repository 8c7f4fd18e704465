#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include <tandem/studies/study/nees.hpp>
#include <tandem/studies/study/study_tables.hpp>

namespace tandem {
namespace {

constexpr double kSameCost = 1e-6;

/// An NEES with its degrees of freedom in space and in the plane.
struct NeesMetric {
  const char* metric;
  int in_space, in_plane;
};
constexpr NeesMetric kNeesMetrics[] = {{"nees_chaser", 6, 3},        {"nees_target", 6, 3},
                                       {"nees_relative_pose", 6, 3}, {"nees_relative_position", 3, 2},
                                       {"nees_velocity", 3, 3},      {"nees_bias", 6, 6}};

std::size_t cell_of(const Study& study, const TrialPlace& place) {
  std::size_t cell = 0;
  for (std::size_t a = 0; a < study.axes.size(); ++a) cell = cell * study.axes[a].values.size() + place.values[a];
  return cell;
}

/// Returns a key that identifies the problem of a trial: everything except its initial guess and solver.
std::string problem_key(const Study& study, const TrialPlace& place) {
  std::string text = fmt::format("{} {}", place.replicate, place.model);
  for (std::size_t a = 0; a < study.axes.size(); ++a)
    if (!is_initial_guess_parameter(study.axes[a].parameter)) text += fmt::format(" {}", place.values[a]);
  return text;
}

std::vector<StudyGroup> groups_of(const Study& study, const std::vector<TrialResult>& results) {
  std::vector<StudyGroup> groups(study.cells() * study.models.size() * study.solvers.size());
  std::map<std::string, double> best;
  for (const TrialResult& result : results)
    if (const auto cost = result.get("cost"); cost && result.converged()) {
      const auto [entry, first] = best.emplace(problem_key(study, study.place(result.trial)), *cost);
      if (!first) entry->second = std::min(entry->second, *cost);
    }
  for (std::size_t i = 0; i < groups.size(); ++i) {  // the trials of the first replicate cover each group once
    const TrialPlace place = study.place(i);
    StudyGroup& group = groups[i];
    const TrialSettings settings = study.settings(place);
    group = {cell_of(study, place),
             place.model,
             place.solver,
             study.cell_text(place),
             study.models[place.model],
             study.solvers[place.solver],
             settings.docking.planar,
             trial_sensors(settings, study.simulation)};
    group.results.assign(study.seeds, nullptr);
  }
  for (const TrialResult& result : results) {
    const TrialPlace place = study.place(result.trial);
    StudyGroup& group = groups[result.trial % groups.size()];
    ++group.trials;
    if (!result.converged()) continue;
    ++group.converged;
    group.results[place.replicate] = &result;
    if (const auto cost = result.get("cost")) {
      const double least = best.at(problem_key(study, place));
      group.reached_best += *cost <= least + kSameCost * std::max(1.0, std::abs(least));
    }
  }
  return groups;
}

std::vector<double> samples(const StudyGroup& group, std::size_t metric) {
  std::vector<double> values;
  for (const TrialResult* result : group.results)
    if (result && result->metrics[metric]) values.push_back(*result->metrics[metric]);
  return values;
}

/// Returns the ratio of the mean of b to the mean of a over the replicates that have both metrics.
std::optional<Interval> paired(const StudyGroup& a, std::size_t metric_a, const StudyGroup& b, std::size_t metric_b) {
  std::vector<double> of_a, of_b;
  for (std::size_t r = 0; r < a.results.size(); ++r) {
    if (!a.results[r] || !b.results[r]) continue;
    const auto x = a.results[r]->metrics[metric_a], y = b.results[r]->metrics[metric_b];
    if (!x || !y) continue;
    of_a.push_back(*x);
    of_b.push_back(*y);
  }
  return ratio_interval(of_a, of_b);
}

void add_pairs(const StudyTables& tables, const StudyGroup& group, std::vector<StudyPair>& pairs) {
  const auto add = [&](const std::string& base, const StudyGroup& of, std::string_view base_metric,
                       const std::string& metric) {
    if (const auto ratio = paired(of, metric_index(base_metric), group, metric_index(metric)))
      pairs.push_back({&group, base, metric, *ratio});
  };
  for (const char* metric : {"at_position_error_m", "at_pose_error_m", "at_pose_orientation_deg"})
    add("raw", group, fmt::format("raw_{}", metric), metric);
  if (group.model == 0) return;
  for (const StudyGroup& first : tables.groups)
    if (first.cell == group.cell && first.solver == group.solver && first.model == 0)
      for (const char* metric : {"at_position_error_m", "at_pose_error_m", "at_partial_error_m", "at_none_error_m",
                                 "at_all_error_m", "at_position_orientation_deg", "at_pose_orientation_deg",
                                 "at_partial_orientation_deg", "at_none_orientation_deg", "gap_position_m",
                                 "after_gap_position_m", "chaser_position_m", "chaser_orientation_deg"})
        add(first.model_text, first, metric, metric);
}

std::string verdict(const Interval& mean, double low, double high, double factor) {
  if (mean.value > high) return fmt::format("optimistic by a factor {:.2f}", factor);
  if (mean.value < low) return fmt::format("pessimistic by a factor {:.2f}", 1 / factor);
  return "consistent";
}

void add_consistency_of(const StudyGroup& group, std::vector<StudyConsistency>& rows) {
  const auto add = [&](const std::string& metric, int degrees) {
    const auto mean = mean_interval(samples(group, metric_index(metric)));
    if (!mean || !(mean->value > 0)) return;  // possible in a file from another source
    const auto [low, high] = chi_squared_band(degrees, static_cast<int>(mean->n));
    const double factor = std::sqrt(mean->value / degrees);
    rows.push_back({&group, metric, degrees, *mean, low, high, factor, verdict(*mean, low, high, factor)});
  };
  for (const NeesMetric& nees : kNeesMetrics) add(nees.metric, group.planar ? nees.in_plane : nees.in_space);
  for (const TrialSensor& sensor : group.sensors) add(nis_metric(sensor.name), sensor.rows);
}

std::optional<Interval> interval_of(const TrialMetric& metric, const std::vector<double>& values) {
  if (!metric.share) return mean_interval(values);
  return share_interval(static_cast<std::size_t>(std::count(values.begin(), values.end(), 1.0)), values.size());
}

}  // namespace

std::string_view rank_metric(const Study& study) {
  if (study.settings(study.place(0)).rendezvous) return "dock_miss_m";
  return study.has_target() ? "at_all_error_m" : "chaser_position_m";
}

StudyTables study_tables(const Study& study, const std::vector<TrialResult>& results) {
  StudyTables tables;
  tables.all = study.trials();
  tables.trials = results.size();
  tables.groups = groups_of(study, results);
  for (const StudyAxis& axis : study.axes) tables.disturbs_initial_guess |= is_initial_guess_parameter(axis.parameter);
  for (const StudyGroup& group : tables.groups) {
    for (std::size_t m = 0; m < trial_metrics().size(); ++m)
      if (const auto mean = interval_of(trial_metrics()[m], samples(group, m)))
        (trial_metrics()[m].timing ? tables.times : tables.means).push_back({&group, trial_metrics()[m].name, *mean});
    add_pairs(tables, group, tables.pairs);
    add_consistency_of(group, tables.consistency);
  }
  return tables;
}

}  // namespace tandem
