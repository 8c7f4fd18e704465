#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/estimation/estimate_report.hpp>
#include <tandem/studies/estimation/spread_text.hpp>
#include <tandem/studies/navigation/found_constants_json.hpp>
#include <tandem/studies/support/json_text.hpp>
#include <tandem/studies/support/squared_distance.hpp>

namespace tandem {
namespace {

using Json = nlohmann::ordered_json;

struct Row {
  std::string name;
  ErrorSummary errors;
};

std::vector<Row> rows(const Estimate& estimate) {
  std::vector<Row> result;
  for (const KeyframeType type : {KeyframeType::usbl, KeyframeType::optical, KeyframeType::gated})
    result.push_back({std::string(name(type)), summarise(estimate.errors, type)});
  result.push_back({"all", summarise(estimate.errors)});
  return result;
}

std::string mean_shown(const std::optional<MeanStd>& spread, int decimals) {
  return spread ? fmt::format("{:.{}f}", spread->mean, decimals) : "–";
}

std::string_view name(Role role) {
  if (role == Role::off) return "off";
  return role == Role::soft ? "soft" : "hard";
}

/// "constant-twist, mode A, robust, hard surge": the model and what is not as by default.
std::string model_line(const Estimate& estimate) {
  const TrackingOptions& options = estimate.options;
  std::string text = fmt::format("{}, mode {}", name(options.model), name(options.mode));
  if (std::any_of(estimate.sensors.begin(), estimate.sensors.end(), [](const auto& sensor) { return sensor.robust; }))
    text += ", robust";
  if (options.roll_pitch != Role::soft) text += fmt::format(", roll-pitch {}", name(options.roll_pitch));
  if (options.non_holonomic != Role::off) text += fmt::format(", non-holonomic {}", name(options.non_holonomic));
  if (options.surge) text += fmt::format(", surge {}", name(options.limits));
  if (options.max_yaw_rate) text += fmt::format(", yaw rate {}", name(options.limits));
  return text;
}

/// Nothing to tell of it beyond the keyframes' table.
bool plain(const SensorOutcome& sensor) {
  return ((sensor.name == "usbl" && sensor.type == SensorType::position) ||
          (sensor.name == "optical" && sensor.type == SensorType::pose)) &&
         !sensor.robust && sensor.delay == 0 && sensor.held_out == 0;
}

/// Of the chaser's own sensors, where it moves by these.
std::string ego_lines(const Estimate& estimate) {
  if (estimate.ego_sensors.empty() && estimate.findings.empty()) return "";
  std::vector<std::string> used;
  for (const EgoSensorUse& s : estimate.ego_sensors)
    used.push_back(s.left_out > 0 ? fmt::format("{} {} ({} left out)", s.name, s.used, s.left_out)
                                  : fmt::format("{} {}", s.name, s.used));
  std::string text = fmt::format("\nThe chaser by its own sensors, together with the target; measurements used: {}.\n",
                                 used.empty() ? "of the imu alone" : fmt::format("{}", fmt::join(used, ", ")));
  for (const NavigationFinding& finding : estimate.findings) text += finding.text() + ".\n";
  if (estimate.dvl_scale) text += fmt::format("The DVL reads {:.4f} times the velocity.\n", 1 + *estimate.dvl_scale);
  if (!estimate.splits.empty())
    text +=
        fmt::format("The inertial chain is split: no samples tie {} of the intervals between {:.3f} and {:.3f} s.\n",
                    estimate.splits.size(), estimate.splits.front().first, estimate.splits.back().second);
  return text;
}

std::string sensor_table(const Estimate& estimate) {
  if (std::all_of(estimate.sensors.begin(), estimate.sensors.end(), plain)) return "";
  const auto line = [](const auto&... cells) {
    return fmt::format("{:<10} {:<14} {:>6} {:>9} {:>9} {:>14}   {:>17}\n", cells...);
  };
  std::string text =
      "\n" + line("sensors", "type", "used", "held out", "left out", "down-weighted", "raw position [m]");
  for (const SensorOutcome& s : estimate.sensors)
    text +=
        line(s.name, name(s.type), s.used, s.held_out, s.left_out, s.down_weighted, spread_shown(s.raw_position, 3));
  if (!estimate.without_extrinsics.empty())
    text += fmt::format("{}: no extrinsics given, taken at the body's origin.\n",
                        fmt::join(estimate.without_extrinsics, ", "));
  return text;
}

/// How many of the held-out inliers the predictions' 95 % intervals cover.
struct Coverage {
  std::string name;
  int n = 0, inliers = 0;
  int rows = 0, rows_inside = 0;  ///< of the inliers
  int inside = 0;                 ///< inliers with all rows together in their 95 % region
  bool judged = true;             ///< else all count as inliers

  void add(const Validation& v) {
    ++n;
    judged &= v.inlier.has_value();
    if (!v.inlier.value_or(true)) return;
    ++inliers;
    rows += static_cast<int>(v.prediction.r.size());
    rows_inside += v.prediction.rows_inside();
    inside += v.prediction.inside();
  }
};

/// By sensor, and of all when there are several.
std::vector<Coverage> coverages(const Estimate& estimate) {
  std::vector<Coverage> result;
  Coverage all{"all"};
  for (std::size_t i = 0; i < estimate.sensors.size(); ++i) {
    Coverage of_sensor{estimate.sensors[i].name};
    for (const Validation& v : estimate.held_out)
      if (v.prediction.sensor == i) of_sensor.add(v);
    if (of_sensor.n > 0) result.push_back(of_sensor);
  }
  for (const Validation& v : estimate.held_out) all.add(v);
  if (result.size() > 1) result.push_back(all);
  return result;
}

std::string coverage_table(const Estimate& estimate) {
  if (estimate.held_out.empty()) return "";
  const auto line = [](const auto&... cells) {
    return fmt::format("{:<10} {:>6} {:>9}   {:>17}   {:>21}\n", cells...);
  };
  const auto percent = [](int part, int whole) {
    return whole > 0 ? fmt::format("{:.1f} %", 100.0 * part / whole) : "–";
  };
  std::string text = "\n" + line("held out", "n", "inliers", "rows in their 95%", "all rows in their 95%");
  bool judged = true, robust = false;
  for (const Coverage& c : coverages(estimate)) {
    text += line(c.name, c.n, c.inliers, percent(c.rows_inside, c.rows), percent(c.inside, c.inliers));
    judged &= c.judged;
  }
  for (const SensorOutcome& sensor : estimate.sensors) robust |= sensor.robust;
  if (!judged)
    text += "The same estimate with all measurements in did not converge, so that none could be told an outlier.\n";
  else if (robust)
    text += fmt::format("Inliers have a weight of {} or more in the same estimate with all measurements in.\n",
                        kDownWeighted);
  return text;
}

Json sensors_json(const Estimate& estimate) {
  Json json;
  for (const SensorOutcome& s : estimate.sensors) {
    Json& entry = json[s.name];
    entry = {{"type", name(s.type)},
             {"used", s.used},
             {"held_out", s.held_out},
             {"left_out", s.left_out},
             {"down_weighted", s.down_weighted}};
    add_spread(entry, "raw_position", "m", s.raw_position);
  }
  return json;
}

Json coverage_json(const Estimate& estimate) {
  Json json;
  for (const Coverage& c : coverages(estimate)) {
    Json& entry = json[c.name] = {{"n", c.n}, {"inliers_told", c.judged}, {"inliers", c.inliers}};
    if (c.inliers == 0) continue;
    entry["inlier_rows_in_95_percent"] = 100.0 * c.rows_inside / c.rows;
    entry["inliers_in_95_percent"] = 100.0 * c.inside / c.inliers;
  }
  return json;
}

/// Mean NEES of the relative position over the keyframes with a truth, 3 where covariances are right, when it is so large
/// that they are not.
std::optional<double> overconfident_nees(const Estimate& estimate) {
  constexpr double kFarTooLarge = 3 * 9;  // errors of three times their sigmas, on average over a whole run
  Moments nees;
  for (std::size_t k = 0; k < estimate.uncertainty.size(); ++k)
    if (const auto& error = estimate.errors[k].position_vector)
      nees.add(squared_distance(*error, estimate.uncertainty[k].relative_position));
  const auto spread = nees.spread();
  return spread && spread->mean > kFarTooLarge ? std::optional(spread->mean) : std::nullopt;
}

/// What a user should know before believing the estimate.
std::string doubts(const Estimate& estimate) {
  constexpr std::size_t kMost = 3;
  const auto& suspects = estimate.suspects;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, suspects.size()); ++i) text += suspects[i].text() + ".\n";
  if (suspects.size() > kMost) text += fmt::format("… and {} more.\n", suspects.size() - kMost);
  if (!suspects.empty() && !estimate.options.robust_start) text += "Outliers? --robust holds them off.\n";
  if (!estimate.contradiction.empty()) text += estimate.contradiction + "\n";
  if (const auto nees = overconfident_nees(estimate))
    text += fmt::format(
        "OVERCONFIDENT: errors are far larger than the covariances say (NEES of the relative position "
        "{:.1f}, 3 where they are right): is the noise of scenario.yaml too small?\n",
        *nees);
  return text.empty() ? text : "\n" + text;
}

}  // namespace

std::string report(const Estimate& estimate) {
  const Summary& summary = estimate.summary;
  std::string text = fmt::format("{}, {}: {} keyframes, {} residual blocks", estimate.scenario, model_line(estimate),
                                 estimate.keyframes.size(), estimate.residual_blocks);
  if (estimate.hard_blocks > 0) text += fmt::format(", {} hard constraints", estimate.hard_blocks);
  constexpr double kWide = 1e12;  // more digits than say anything
  text += fmt::format(
      "\n{}: {}, cost {} (from {:.6g}), {} iterations, {} evaluations, {:.3f} s\n", summary.solver,
      name(summary.status),
      std::abs(summary.cost) < kWide ? fmt::format("{:.6f}", summary.cost) : fmt::format("{:.6g}", summary.cost),
      summary.initial_cost, summary.iterations, summary.evaluations, summary.seconds);
  if (estimate.hard_blocks > 0)
    text += fmt::format("largest violation of a hard constraint: {:.2g}\n", summary.max_violation);
  if (!summary.converged()) text += fmt::format("NOT CONVERGED: {}\n", summary.message);

  const auto line = [](const auto&... cells) {
    return fmt::format("{:<10} {:>6}   {:>17}   {:>15}   {:>17}\n", cells...);
  };
  text += "\n" + line("keyframes", "n", "position [m]", "orientation [°]", "raw position [m]");
  for (const auto& [name, errors] : rows(estimate)) {
    // Beside the mean of all keyframes, one over those that have a measurement would mislead.
    const bool comparable = errors.raw_position && errors.raw_position->n == errors.compared;
    text += line(name, errors.n, spread_shown(errors.position, 3), mean_shown(errors.orientation, 2),
                 comparable ? spread_shown(errors.raw_position, 3) : spread_shown({}, 3));
  }
  const ErrorSummary all = summarise(estimate.errors);
  if (all.compared == 0)
    text += "There is no truth to compare with.\n";
  else if (all.compared < all.n)
    text += fmt::format("The truth covers {} of the {} keyframes.\n", all.compared, all.n);
  text += sensor_table(estimate) + coverage_table(estimate) + ego_lines(estimate);
  if (const std::string constants = constants_text(estimate.constants); !constants.empty()) text += "\n" + constants;
  text += doubts(estimate);
  if (!estimate.why_no_uncertainty.empty()) text += fmt::format("\nNo covariances: {}\n", estimate.why_no_uncertainty);
  return text;
}

std::string summary_json(const Estimate& estimate) {
  const Summary& summary = estimate.summary;
  Json json = {{"scenario", estimate.scenario},
               {"frame", estimate.frame.name()},
               {"model", name(estimate.options.model)},
               {"mode", name(estimate.options.mode)},
               {"solver", summary.solver},
               {"status", name(summary.status)},
               {"message", summary.message},
               {"initial_cost", summary.initial_cost},
               {"cost", summary.cost},
               {"keyframes", estimate.keyframes.size()},
               {"residual_blocks", estimate.residual_blocks},
               {"iterations", summary.iterations},
               {"evaluations", summary.evaluations},
               {"solve_seconds", summary.seconds},
               {"max_violation", summary.max_violation}};
  for (const auto& [name, errors] : rows(estimate)) json["errors"][name] = errors_json(errors);
  json["sensors"] = sensors_json(estimate);
  for (const EgoSensorUse& s : estimate.ego_sensors)
    json["ego_sensors"][s.name] = {{"used", s.used}, {"left_out", s.left_out}};
  for (const NavigationFinding& finding : estimate.findings) json["findings"].push_back(finding.text());
  if (estimate.dvl_scale) json["dvl_scale"] = 1 + *estimate.dvl_scale;
  for (const auto& [from, to] : estimate.splits) json["splits"].push_back({from, to});
  if (!estimate.held_out.empty()) json["held_out"] = coverage_json(estimate);
  add_staying_errors(json, estimate.constants);
  for (const Suspect& s : estimate.suspects)
    json["suspects"].push_back({{"sensor", s.sensor}, {"t", s.t}, {"sigmas", s.sigmas}});
  if (!estimate.contradiction.empty()) json["contradiction"] = estimate.contradiction;
  if (const auto nees = overconfident_nees(estimate)) json["overconfident_nees"] = *nees;
  if (!estimate.why_no_uncertainty.empty()) json["no_covariance"] = estimate.why_no_uncertainty;
  return json_text(json);
}

}  // namespace tandem
