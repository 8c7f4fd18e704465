#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/studies/estimation/spread_text.hpp>
#include <tandem/studies/live/track_report.hpp>
#include <tandem/studies/navigation/found_constants_json.hpp>
#include <tandem/studies/support/json_text.hpp>
#include <tandem/studies/support/squared_distance.hpp>
#include <tandem/studies/support/text.hpp>
#include <tandem/studies/support/text_table.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array kRows = {"usbl", "optical", "gated", "all"};

UpdateTimes times_of(std::vector<double> seconds) {
  if (seconds.empty()) return {};
  std::sort(seconds.begin(), seconds.end());
  const auto at = [&](double share) {
    return 1e3 * seconds[std::min(seconds.size() - 1, std::size_t(share * double(seconds.size())))];
  };
  return {at(0.5), at(0.99), 1e3 * seconds.back()};
}

std::string model_line(const Track& track, const LiveOptions& options) {
  const TrackingOptions& o = options.online.tracking;
  std::string text = track.by_odometry ? "" : "chaser by its own sensors";
  if (track.has_target)
    text += fmt::format("{}{}{}, mode {}", text.empty() ? "" : ", target ",
                        options.online.hypotheses ? "newest by motion hypotheses, past by " : "", name(o.model),
                        name(o.mode));
  const FixedLagOptions& lag = options.online.lag;
  if (std::isfinite(lag.window)) text += fmt::format(", window {:g} s", lag.window);
  if (lag.max_keyframes > 0) text += fmt::format(", at most {} keyframes", lag.max_keyframes);
  return text;
}

/// Normalised by what its covariance holds to be likely; nothing where that is none (the height of what is planar left
/// out).
std::optional<double> nees_of(const Vector<3>& e, const std::optional<Matrix<3, 3>>& covariance) {
  if (!covariance) return {};
  const bool planar = (*covariance)(2, 2) == 0;
  const double nees =
      planar ? squared_distance(e.head<2>(), covariance->topLeftCorner<2, 2>()) : squared_distance(e, *covariance);
  return std::isfinite(nees) ? std::optional(nees) : std::nullopt;
}

/// Errors by keyframe type, in constant memory.
struct Sums {
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
    return {n, position.n(), position.spread(), orientation.spread(), raw_position.spread(), raw_orientation.spread()};
  }
};

std::string health_table(const TrackHealth& health) {
  using Align = TextTable::Align;
  TextTable table({{"sensor", Align::left}, {"used"}, {"rejected"}, {"last used [s]"}});
  for (const SensorHealth& s : health.sensors)
    table.row({printable(s.name), fmt::format("{}", s.used), fmt::format("{}", s.rejected),
               s.last_used ? fmt::format("{:.1f}", *s.last_used) : "–"});
  std::string text = "\n" + table.str();
  if (health.resets + health.suspensions > 0)
    text += fmt::format("the track has begun anew {} times, and was suspended {} times\n", health.resets,
                        health.suspensions);
  return text;
}
std::string mean_shown(const std::optional<MeanStd>& of) { return of ? fmt::format("{:.2f}", of->mean) : "–"; }

std::string error_tables(const Track& track, const TrackSummary& summary) {
  std::string text;
  if (!summary.truth) return "\nThere is no truth to compare with.\n";
  using Align = TextTable::Align;
  if (track.has_target) {
    TextTable table(
        {{"newest state", Align::left}, {"n"}, {"position [m]"}, {"NEES"}, {"orientation [°]"}, {"raw position [m]"}});
    for (std::size_t i = 0; i < kRows.size(); ++i) {
      const ErrorSummary& e = summary.errors[i];
      const bool comparable = e.raw_position && e.raw_position->n == e.compared;
      table.row({kRows[i], fmt::format("{}", e.n), spread_shown(e.position, 3), mean_shown(summary.nees[i]),
                 spread_shown(e.orientation, 2), comparable ? spread_shown(e.raw_position, 3) : "–"});
    }
    text += "\n" + table.str();
    if (!summary.ahead.empty()) {
      TextTable ahead({{"prediction", Align::left}, {"n"}, {"position [m]"}, {"NEES"}});
      for (const AheadErrors& e : summary.ahead)
        ahead.row({fmt::format("{:g} s ahead", e.seconds), fmt::format("{}", e.position ? e.position->n : 0),
                   spread_shown(e.position, 3), mean_shown(e.nees)});
      text += "\n" + ahead.str();
    }
  }
  if (summary.chaser_position)
    text += fmt::format("\nchaser, newest state: position {} m, orientation {}°\n",
                        spread_shown(summary.chaser_position, 3), spread_shown(summary.chaser_orientation, 2));
  return text;
}

}  // namespace

TrackError track_error(const Scenario& scenario, const TrackRecord& record, const LiveOptions& options) {
  TrackError error{{record.t, record.type, {}, {}, {}, {}}, {}, {}, {}, {}, {}};
  if (record.target) {
    const Keyframe keyframe{record.t, record.type, record.measured, record.measured_rotation};
    error.relative = keyframe_errors(scenario, {keyframe}, {record.chaser}, {*record.target}).front();
    if (const auto& e = error.relative.position_vector) error.nees = nees_of(*e, record.covariance);
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
    nees = nees_of(e, record.ahead[i]->covariance);
  }
  if (!truth) return error;
  error.chaser_position = (record.chaser.translation() - truth->translation()).norm();
  if (scenario.truth_orientation)
    error.chaser_orientation = (truth->rotation().inverse() * record.chaser.rotation()).Log().norm() * kDegrees;
  return error;
}

TrackSummary summarise(const Track& track, const Scenario& scenario, const LiveOptions& options) {
  TrackSummary summary;
  summary.scenario = scenario.name;
  summary.frame = scenario.frame.name();
  summary.model = model_line(track, options);
  summary.truth = track.has_target && track.by_odometry ? scenario.has_truth() : !scenario.truth_chaser.empty();
  std::vector<double> wall, processor;
  std::array<Sums, 4> sums;
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
      for (Sums* of : {&sums[r.type == KeyframeType::usbl ? 0 : r.type == KeyframeType::optical ? 1 : 2], &sums[3]}) {
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
    summary.nees[i] = sums[i].nees.spread();
  }
  if (track.has_target)
    for (std::size_t i = 0; i < ahead.size(); ++i)
      summary.ahead.push_back({options.ahead[i], ahead_nees[i].spread(), ahead[i].spread()});
  if (!track.by_odometry) {
    summary.chaser_position = position.spread();
    summary.chaser_orientation = orientation.spread();
  }
  return summary;
}

std::string track_report(const Track& track, const TrackSummary& s) {
  using Align = TextTable::Align;
  std::string text = fmt::format("{}, {}{}\n", s.scenario, s.model, track.interrupted ? ": interrupted" : "");
  text += fmt::format("{} lines over {:.1f} s of data in {:.2f} s; {} updates, {} of them with a new keyframe\n",
                      track.lines, track.last - track.first, track.seconds, s.updates, s.keyframes);
  if (track.not_converged > 0)
    text += fmt::format("{} updates ended before they had converged; more --max-iterations may help\n",
                        track.not_converged);
  TextTable times({{"update [ms]", Align::left}, {"median"}, {"99 %"}, {"longest"}});
  for (const auto& [what, t] : {std::pair{"wall clock", s.wall}, {"processor", s.processor}})
    times.row({what, fmt::format("{:.2f}", t.median), fmt::format("{:.2f}", t.p99), fmt::format("{:.2f}", t.most)});
  text += "\n" + times.str();
  if (s.memory_early && s.memory_end)
    text += fmt::format("resident memory: {:.1f} MB after a tenth of the run, {:.1f} MB at its end\n", *s.memory_early,
                        *s.memory_end);
  text += health_table(track.health);
  if (!track.refused.counts().empty()) {
    TextTable refused({{"refused", Align::left}, {"lines"}, {"why", Align::left}});
    for (const auto& [what, n] : track.refused.counts()) refused.row({what.first, fmt::format("{}", n), what.second});
    text += "\n" + refused.str();
  }
  if (!track.errors.empty()) text += "\n" + constants_text(track.errors);
  if (std::any_of(track.errors.begin(), track.errors.end(), [](const FoundConstant& c) {
        return c.name.ends_with(".delay") && c.verdict() == ConstantVerdict::found;
      }))
    text +=
        "Online a delay's ± is of the cost linearised, several times too small where a target's fixes hardly tell it: "
        "tandem\nestimate, with the same --error, tells it by the evidence.\n";
  return text + error_tables(track, s);
}

std::string track_json(const Track& track, const TrackSummary& s) {
  Json json = {{"scenario", s.scenario},   {"frame", s.frame},
               {"model", s.model},         {"interrupted", track.interrupted},
               {"lines", track.lines},     {"data_seconds", track.last - track.first},
               {"seconds", track.seconds}, {"updates", s.updates},
               {"keyframes", s.keyframes}, {"not_converged", track.not_converged}};
  for (const auto& [what, t] : {std::pair{"update_wall_ms", s.wall}, {"update_processor_ms", s.processor}})
    json[what] = {{"p50", t.median}, {"p99", t.p99}, {"max", t.most}};
  if (s.memory_early) json["memory_mb"] = {{"at_10_percent", *s.memory_early}, {"at_end", *s.memory_end}};
  json["resets"] = track.health.resets;
  json["suspensions"] = track.health.suspensions;
  json["sensors"] = Json::array();
  for (const SensorHealth& sensor : track.health.sensors) {
    json["sensors"].push_back({{"sensor", sensor.name}, {"used", sensor.used}, {"rejected", sensor.rejected}});
    if (sensor.last_used) json["sensors"].back()["last_used"] = *sensor.last_used;
  }
  if (track.bad) json["bad"] = {{"since", track.bad->since}, {"until", track.bad->until}};
  add_staying_errors(json, track.errors);
  json["refused"] = Json::array();
  for (const auto& [what, n] : track.refused.counts())
    json["refused"].push_back({{"sensor", what.first}, {"why", what.second}, {"lines", n}});
  if (!s.truth) return json_text(json);
  if (track.has_target)
    for (std::size_t i = 0; i < kRows.size(); ++i) {
      json["errors"][kRows[i]] = errors_json(s.errors[i]);
      if (s.nees[i]) json["errors"][kRows[i]]["position_nees_mean"] = s.nees[i]->mean;
    }
  for (const AheadErrors& e : s.ahead) {
    Json entry = {{"seconds_ahead", e.seconds}, {"n", e.position ? e.position->n : 0}};
    add_spread(entry, "position", "m", e.position);
    if (e.nees) entry["position_nees_mean"] = e.nees->mean;
    json["predictions"].push_back(entry);
  }
  if (s.chaser_position) {
    json["chaser"] = {{"n", s.chaser_position->n}};
    add_spread(json["chaser"], "position", "m", s.chaser_position);
    add_spread(json["chaser"], "orientation", "deg", s.chaser_orientation);
  }
  return json_text(json);
}

}  // namespace tandem
