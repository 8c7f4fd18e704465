#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/navigation/found_constants_json.hpp>
#include <tandem/studies/navigation/more/navigation_report.hpp>
#include <tandem/studies/support/down_weighted.hpp>
#include <tandem/studies/support/json_text.hpp>
#include <tandem/studies/support/text_table.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

using Json = nlohmann::ordered_json;
using Column = TextTable::Column;
constexpr auto kLeft = TextTable::Align::left;
constexpr double kDegreesAnHour = 3600 * kDegrees;

double rate_of(std::size_t lines, double first, double last) {
  return lines > 1 && last > first ? double(lines - 1) / (last - first) : 0;
}

/// "all", "after 20 s".
struct Row {
  std::string name, key;
  NavigationErrorSummary errors;
};

std::vector<Row> rows(const NavigationStudy& study) {
  const std::vector<NavigationError>& errors = study.comparison.errors;
  std::vector<Row> result = {{"all", "all", summarise(errors)}};
  if (study.after)
    result.push_back({fmt::format("after {:g} s", *study.after), fmt::format("after_{:g}s", *study.after),
                      summarise(errors, *study.after)});
  return result;
}

/// The last keyframe that the truth covers.
const NavigationError* last_compared(const NavigationStudy& study) {
  const auto& errors = study.comparison.errors;
  const auto at = std::find_if(errors.rbegin(), errors.rend(), [](const auto& e) { return e.position.has_value(); });
  return at == errors.rend() ? nullptr : &*at;
}

double data_seconds(const Navigation& navigation) { return navigation.states.back().t - navigation.states.front().t; }

std::string shown(const std::optional<double>& value, int decimals) {
  return value ? fmt::format("{:.{}f}", *value, decimals) : "–";
}

std::string percent(double share) { return fmt::format("{:.1f} %", 100 * share); }

/// Of a distance; nothing of none.
std::optional<double> percent_of(const std::optional<double>& part, const std::optional<double>& whole) {
  if (!part || !whole || !(*whole > 0)) return {};
  return 100 * *part / *whole;
}

std::string sensor_table(const Navigation& navigation) {
  TextTable table(
      {{"sensors", kLeft}, {"type", kLeft}, {"lines"}, {"rate [Hz]"}, {"used"}, {"left out"}, {"down-weighted"}});
  for (const EgoSensorOutcome& s : ego_sensor_outcomes(navigation))
    table.row({s.name, std::string(s.type), std::to_string(s.lines), fmt::format("{:.1f}", s.rate),
               std::to_string(s.used), std::to_string(s.left_out), std::to_string(s.down_weighted)});
  std::string text = table.str();
  for (const NavigationFinding& finding : navigation.findings) text += finding.text() + ".\n";
  if (!navigation.splits.empty()) {
    text += fmt::format("The inertial chain is split {}:", navigation.splits.size() == 1
                                                               ? std::string("once")
                                                               : fmt::format("{} times", navigation.splits.size()));
    constexpr std::size_t most = 5;
    for (std::size_t i = 0; i < std::min(most, navigation.splits.size()); ++i)
      text +=
          fmt::format("{} {:.2f} to {:.2f} s", i ? "," : "", navigation.splits[i].first, navigation.splits[i].second);
    text += navigation.splits.size() > most ? ", …\n" : "\n";
  }
  return text;
}

/// Mean, rms and max of each kind of error; then their values at the end.
std::string error_table(const NavigationStudy& study) {
  const std::vector<Row> all = rows(study);
  if (all.front().errors.compared == 0) return "There is no truth to compare with.\n";
  std::vector<Column> columns = {{"errors", kLeft}, {"n"}};
  for (int i = 0; i < 4; ++i) columns.insert(columns.end(), {{"mean"}, {"rms"}, {"max"}});
  TextTable table(columns);
  table.group(2, 4, "position [m]");
  table.group(5, 7, "horizontal [m]");
  table.group(8, 10, "orientation [°]");
  table.group(11, 13, "velocity [m/s]");
  for (const Row& row : all) {
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
    text += fmt::format("The truth has positions only: it is compared with where the antenna of {} is.\n", c.antenna);
  if (!c.alignment.empty()) text += c.alignment + "\n";
  if (const auto part = percent_of(horizontal(*end.position), c.distance))
    text += fmt::format("Travelled: {:.1f} m by the truth; the horizontal error at the end is {:.2f} % of it.\n",
                        *c.distance, *part);
  return text;
}

constexpr double kOverconfident = 3 * 9;  // NEES of a position: errors of three times their sigmas, as a mean

/// How well the σs hold: roll, pitch and yaw, and the NEES.
std::string consistency(const NavigationStudy& study) {
  std::string text;
  for (const Row& row : rows(study)) {
    const NavigationErrorSummary& e = row.errors;
    if (!e.orientation_rms && !e.position_nees) continue;
    std::string line = row.name + ":";
    if (e.orientation_rms)
      line += fmt::format(" rms of roll {:.3f}, pitch {:.3f}, yaw {:.3f}°", kDegrees * e.orientation_rms->x(),
                          kDegrees * e.orientation_rms->y(), kDegrees * e.orientation_rms->z());
    if (e.orientation_within)
      line += fmt::format("; within their 3 σ {}, {}, {} of the time", percent(e.orientation_within->x()),
                          percent(e.orientation_within->y()), percent(e.orientation_within->z()));
    if (e.position_nees)
      line += fmt::format("{} NEES {}", e.orientation_rms ? ";" : "",
                          e.pose_nees ? fmt::format("of the pose {:.2f} (of 6), of its position {:.2f} (of 3)",
                                                    *e.pose_nees, *e.position_nees)
                                      : fmt::format("of the position {:.2f} (of 3)", *e.position_nees));
    text += line + ".\n";
    if (e.position_nees && *e.position_nees > kOverconfident)
      text += "OVERCONFIDENT: errors are far larger than the covariances say: are the sensors' sigmas too small?\n";
  }
  return text.empty() ? text : "\n" + text;
}

std::string outage_table(const NavigationComparison& comparison) {
  if (comparison.outages.empty()) return "";
  TextTable table({{"without GPS"}, {"seconds"}, {"travelled [m]"}, {"drift [m]"}, {"drift [%]"}, {"largest [m]"}});
  for (const GpsOutage& o : comparison.outages)
    table.row({fmt::format("{:.1f} – {:.1f} s", o.from, o.to), fmt::format("{:.1f}", o.to - o.from),
               shown(o.distance, 1), shown(o.drift, 3), shown(percent_of(o.drift, o.distance), 2), shown(o.most, 3)});
  return "\n" + table.str() +
         "Drift: the horizontal error at the end of it; fixes that come later have their part in it.\n";
}

std::string with_sigmas(const Vector<3>& value, const std::optional<Vector<3>>& sigma, double unit) {
  std::vector<std::string> parts;
  for (int i = 0; i < 3; ++i)
    parts.push_back(sigma ? fmt::format("{:.4g} ± {:.2g}", unit * value[i], unit * (*sigma)[i])
                          : fmt::format("{:.4g}", unit * value[i]));
  return fmt::format("{}", fmt::join(parts, ", "));
}

/// Biases at the end, along the IMU's axes in the scenario's frame.
struct Biases {
  Vector<3> accelerometer, gyroscope;
  std::optional<Vector<3>> accelerometer_sigma, gyroscope_sigma;
};

std::optional<Biases> last_biases(const NavigationStudy& study) {
  const Navigation& navigation = study.navigation;
  if (!navigation.data.imu) return {};
  const Frame& frame = study.scenario.frame;
  const Vector<6>& bias = navigation.states.back().value.bias;
  Biases result{frame.body(Vector<3>(bias.head<3>())), frame.body(Vector<3>(bias.tail<3>())), {}, {}};
  if (navigation.covariance.empty()) return result;
  const Vector<6> sigma = navigation.covariance.back().bias.diagonal().cwiseSqrt();
  result.accelerometer_sigma = sigma.head<3>();
  result.gyroscope_sigma = sigma.tail<3>();
  return result;
}

std::string calibration(const NavigationStudy& study) {
  std::string text;
  if (const auto biases = last_biases(study)) {
    text += fmt::format("\naccelerometer bias at the end [mm/s²]: {}\n",
                        with_sigmas(biases->accelerometer, biases->accelerometer_sigma, 1e3));
    text += fmt::format("gyroscope bias at the end [°/h]: {}\n",
                        with_sigmas(biases->gyroscope, biases->gyroscope_sigma, kDegreesAnHour));
  }
  for (const DelayFit& fit : study.delays)
    text += fmt::format("{} lags by {:.3f}{} s, by likelihood: the cost is {:.2f}, {:.2f} as given ({} solves).\n",
                        fit.sensor, fit.delay, fit.deviation ? fmt::format(" ± {:.2g}", *fit.deviation) : "", fit.cost,
                        fit.cost_before, fit.solves);
  if (study.navigation.dvl_scale)
    text += fmt::format("{}the DVL reads {:.5f} times the velocity\n", text.empty() ? "\n" : "",
                        1 + *study.navigation.dvl_scale);
  if (const std::string constants = constants_text(study.navigation.constants); !constants.empty())
    text += (text.empty() ? "\n" : "") + constants;
  return text;
}

Json vector_json(const Vector<3>& v) { return {v.x(), v.y(), v.z()}; }

Json errors_json(const NavigationErrorSummary& errors, const Frame& frame) {
  Json json = {{"n", errors.n}};
  if (errors.compared > 0 && errors.compared < errors.n) json["n_with_truth"] = errors.compared;
  const auto add = [&](const std::string& key, const std::string& unit, const std::optional<Statistics>& s,
                       double scale = 1) {
    if (!s) return;
    json[key + "_mean_" + unit] = scale * s->mean;
    json[key + "_rms_" + unit] = scale * s->rms;
    json[key + "_max_" + unit] = scale * s->max;
  };
  add("position", "m", errors.position);
  add("horizontal", "m", errors.horizontal);
  add("orientation", "deg", errors.orientation, kDegrees);
  add("velocity", "m_s", errors.velocity);
  if (errors.orientation_rms) {
    json["roll_rms_deg"] = kDegrees * errors.orientation_rms->x();
    json["pitch_rms_deg"] = kDegrees * errors.orientation_rms->y();
    json["yaw_rms_deg"] = kDegrees * errors.orientation_rms->z();
  }
  if (errors.position_within)
    json["position_within_3_sigma_percent"] = vector_json(100 * frame.world(*errors.position_within).cwiseAbs());
  if (errors.orientation_within)
    json["orientation_within_3_sigma_percent"] = vector_json(100 * *errors.orientation_within);
  if (errors.pose_nees) json["pose_nees"] = *errors.pose_nees;
  if (errors.position_nees) json["position_nees"] = *errors.position_nees;
  return json;
}

Json end_json(const NavigationError& end, const std::optional<double>& distance) {
  Json json = {{"t", end.t}, {"position_m", end.position->norm()}, {"horizontal_m", horizontal(*end.position)}};
  if (const auto part = percent_of(horizontal(*end.position), distance)) json["horizontal_percent_of_distance"] = *part;
  if (end.orientation) json["orientation_deg"] = kDegrees * end.orientation->norm();
  if (end.velocity) json["velocity_m_s"] = end.velocity->norm();
  return json;
}

Json outages_json(const NavigationComparison& comparison) {
  Json json = Json::array();
  for (const GpsOutage& o : comparison.outages) {
    Json& entry = json.emplace_back(Json{{"from", o.from}, {"to", o.to}});
    if (!o.drift) continue;
    entry["distance_m"] = *o.distance;
    entry["drift_m"] = *o.drift;
    if (const auto part = percent_of(o.drift, o.distance)) entry["drift_percent"] = *part;
    entry["largest_m"] = *o.most;
  }
  return json;
}

Json sensors_json(const Navigation& navigation) {
  Json json;
  for (const EgoSensorOutcome& s : ego_sensor_outcomes(navigation))
    json[s.name] = {{"type", s.type}, {"lines", s.lines},       {"rate_hz", s.rate},
                    {"used", s.used}, {"left_out", s.left_out}, {"down_weighted", s.down_weighted}};
  return json;
}

Json biases_json(const Biases& biases) {
  Json json = {{"accelerometer_m_s2", vector_json(biases.accelerometer)},
               {"gyroscope_rad_s", vector_json(biases.gyroscope)}};
  if (biases.accelerometer_sigma) json["accelerometer_sigma_m_s2"] = vector_json(*biases.accelerometer_sigma);
  if (biases.gyroscope_sigma) json["gyroscope_sigma_rad_s"] = vector_json(*biases.gyroscope_sigma);
  return json;
}

}  // namespace

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
    result.push_back({sensor.name, name(sensor.type), m.size(), rate, 0, navigation.left_out[i]});
  }
  for (std::size_t i = 0; i < navigation.placed.size(); ++i) {
    EgoSensorOutcome& outcome = result[others + navigation.placed[i].sensor];
    ++outcome.used;
    outcome.down_weighted += navigation.weight[i] < kDownWeighted;
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
  text += "\n" + sensor_table(navigation) + "\n" + error_table(study) + consistency(study) +
          outage_table(study.comparison) + calibration(study);
  if (!navigation.why_no_covariance.empty())
    text += fmt::format("\nNo covariances: {}\n", navigation.why_no_covariance);
  return text;
}

std::string navigation_json(const NavigationStudy& study) {
  const Navigation& navigation = study.navigation;
  const NavigationComparison& comparison = study.comparison;
  const Summary& summary = navigation.summary;
  const double length = data_seconds(navigation);
  Json json = {{"scenario", study.scenario.name},
               {"frame", study.scenario.frame.name()},
               {"solver", summary.solver},
               {"status", name(summary.status)},
               {"message", summary.message},
               {"initial_cost", summary.initial_cost},
               {"cost", summary.cost},
               {"keyframes", navigation.states.size()},
               {"residual_blocks", navigation.residual_blocks},
               {"iterations", summary.iterations},
               {"evaluations", summary.evaluations},
               {"solves", navigation.solves},
               {"solve_seconds", summary.seconds},
               {"alignment_seconds", navigation.alignment_seconds},
               {"seconds", navigation.seconds},
               {"data_seconds", length},
               {"times_real_time", length / navigation.seconds}};
  json["sensors"] = sensors_json(navigation);
  json["findings"] = Json::array();
  for (const NavigationFinding& finding : navigation.findings) json["findings"].push_back(finding.text());
  json["splits"] = navigation.splits;
  for (const Row& row : rows(study)) json["errors"][row.key] = errors_json(row.errors, study.scenario.frame);
  if (const NavigationError* end = last_compared(study)) json["errors"]["end"] = end_json(*end, comparison.distance);
  if (comparison.distance) json["distance_m"] = *comparison.distance;
  if (!comparison.antenna.empty()) json["truth_at_antenna_of"] = comparison.antenna;
  if (!comparison.alignment.empty()) json["truth_aligned"] = comparison.alignment;
  json["gps_outages"] = outages_json(comparison);
  if (const auto biases = last_biases(study)) json["bias_at_the_end"] = biases_json(*biases);
  for (const DelayFit& fit : study.delays) {
    Json& of = json["fitted_delays"][fit.sensor];
    of = {{"seconds", fit.delay}, {"cost", fit.cost}, {"cost_as_given", fit.cost_before}};
    if (fit.deviation) of["sigma"] = *fit.deviation;
  }
  add_staying_errors(json, navigation.constants);
  if (navigation.dvl_scale) json["dvl_scale"] = 1 + *navigation.dvl_scale;
  if (!navigation.why_no_covariance.empty()) json["no_covariance"] = navigation.why_no_covariance;
  return json_text(json);
}

}  // namespace tandem
