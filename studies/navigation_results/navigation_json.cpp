#include <tandem/studies/fit/fit_text.hpp>
#include <tandem/studies/navigation/fit_delay_json.hpp>
#include <tandem/studies/navigation/systematic_error_estimates_json.hpp>
#include <tandem/studies/navigation_results/navigation_report_parts.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

using Numbers = std::vector<double>;

Numbers numbers(const Vector<3>& v) { return {v.x(), v.y(), v.z()}; }
std::optional<Numbers> numbers(const std::optional<Vector<3>>& v) {
  return v ? std::optional(numbers(*v)) : std::nullopt;
}

/// Errors of a set of keyframes, and the frame of the files.
struct Errors {
  NavigationErrorSummary summary;
  const Frame& frame;
};

/// Adds the mean, root mean square and maximum of an error, multiplied by `unit`.
void add_statistics(JsonFields<Errors>& fields, const std::string& key, const std::string& suffix,
                    const std::string& what, std::optional<Statistics> NavigationErrorSummary::*statistics,
                    double unit = 1) {
  for (const auto& [word, label, value] : {std::tuple{"mean", "mean", &Statistics::mean},
                                           {"rms", "root mean square of the", &Statistics::rms},
                                           {"max", "largest", &Statistics::max}})
    fields.add(key + "_" + word + "_" + suffix, std::string(label) + " " + what,
               [statistics, value = value, unit](const Errors& e) -> std::optional<double> {
                 const std::optional<Statistics>& s = e.summary.*statistics;
                 return s ? std::optional(unit * (*s).*value) : std::nullopt;
               });
}

JsonFields<Errors> error_fields() {
  JsonFields<Errors> fields;
  fields.add("n", "number of keyframes", [](const Errors& e) { return e.summary.n; })
      .add("n_with_truth", "number of keyframes that the truth covers, if it covers only some",
           [](const Errors& e) -> std::optional<int> {
             const bool some = e.summary.compared > 0 && e.summary.compared < e.summary.n;
             return some ? std::optional(e.summary.compared) : std::nullopt;
           });
  using S = NavigationErrorSummary;
  add_statistics(fields, "position", "m", "position error [m]", &S::position);
  add_statistics(fields, "horizontal", "m", "horizontal position error [m]", &S::horizontal);
  add_statistics(fields, "orientation", "deg", "orientation error [deg]", &S::orientation, kDegrees);
  add_statistics(fields, "velocity", "m_s", "velocity error [m/s]", &S::velocity);
  for (const auto& [axis, i] : {std::pair{"roll", 0}, {"pitch", 1}, {"yaw", 2}})
    fields.add(std::string(axis) + "_rms_deg", std::string("root mean square of the ") + axis + " error [deg]",
               [i = i](const Errors& e) -> std::optional<double> {
                 const auto& rms = e.summary.orientation_rms;
                 return rms ? std::optional(kDegrees * (*rms)[i]) : std::nullopt;
               });
  return fields
      .add("position_within_3_sigma_percent", "share of keyframes with the position error within 3σ, by world axis [%]",
           [](const Errors& e) -> std::optional<Numbers> {
             const auto& share = e.summary.position_within;
             if (!share) return {};
             return numbers(Vector<3>(100 * e.frame.world(*share).cwiseAbs()));
           })
      .add("orientation_within_3_sigma_percent",
           "share of keyframes with the orientation error within 3σ: roll, pitch, yaw [%]",
           [](const Errors& e) -> std::optional<Numbers> {
             const auto& share = e.summary.orientation_within;
             return share ? std::optional(numbers(Vector<3>(100 * *share))) : std::nullopt;
           })
      .add("pose_nees", "mean NEES of the pose; 6 if consistent", [](const Errors& e) { return e.summary.pose_nees; })
      .add("position_nees", "mean NEES of the position; 3 if consistent",
           [](const Errors& e) { return e.summary.position_nees; });
}

struct FinalError {
  const NavigationError& error;
  const std::optional<double>& distance;
};

JsonFields<FinalError> final_error_fields() {
  using E = FinalError;
  const auto norm = [](const std::optional<Vector<3>>& v, double unit) {
    return v ? std::optional(unit * v->norm()) : std::nullopt;
  };
  return JsonFields<E>()
      .add("t", "time of the comparison [s]", [](const E& e) { return e.error.t; })
      .add("position_m", "position error [m]", [norm](const E& e) { return norm(e.error.position, 1); })
      .add("horizontal_m", "horizontal position error [m]", [](const E& e) { return horizontal(*e.error.position); })
      .add("horizontal_percent_of_distance", "horizontal position error in percent of the distance travelled",
           [](const E& e) { return percent_of(horizontal(*e.error.position), e.distance); })
      .add("orientation_deg", "orientation error [deg]",
           [norm](const E& e) { return norm(e.error.orientation, kDegrees); })
      .add("velocity_m_s", "velocity error [m/s]", [norm](const E& e) { return norm(e.error.velocity, 1); });
}

JsonFields<EgoSensorOutcome> sensor_fields() {
  using S = EgoSensorOutcome;
  return JsonFields<S>()
      .add("type", "type of the sensor", [](const S& s) { return s.type; })
      .add("lines", "number of valid lines of its file", [](const S& s) { return s.lines; })
      .add("rate_hz", "mean rate of the lines [Hz]", [](const S& s) { return s.rate; })
      .add("used", "number of measurements used", [](const S& s) { return s.used; })
      .add("discarded", "number of measurements discarded", [](const S& s) { return s.discarded; })
      .add("down_weighted", "number of measurements that the robust loss gives a weight below 0.5",
           [](const S& s) { return s.down_weighted; });
}

JsonFields<GpsOutage> outage_fields() {
  using O = GpsOutage;
  return JsonFields<O>()
      .add("from", "last fix before the outage, or start of the recording [s]", [](const O& o) { return o.from; })
      .add("to", "first fix after the outage, or end of the recording [s]", [](const O& o) { return o.to; })
      .add("distance_m", "true distance travelled during the outage [m]",
           [](const O& o) { return o.drift ? o.distance : std::nullopt; })
      .add("drift_m", "horizontal error at the end of the outage [m]", [](const O& o) { return o.drift; })
      .add("drift_percent", "drift in percent of the distance",
           [](const O& o) { return percent_of(o.drift, o.distance); })
      .add("largest_m", "largest horizontal error during the outage [m]",
           [](const O& o) { return o.drift ? o.largest : std::nullopt; });
}

JsonFields<FinalBiases> bias_fields() {
  using B = FinalBiases;
  return JsonFields<B>()
      .add("accelerometer_m_s2", "bias of the accelerometer along its axes [m/s²]",
           [](const B& b) { return numbers(b.accelerometer); })
      .add("gyroscope_rad_s", "bias of the gyroscope about its axes [rad/s]",
           [](const B& b) { return numbers(b.gyroscope); })
      .add("accelerometer_sigma_m_s2", "standard deviation of the accelerometer's bias [m/s²]",
           [](const B& b) { return numbers(b.accelerometer_sigma); })
      .add("gyroscope_sigma_rad_s", "standard deviation of the gyroscope's bias [rad/s]",
           [](const B& b) { return numbers(b.gyroscope_sigma); });
}

using Study = NavigationStudy;
const Summary& solve_of(const Study& s) { return s.navigation.summary; }

JsonFields<Study> navigation_fields() {
  JsonFields<Study> fields;
  fields.add("scenario", "name of the scenario", [](const Study& s) { return s.scenario.name; })
      .add("frame", "frame of the scenario: ENU-FLU or NED-FRD", [](const Study& s) { return s.scenario.frame.name(); })
      .add("solver", "name of the solver", [](const Study& s) { return solve_of(s).solver; })
      .add("status", "converged, or why the solve ended", [](const Study& s) { return name(solve_of(s).status); })
      .add("message", "explanation of the status", [](const Study& s) { return solve_of(s).message; })
      .add("initial_cost", "cost of the initial guess", [](const Study& s) { return solve_of(s).initial_cost; })
      .add("cost", "final cost", [](const Study& s) { return solve_of(s).cost; })
      .add("keyframes", "number of keyframes", [](const Study& s) { return s.navigation.states.size(); })
      .add("residual_blocks", "number of residual blocks", [](const Study& s) { return s.navigation.residual_blocks; })
      .add("iterations", "number of iterations", [](const Study& s) { return solve_of(s).iterations; })
      .add("evaluations", "number of evaluations of the cost", [](const Study& s) { return solve_of(s).evaluations; })
      .add("solves", "number of solves; the numbers are those of the last one",
           [](const Study& s) { return s.navigation.solves; })
      .add("solve_seconds", "duration of the last solve [s]", [](const Study& s) { return solve_of(s).seconds; })
      .add("alignment_seconds", "duration of the data that give the initial heading [s]",
           [](const Study& s) { return s.navigation.alignment_seconds; })
      .add("seconds", "duration of the navigation [s]", [](const Study& s) { return s.navigation.seconds; })
      .add("data_seconds", "time between the first and the last keyframe [s]",
           [](const Study& s) { return data_seconds(s.navigation); })
      .add("times_real_time", "data_seconds divided by seconds",
           [](const Study& s) { return data_seconds(s.navigation) / s.navigation.seconds; })
      .add_map("sensors", "SENSOR", "use of each sensor", sensor_fields(),
               [](const Study& s) {
                 std::vector<std::pair<std::string, EgoSensorOutcome>> sensors;
                 for (const EgoSensorOutcome& o : ego_sensor_outcomes(s.navigation)) sensors.emplace_back(o.name, o);
                 return sensors;
               })
      .add("findings", "sentences about implausible or missing data",
           [](const Study& s) {
             std::vector<std::string> texts;
             for (const NavigationFinding& finding : s.navigation.findings) texts.push_back(finding.text());
             return texts;
           })
      .add("splits", "start and end of each gap of the IMU without an inertial residual [s]",
           [](const Study& s) { return s.navigation.splits; })
      .add_map("errors", "KEYFRAMES", "errors against the truth: all, and after_Ns with --after", error_fields(),
               [](const Study& s) {
                 std::vector<std::pair<std::string, Errors>> rows;
                 for (const NavigationErrorRow& row : error_rows(s))
                   rows.emplace_back(row.key, Errors{row.errors, s.scenario.frame});
                 return rows;
               })
      .add_object("error_at_the_end", "errors at the last keyframe that the truth covers", final_error_fields(),
                  [](const Study& s) -> std::optional<FinalError> {
                    const NavigationError* const last = last_compared(s);
                    if (!last) return {};
                    return FinalError{*last, s.comparison.distance};
                  })
      .add("distance_m", "true distance travelled [m]", [](const Study& s) { return s.comparison.distance; })
      .add("truth_at_antenna_of", "gps sensor at whose antenna estimate and truth are compared",
           [](const Study& s) {
             return s.comparison.antenna.empty() ? std::nullopt : std::optional(s.comparison.antenna);
           })
      .add("truth_aligned", "sentence about the alignment of the truth with the estimate",
           [](const Study& s) {
             return s.comparison.alignment.empty() ? std::nullopt : std::optional(s.comparison.alignment);
           })
      .add_list("gps_outages", "periods without GPS", outage_fields(),
                [](const Study& s) -> const std::vector<GpsOutage>& { return s.comparison.outages; })
      .add_object("bias_at_the_end", "biases of the IMU at the last keyframe", bias_fields(),
                  [](const Study& s) { return final_biases(s); })
      .add_map("fitted_delays", "SENSOR", "delays of --fit-delay", delay_fields(),
               [](const Study& s) {
                 std::vector<std::pair<std::string, DelayFit>> fits;
                 for (const DelayFit& fit : s.delays) fits.emplace_back(fit.sensor, fit);
                 return fits;
               })
      .add_map("systematic_errors", "NAME", "estimated systematic errors", systematic_error_fields(),
               [](const Study& s) { return by_name(s.navigation.constants); })
      .add("dvl_scale", "estimated scale factor of the DVL, with --dvl-scale",
           [](const Study& s) -> std::optional<double> {
             return s.navigation.dvl_scale ? std::optional(1 + *s.navigation.dvl_scale) : std::nullopt;
           })
      .add_object("fit", "agreement of the solution with the data and the stated noise", fit_fields(),
                  [](const Study& s) -> const FitReport& { return s.navigation.fit; })
      .add_list("likely_causes", "mistakes in the data that would explain misfits, the best first",
                likely_cause_fields(), [](const Study& s) -> const std::vector<LikelyCause>& { return s.causes; })
      .add("no_covariance", "why there are no covariances", [](const Study& s) {
        const std::string& why = s.navigation.why_no_covariance;
        return why.empty() ? std::nullopt : std::optional(why);
      });
  return fields;
}

}  // namespace

std::string navigation_json(const NavigationStudy& study) {
  return json_text(json_document("navigate", navigation_fields(), study));
}

FileDescription navigation_json_keys() { return describe_json("summary.json", "navigate", navigation_fields()); }

}  // namespace tandem
