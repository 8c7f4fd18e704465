#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/solvers/fit_report.hpp>
#include <tandem/studies/fit/fit_text.hpp>
#include <tandem/studies/navigation_results/navigation_report.hpp>
#include <tandem/studies/navigation_results/navigation_report_parts.hpp>
#include <tandem/studies/support/text_table.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

using Column = TextTable::Column;
constexpr auto kLeft = TextTable::Align::left;
constexpr double kDegreesPerHour = 3600 * kDegrees;  // per rad/s

double rate_of(std::size_t lines, double first, double last) {
  return lines > 1 && last > first ? double(lines - 1) / (last - first) : 0;
}

std::string shown(const std::optional<double>& value, int decimals) {
  return value ? fmt::format("{:.{}f}", *value, decimals) : "–";
}

std::string percent(double share) { return fmt::format("{:.1f} %", 100 * share); }

std::string sensor_table(const Navigation& navigation) {
  TextTable table(
      {{"sensors", kLeft}, {"type", kLeft}, {"lines"}, {"rate [Hz]"}, {"used"}, {"discarded"}, {"down-weighted"}});
  for (const EgoSensorOutcome& s : ego_sensor_outcomes(navigation))
    table.row({s.name, std::string(s.type), std::to_string(s.lines), fmt::format("{:.1f}", s.rate),
               std::to_string(s.used), std::to_string(s.discarded), std::to_string(s.down_weighted)});
  std::string text = table.str();
  for (const NavigationFinding& finding : navigation.findings) text += finding.text() + ".\n";
  if (!navigation.splits.empty()) {
    text += fmt::format("Gaps of the IMU without inertial residual ({}):", navigation.splits.size());
    constexpr std::size_t kMaxShown = 5;
    for (std::size_t i = 0; i < std::min(kMaxShown, navigation.splits.size()); ++i)
      text +=
          fmt::format("{} {:.2f} to {:.2f} s", i ? "," : "", navigation.splits[i].first, navigation.splits[i].second);
    text += navigation.splits.size() > kMaxShown ? ", …\n" : "\n";
  }
  return text;
}

/// Returns a table of the errors' means, root mean squares and maxima, and of their values at the end.
std::string error_table(const NavigationStudy& study) {
  const std::vector<NavigationErrorRow> all = error_rows(study);
  if (all.front().errors.compared == 0)
    return study.scenario.truth_chaser.empty()
               ? "Errors are not available, because the scenario has no truth of the chaser.\n"
               : "Errors are not available, because the truth covers none of the keyframes.\n";
  std::vector<Column> columns = {{"errors", kLeft}, {"n"}};
  for (int i = 0; i < 4; ++i) columns.insert(columns.end(), {{"mean"}, {"rms"}, {"max"}});
  TextTable table(columns);
  table.group(2, 4, "position [m]");
  table.group(5, 7, "horizontal [m]");
  table.group(8, 10, "orientation [°]");
  table.group(11, 13, "velocity [m/s]");
  for (const NavigationErrorRow& row : all) {
    std::vector<std::string> cells = {row.name, std::to_string(row.errors.compared)};
    const auto add = [&](const std::optional<Statistics>& s, double unit, int decimals) {
      for (const auto value : {&Statistics::mean, &Statistics::rms, &Statistics::max})
        cells.push_back(s ? fmt::format("{:.{}f}", unit * (*s).*value, decimals) : "–");
    };
    add(row.errors.position, 1, 3);
    add(row.errors.horizontal, 1, 3);
    add(row.errors.orientation, kDegrees, 3);
    add(row.errors.velocity, 1, 3);
    table.row(cells);
  }
  const NavigationError& end = *last_compared(study);
  const auto norm = [](const std::optional<Vector<3>>& v) { return v ? std::optional(v->norm()) : std::nullopt; };
  table.row({"at the end", "1", shown(norm(end.position), 3), "", "", shown(horizontal(*end.position), 3), "", "",
             end.orientation ? fmt::format("{:.3f}", kDegrees * end.orientation->norm()) : "–", "", "",
             shown(norm(end.velocity), 3)});
  std::string text = table.str();

  const NavigationComparison& c = study.comparison;
  if (all.front().errors.compared < all.front().errors.n)
    text +=
        fmt::format("The truth covers {} of the {} keyframes.\n", all.front().errors.compared, all.front().errors.n);
  if (!c.antenna.empty())
    text += fmt::format("The truth has positions only; it is compared with the estimated antenna of {}.\n", c.antenna);
  if (!c.alignment.empty()) text += c.alignment + "\n";
  if (const auto part = percent_of(horizontal(*end.position), c.distance))
    text += fmt::format("Distance travelled: {:.1f} m; the horizontal error at the end is {:.2f} % of it.\n",
                        *c.distance, *part);
  return text;
}

constexpr double kOverconfident = 3 * 9;  // NEES of a position: errors of three standard deviations on average

/// Reports whether errors agree with their standard deviations: roll, pitch and yaw, and the NEES.
std::string consistency(const NavigationStudy& study) {
  std::string text;
  for (const NavigationErrorRow& row : error_rows(study)) {
    const NavigationErrorSummary& e = row.errors;
    if (!e.orientation_rms && !e.position_nees) continue;
    std::string line = row.name + ":";
    if (e.orientation_rms)
      line += fmt::format(" rms error of roll {:.3f}, pitch {:.3f}, yaw {:.3f}°", kDegrees * e.orientation_rms->x(),
                          kDegrees * e.orientation_rms->y(), kDegrees * e.orientation_rms->z());
    if (e.orientation_within)
      line += fmt::format("; within 3σ at {}, {}, {} of the keyframes", percent(e.orientation_within->x()),
                          percent(e.orientation_within->y()), percent(e.orientation_within->z()));
    if (e.position_nees)
      line += fmt::format("{} NEES {}", e.orientation_rms ? ";" : "",
                          e.pose_nees ? fmt::format("of the pose {:.2f} (6 if consistent), of the position {:.2f} (3)",
                                                    *e.pose_nees, *e.position_nees)
                                      : fmt::format("of the position {:.2f} (3 if consistent)", *e.position_nees));
    text += line + ".\n";
    if (e.position_nees && *e.position_nees > kOverconfident)
      text +=
          "OVERCONFIDENT: errors are far larger than their covariances; check whether the sensors' standard deviations "
          "are too small.\n";
  }
  return text.empty() ? text : "\n" + text;
}

std::string outage_table(const NavigationComparison& comparison) {
  if (comparison.outages.empty()) return "";
  TextTable table({{"GPS outage"}, {"seconds"}, {"travelled [m]"}, {"drift [m]"}, {"drift [%]"}, {"largest [m]"}});
  for (const GpsOutage& o : comparison.outages)
    table.row({fmt::format("{:.1f} – {:.1f} s", o.from, o.to), fmt::format("{:.1f}", o.to - o.from),
               shown(o.distance, 1), shown(o.drift, 3), shown(percent_of(o.drift, o.distance), 2),
               shown(o.largest, 3)});
  return "\n" + table.str() + "Drift is the horizontal error at the end of the outage; later fixes influence it.\n";
}

std::string with_sigmas(const Vector<3>& value, const std::optional<Vector<3>>& sigma, double unit) {
  std::vector<std::string> parts;
  for (int i = 0; i < 3; ++i)
    parts.push_back(sigma ? fmt::format("{:.4g} ± {:.2g}", unit * value[i], unit * (*sigma)[i])
                          : fmt::format("{:.4g}", unit * value[i]));
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string calibration(const NavigationStudy& study) {
  std::string text;
  if (const auto biases = final_biases(study)) {
    text += fmt::format("\nAccelerometer bias at the end [mm/s²]: {}\n",
                        with_sigmas(biases->accelerometer, biases->accelerometer_sigma, 1e3));
    text += fmt::format("Gyroscope bias at the end [°/h]: {}\n",
                        with_sigmas(biases->gyroscope, biases->gyroscope_sigma, kDegreesPerHour));
  }
  for (const DelayFit& fit : study.delays) text += tandem::text(fit);
  if (study.navigation.dvl_scale)
    text += fmt::format("{}Estimated DVL scale (reading / velocity): {:.5f}\n", text.empty() ? "\n" : "",
                        1 + *study.navigation.dvl_scale);
  if (const std::string constants = systematic_errors_text(study.navigation.constants); !constants.empty())
    text += (text.empty() ? "\n" : "") + constants;
  return text;
}

}  // namespace

std::vector<NavigationErrorRow> error_rows(const NavigationStudy& study) {
  const std::vector<NavigationError>& errors = study.comparison.errors;
  std::vector<NavigationErrorRow> result = {{"all", "all", summarise(errors)}};
  if (study.after)
    result.push_back({fmt::format("after {:g} s", *study.after), fmt::format("after_{:g}s", *study.after),
                      summarise(errors, *study.after)});
  return result;
}

const NavigationError* last_compared(const NavigationStudy& study) {
  const auto& errors = study.comparison.errors;
  const auto at = std::find_if(errors.rbegin(), errors.rend(), [](const auto& e) { return e.position.has_value(); });
  return at == errors.rend() ? nullptr : &*at;
}

double data_seconds(const Navigation& navigation) { return navigation.states.back().t - navigation.states.front().t; }

std::optional<double> percent_of(const std::optional<double>& part, const std::optional<double>& whole) {
  if (!part || !whole || !(*whole > 0)) return {};
  return 100 * *part / *whole;
}

std::optional<FinalBiases> final_biases(const NavigationStudy& study) {
  const Navigation& navigation = study.navigation;
  if (!navigation.data.imu) return {};
  const Frame& frame = study.scenario.frame;
  const Vector<6>& bias = navigation.states.back().value.bias;
  FinalBiases result{frame.body(Vector<3>(bias.head<3>())), frame.body(Vector<3>(bias.tail<3>())), {}, {}};
  if (navigation.covariance.empty()) return result;
  const Vector<6> sigma = navigation.covariance.back().bias.diagonal().cwiseSqrt();
  result.accelerometer_sigma = sigma.head<3>();
  result.gyroscope_sigma = sigma.tail<3>();
  return result;
}

std::vector<EgoSensorOutcome> ego_sensor_outcomes(const Navigation& navigation) {
  std::vector<EgoSensorOutcome> result;
  if (const auto& imu = navigation.data.imu) {
    const auto& samples = imu->samples;
    result.push_back({imu->name, "imu", samples.size(), rate_of(samples.size(), samples.front().t, samples.back().t),
                      samples.size()});
  }
  const std::size_t others = result.size();
  for (std::size_t i = 0; i < navigation.data.sensors.size(); ++i) {
    const EgoSensor& sensor = navigation.data.sensors[i];
    const auto& m = sensor.measurements;
    const double rate = m.empty() ? 0 : rate_of(m.size(), m.front().t, m.back().t);
    result.push_back({sensor.name, name(sensor.type), m.size(), rate, 0, navigation.discarded[i]});
  }
  for (std::size_t i = 0; i < navigation.placed.size(); ++i) {
    EgoSensorOutcome& outcome = result[others + navigation.placed[i].sensor];
    ++outcome.used;
    outcome.down_weighted += navigation.weight[i] < kDownweightThreshold;
  }
  return result;
}

std::string navigation_report(const NavigationStudy& study) {
  const Navigation& navigation = study.navigation;
  const Summary& summary = navigation.summary;
  const double length = data_seconds(navigation);
  std::string text = fmt::format(
      "{}: {} keyframes, {} residual blocks; {:.1f} s of data in {:.2f} s ({:.0f} times real "
      "time)\n",
      study.scenario.name, navigation.states.size(), navigation.residual_blocks, length, navigation.seconds,
      length / navigation.seconds);
  text += fmt::format("{}: {}, cost {:.6f} (from {:.6g}), {} iterations, {} evaluations, {:.3f} s{}\n", summary.solver,
                      name(summary.status), summary.cost, summary.initial_cost, summary.iterations, summary.evaluations,
                      summary.seconds,
                      navigation.solves > 1 ? fmt::format(", the last of {} solves", navigation.solves) : "");
  if (!summary.converged()) text += fmt::format("NOT CONVERGED: {}\n", summary.message);
  text += "\n" + sensor_table(navigation) + "\n" + fit_text(navigation.fit) + likely_causes_text(study.causes) + "\n" +
          error_table(study) + consistency(study) + outage_table(study.comparison) + calibration(study);
  text += states_at_text(navigation.at);
  if (!navigation.why_no_covariance.empty())
    text += fmt::format("\nNo covariances: {}\n", navigation.why_no_covariance);
  return text;
}

}  // namespace tandem
