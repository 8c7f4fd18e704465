#include <algorithm>

#include <fmt/format.h>

#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/problem/quantile.hpp>
#include <tandem/studies/estimation/error_columns.hpp>
#include <tandem/studies/estimation/mean_std_text.hpp>
#include <tandem/studies/fit/fit_text.hpp>
#include <tandem/studies/navigation/systematic_error_estimates.hpp>
#include <tandem/studies/online/track_report.hpp>
#include <tandem/studies/support/text.hpp>
#include <tandem/studies/support/text_table.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

/// Returns the name of element i of TrackSummary::errors.
std::string keyframes_name(std::size_t i) {
  return i == TrackSummary::all ? "all" : std::string(name(keyframe_types[i]));
}

UpdateTimes times_of(const std::vector<double>& seconds) {
  if (seconds.empty()) return {};
  const auto at = [&](double share) { return 1e3 * detail::quantile(seconds, share); };
  return {at(0.5), at(0.99), at(1)};
}

std::string model_line(const Track& track, const TrackOptions& options) {
  const TrackingOptions& o = options.online.tracking;
  std::string text = track.by_odometry ? "" : "chaser from its own sensors";
  if (track.has_target)
    text += fmt::format("{}{}{}, mode {}", text.empty() ? "" : ", target ",
                        options.online.hypotheses ? "newest state by motion hypotheses, window by " : "", name(o.model),
                        name(o.mode));
  const FixedLagOptions& lag = options.online.lag;
  if (std::isfinite(lag.window)) text += fmt::format(", window {:g} s", lag.window);
  if (lag.max_keyframes > 0) text += fmt::format(", at most {} keyframes", lag.max_keyframes);
  return text;
}

/// Running means and standard deviations of the errors at one type of keyframe.
struct ErrorMoments {
  int n = 0;
  Moments position, orientation, raw_position, raw_orientation, nees;
  void add(const KeyframeError& e) {
    ++n;
    position.add(e.position);
    orientation.add(e.orientation);
    raw_position.add(e.raw_position);
    raw_orientation.add(e.raw_orientation);
  }
  ErrorSummary summary() const {
    return {n,
            position.n(),
            position.mean_std(),
            orientation.mean_std(),
            raw_position.mean_std(),
            raw_orientation.mean_std()};
  }
};

std::string health_table(const Track& track) {
  const TrackHealth& health = track.health;
  using Align = TextTable::Align;
  TextTable table({{"sensor", Align::left}, {"NIS per row"}, {"last used [s]"}});
  for (const SensorHealth& s : health.sensors)
    table.row({printable(s.name), s.nis_rows > 0 ? fmt::format("{:.2f}", s.nis / double(s.nis_rows)) : "–",
               s.last_used ? fmt::format("{:.1f}", *s.last_used) : "–"});
  std::string text = "\n" + table.str() + "The NIS per row is 1 if the noise is as stated.\n\n";
  text += fit_text(track_fit(health, track.components));
  if (health.resets + health.suspensions > 0)
    text += fmt::format("resets of the track: {}, suspensions: {}\n", health.resets, health.suspensions);
  return text;
}

std::string error_tables(const Track& track, const TrackSummary& summary) {
  std::string text;
  if (!summary.truth) return "\n" + summary.missing_truth + "\n";
  using Align = TextTable::Align;
  if (track.has_target) {
    TextTable table(
        {{"measurement", Align::left}, {"n"}, {"position [m]"}, {"NEES"}, {"orientation [°]"}, {"raw position [m]"}});
    for (std::size_t i = 0; i < summary.errors.size(); ++i) {
      const ErrorSummary& e = summary.errors[i];
      if (e.n == 0) continue;
      const bool comparable = e.raw_position && e.raw_position->n == e.compared;
      table.row({keyframes_name(i), fmt::format("{}", e.n), mean_std_text(e.position, 3), mean_text(summary.nees[i], 2),
                 mean_std_text(e.orientation, 2), comparable ? mean_std_text(e.raw_position, 3) : "–"});
    }
    text += "\nErrors of the newest state by the measurement at the keyframe\n" + table.str();
    if (!summary.ahead.empty()) {
      TextTable ahead({{"prediction", Align::left}, {"n"}, {"position [m]"}, {"NEES"}});
      for (const AheadErrors& e : summary.ahead)
        ahead.row({fmt::format("{:g} s ahead", e.seconds), fmt::format("{}", e.position ? e.position->n : 0),
                   mean_std_text(e.position, 3), mean_text(e.nees, 2)});
      text += "\n" + ahead.str();
    }
  }
  if (summary.chaser_position)
    text += fmt::format("\nerrors of the chaser's newest state: position {} m, orientation {}°\n",
                        mean_std_text(summary.chaser_position, 3), mean_std_text(summary.chaser_orientation, 2));
  return text;
}

}  // namespace

FitReport track_fit(const TrackHealth& health, const std::vector<std::vector<std::string>>& components) {
  FitReport report;
  for (std::size_t i = 0; i < health.sensors.size(); ++i) {
    const SensorHealth& s = health.sensors[i];
    SensorFit& fit = report.sensors.emplace_back();
    fit.name = s.name;
    fit.used = int(s.used);
    fit.rejected = int(s.rejected);
    fit.down_weighted = int(s.down_weighted);
    fit.expected_down_weighted = s.expected_down_weighted;
    if (i < components.size()) {
      fit.components = components[i];
      fit.components.resize(s.innovations.size());  // the gate tests only the position of a pose
      fit.moments = s.innovations;
      fit.worst = s.worst;
    }
    if (s.nis_rows > 0) fit.innovation_rms = std::sqrt(s.nis / double(s.nis_rows));
    report.cost += 0.5 * s.nis;
    report.expected_cost += 0.5 * double(s.nis_rows);
  }
  report.cost_sigma = std::sqrt(report.expected_cost);  // the variance of ½ χ² equals its mean
  return report;
}

TrackError track_error(const Scenario& scenario, const TrackRecord& record, const TrackOptions& options) {
  TrackError error{{record.t, record.type, {}, {}, {}, {}}, {}, {}, {}, {}, {}};
  if (record.target) {
    const Keyframe keyframe{record.t, record.type, record.measured, record.measured_rotation};
    error.relative = keyframe_errors(scenario, {keyframe}, {record.chaser}, {*record.target}).front();
    if (const auto& e = error.relative.position_vector) error.nees = relative_nees(*e, record.covariance);
  }
  const auto truth = pose_at(scenario.truth_chaser, record.t);
  for (std::size_t i = 0; i < record.ahead.size(); ++i) {
    auto& ahead = error.ahead.emplace_back();
    auto& nees = error.ahead_nees.emplace_back();
    const auto later = pose_at(scenario.truth_target, record.t + options.ahead[i]);
    if (!truth || !later || !record.ahead[i]) continue;
    const SO3& axes = scenario.truth_orientation ? truth->rotation() : record.chaser.rotation();
    const Vector<3> e = record.ahead[i]->position - axes.inverse().act(later->translation() - truth->translation());
    ahead = e.norm();
    nees = relative_nees(e, record.ahead[i]->covariance);
  }
  if (!truth) return error;
  error.chaser_position = (record.chaser.translation() - truth->translation()).norm();
  if (scenario.truth_orientation)
    error.chaser_orientation = (truth->rotation().inverse() * record.chaser.rotation()).Log().norm() * kDegrees;
  return error;
}

TrackSummary summarise(const Track& track, const Scenario& scenario, const TrackOptions& options) {
  TrackSummary summary;
  summary.scenario = scenario.name;
  summary.frame = scenario.frame.name();
  summary.model = model_line(track, options);
  summary.truth = track.has_target && track.by_odometry ? scenario.has_truth() : !scenario.truth_chaser.empty();
  summary.missing_truth = missing_truth(scenario, summary.truth);
  std::vector<double> wall, processor;
  std::array<ErrorMoments, TrackSummary::all + 1> sums;
  std::vector<Moments> ahead(options.ahead.size()), ahead_nees(options.ahead.size());
  Moments position, orientation;
  const double early = track.first + 0.1 * (track.last - track.first);
  track.records.each([&](const TrackRecord& r) {
    wall.push_back(r.seconds);
    processor.push_back(r.processor_seconds);
    if (r.memory && r.t >= early && !summary.memory_early) summary.memory_early = r.memory;
    if (r.memory) summary.memory_end = r.memory;
    if (!r.new_keyframe) return;
    ++summary.keyframes;
    const TrackError error = track_error(scenario, r, options);
    if (r.target) {
      for (ErrorMoments* of : {&sums[std::size_t(r.type)], &sums[TrackSummary::all]}) {
        of->add(error.relative);
        of->nees.add(error.nees);
      }
    }
    for (std::size_t i = 0; i < ahead.size(); ++i) {
      ahead[i].add(error.ahead[i]);
      ahead_nees[i].add(error.ahead_nees[i]);
    }
    position.add(error.chaser_position);
    orientation.add(error.chaser_orientation);
  });
  summary.updates = track.records.size();
  summary.wall = times_of(std::move(wall));
  summary.processor = times_of(std::move(processor));
  for (std::size_t i = 0; i < sums.size(); ++i) {
    summary.errors[i] = sums[i].summary();
    summary.nees[i] = sums[i].nees.mean_std();
  }
  if (track.has_target)
    for (std::size_t i = 0; i < ahead.size(); ++i)
      summary.ahead.push_back({options.ahead[i], ahead_nees[i].mean_std(), ahead[i].mean_std()});
  if (!track.by_odometry) {
    summary.chaser_position = position.mean_std();
    summary.chaser_orientation = orientation.mean_std();
  }
  return summary;
}

std::string track_report(const Track& track, const TrackSummary& s) {
  using Align = TextTable::Align;
  std::string text = fmt::format("{}, {}{}\n", s.scenario, s.model, track.interrupted ? ": interrupted" : "");
  text += fmt::format("{} lines over {:.1f} s of data in {:.2f} s; {} updates, {} of them with a new keyframe\n",
                      track.lines, track.last - track.first, track.seconds, s.updates, s.keyframes);
  if (track.not_converged > 0)
    text += fmt::format("{} updates did not converge; a larger --max-iterations may help\n", track.not_converged);
  TextTable times({{"update [ms]", Align::left}, {"median"}, {"99 %"}, {"longest"}});
  for (const auto& [what, t] : {std::pair{"wall clock", s.wall}, {"processor", s.processor}})
    times.row({what, fmt::format("{:.2f}", t.median), fmt::format("{:.2f}", t.p99), fmt::format("{:.2f}", t.max)});
  text += "\n" + times.str();
  if (s.memory_early && s.memory_end)
    text += fmt::format("resident memory: {:.1f} MB after 10 % of the run, {:.1f} MB at its end\n", *s.memory_early,
                        *s.memory_end);
  text += health_table(track);
  if (!track.rejected_lines.counts().empty()) {
    TextTable rejected({{"rejected", Align::left}, {"lines"}, {"reason", Align::left}});
    for (const auto& [what, n] : track.rejected_lines.counts())
      rejected.row({what.first, fmt::format("{}", n), what.second});
    text += "\n" + rejected.str();
  }
  if (!track.errors.empty()) text += "\n" + systematic_errors_text(track.errors);
  if (std::any_of(track.errors.begin(), track.errors.end(), [](const SystematicErrorEstimate& c) {
        return c.name.ends_with(".delay") && c.verdict() == SystematicErrorVerdict::identifiable;
      }))
    text +=
        "Online, the standard deviation of a delay comes from the linearised cost and may be several times too small. "
        "tandem\nestimate with the same --error computes it from the evidence.\n";
  return text + error_tables(track, s);
}

}  // namespace tandem
