#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/estimation/estimate_report.hpp>
#include <tandem/studies/estimation/estimate_report_parts.hpp>
#include <tandem/studies/estimation/mean_std_text.hpp>
#include <tandem/studies/estimation/unobservable_text.hpp>
#include <tandem/studies/fit/fit_text.hpp>
#include <tandem/studies/support/mahalanobis.hpp>

namespace tandem {
namespace {

std::string_view name(Role role) {
  if (role == Role::off) return "off";
  return role == Role::soft ? "soft" : "hard";
}

/// Describes the model and all options that differ from the default: "constant-twist, mode A, robust, surge hard".
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

/// Returns the findings in the data, then a description of the chaser's own sensors if it moves by them.
std::string ego_lines(const Estimate& estimate) {
  std::string findings;
  for (const NavigationFinding& finding : estimate.findings) findings += finding.text() + ".\n";
  if (estimate.ego_sensors.empty()) return findings.empty() ? "" : "\n" + findings;
  std::vector<std::string> used;
  for (const EgoSensorUse& s : estimate.ego_sensors)
    used.push_back(s.discarded > 0 ? fmt::format("{} {} ({} discarded)", s.name, s.used, s.discarded)
                                   : fmt::format("{} {}", s.name, s.used));
  std::string text =
      fmt::format("\nChaser and target estimated jointly from the chaser's own sensors; measurements used: {}.\n",
                  used.empty() ? "imu only" : fmt::format("{}", fmt::join(used, ", ")));
  text += findings;
  if (estimate.dvl_scale)
    text += fmt::format("Estimated DVL scale (reading / velocity): {:.4f}.\n", 1 + *estimate.dvl_scale);
  if (!estimate.splits.empty())
    text +=
        fmt::format("The IMU has gaps: {} of the intervals between {:.3f} s and {:.3f} s have no inertial residual.\n",
                    estimate.splits.size(), estimate.splits.front().first, estimate.splits.back().second);
  return text;
}

std::string sensor_table(const Estimate& estimate) {
  const auto line = [](const auto&... cells) {
    return fmt::format("{:<10} {:<14} {:>6} {:>9} {:>9} {:>14}   {:>17}\n", cells...);
  };
  std::string text =
      "\n" + line("sensors", "type", "used", "held out", "discarded", "down-weighted", "raw position [m]");
  for (const SensorOutcome& s : estimate.sensors)
    text +=
        line(s.name, name(s.type), s.used, s.held_out, s.discarded, s.down_weighted, mean_std_text(s.raw_position, 3));
  if (!estimate.without_extrinsics.empty())
    text += fmt::format("{}: no extrinsics given; the body's origin and axes are assumed.\n",
                        fmt::join(estimate.without_extrinsics, ", "));
  return text;
}

std::string coverage_table(const Estimate& estimate) {
  if (estimate.held_out.empty()) return "";
  const auto line = [](const auto&... cells) {
    return fmt::format("{:<10} {:>6} {:>9}   {:>17}   {:>21}\n", cells...);
  };
  const auto percent = [](int part, int whole) {
    return whole > 0 ? fmt::format("{:.1f} %", 100.0 * part / whole) : "–";
  };
  std::string text = "\n" + line("held out", "n", "inliers", "in 95 % interval", "in joint 95 % region");
  bool inliers_known = true, robust = false;
  for (const Coverage& c : coverages(estimate)) {
    text += line(c.name, c.n, c.inliers, percent(c.rows_inside, c.rows), percent(c.inside, c.inliers));
    inliers_known &= c.inliers_known;
  }
  for (const SensorOutcome& sensor : estimate.sensors) robust |= sensor.robust;
  text += "Shares of the inliers' residual rows, and of the inliers with all rows taken together.\n";
  if (!inliers_known)
    text += "The solve with all measurements did not converge; all held-out measurements count as inliers.\n";
  else if (robust)
    text +=
        fmt::format("Inliers have a weight of {} or more in a solve with all measurements.\n", kDownweightThreshold);
  return text;
}

std::string warnings(const Estimate& estimate) {
  constexpr std::size_t kMaxSuspects = 3;
  const auto& suspects = estimate.suspects;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMaxSuspects, suspects.size()); ++i) text += suspects[i].text() + ".\n";
  if (suspects.size() > kMaxSuspects) text += fmt::format("… and {} more.\n", suspects.size() - kMaxSuspects);
  const auto has_loss = [&](const SuspectedOutlier& suspect) {
    return std::any_of(estimate.sensors.begin(), estimate.sensors.end(),
                       [&](const SensorOutcome& s) { return s.name == suspect.sensor && s.robust; });
  };
  if (!std::all_of(suspects.begin(), suspects.end(), has_loss) && !estimate.options.robust_initial_guess)
    text += "If these are outliers, use --robust.\n";
  if (!estimate.contradiction.empty()) text += estimate.contradiction + "\n";
  if (const auto nees = overconfident_nees(estimate))
    text += fmt::format(
        "OVERCONFIDENT: errors are far larger than their covariances (mean NEES of the relative position {:.1f}, 3 if "
        "consistent); check whether the noise in scenario.yaml is too small.\n",
        *nees);
  return text.empty() ? text : "\n" + text;
}

}  // namespace

std::vector<EstimateErrorRow> error_rows(const Estimate& estimate) {
  std::vector<EstimateErrorRow> result;
  for (const KeyframeType type : keyframe_types)
    result.push_back({std::string(name(type)), summarise(estimate.errors, type)});
  result.push_back({"all", summarise(estimate.errors)});
  return result;
}

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

std::optional<double> overconfident_nees(const Estimate& estimate) {
  constexpr double kFarTooLarge = 3 * 9;  // errors of three standard deviations on average
  Moments nees;
  for (std::size_t k = 0; k < estimate.uncertainty.size(); ++k)
    if (const auto& error = estimate.errors[k].position_vector)
      nees.add(squared_distance(*error, estimate.uncertainty[k].relative_position));
  const auto found = nees.mean_std();
  return found && found->mean > kFarTooLarge ? std::optional(found->mean) : std::nullopt;
}

std::string report(const Estimate& estimate) {
  const Summary& summary = estimate.summary;
  std::string text = fmt::format("{}, {}: {} keyframes, {} residual blocks", estimate.scenario, model_line(estimate),
                                 estimate.keyframes.size(), estimate.residual_blocks);
  if (estimate.hard_blocks > 0) text += fmt::format(", {} hard constraints", estimate.hard_blocks);
  constexpr double kWide = 1e12;  // larger costs have no meaningful decimals
  text += fmt::format(
      "\n{}: {}, cost {} (from {:.6g}), {} iterations, {} evaluations, {:.3f} s\n", summary.solver,
      name(summary.status),
      std::abs(summary.cost) < kWide ? fmt::format("{:.6f}", summary.cost) : fmt::format("{:.6g}", summary.cost),
      summary.initial_cost, summary.iterations, summary.evaluations, summary.seconds);
  if (estimate.hard_blocks > 0)
    text += fmt::format("largest violation of a hard constraint: {:.2g}\n", summary.max_violation);
  if (!summary.converged()) text += fmt::format("NOT CONVERGED: {}\n", summary.message);
  if (!summary.unobservable.empty()) text += unobservable_text(estimate) + ".\n";

  const auto line = [](const auto&... cells) {
    return fmt::format("{:<11} {:>6}   {:>17}   {:>15}   {:>17}\n", cells...);
  };
  text += "\n" + line("measurement", "n", "position [m]", "orientation [°]", "raw position [m]");
  for (const auto& [type, errors] : error_rows(estimate)) {
    if (errors.n == 0) continue;
    // Shows the raw error only if all keyframes of the row have a measurement; other means are not comparable.
    const bool comparable = errors.raw_position && errors.raw_position->n == errors.compared;
    text += line(type, errors.n, mean_std_text(errors.position, 3), mean_text(errors.orientation, 2),
                 comparable ? mean_std_text(errors.raw_position, 3) : mean_std_text({}, 3));
  }
  const ErrorSummary all = summarise(estimate.errors);
  if (all.compared == 0)
    text += estimate.missing_truth + "\n";
  else if (all.compared < all.n)
    text += fmt::format("The truth covers {} of the {} keyframes.\n", all.compared, all.n);
  if (const auto& error = estimate.target_error_in_world)
    text += fmt::format(
        "Position of the target in the world, against its truth: error {:.3f} ± {:.3f} m at {} keyframes.\n",
        error->mean, error->std, error->n);
  if (!estimate.unmeasured_orientation.empty()) text += estimate.unmeasured_orientation + "\n";
  text += sensor_table(estimate) + coverage_table(estimate) + ego_lines(estimate);
  for (const DelayFit& fit : estimate.delays) text += "\n" + tandem::text(fit);
  if (const std::string constants = systematic_errors_text(estimate.constants); !constants.empty())
    text += "\n" + constants;
  text += "\n" + fit_text(estimate.fit) + likely_causes_text(estimate.causes);
  text += warnings(estimate) + states_at_text(estimate.at);
  if (!estimate.why_no_uncertainty.empty()) text += fmt::format("\nNo covariances: {}\n", estimate.why_no_uncertainty);
  return text;
}

}  // namespace tandem
