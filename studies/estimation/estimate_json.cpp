#include <tandem/studies/estimation/error_fields.hpp>
#include <tandem/studies/estimation/estimate_report_parts.hpp>
#include <tandem/studies/estimation/unobservable_text.hpp>
#include <tandem/studies/fit/fit_text.hpp>
#include <tandem/studies/navigation/fit_delay_json.hpp>
#include <tandem/studies/navigation/systematic_error_estimates_json.hpp>

namespace tandem {
namespace {

template <class T>
using Named = std::vector<std::pair<std::string, T>>;

std::optional<std::string> if_given(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(text);
}

JsonFields<SensorOutcome> sensor_fields() {
  using S = SensorOutcome;
  JsonFields<S> fields;
  fields.add("type", "type of the sensor", [](const S& s) { return name(s.type); })
      .add("used", "number of measurements used", [](const S& s) { return s.used; })
      .add("held_out", "number of measurements held out", [](const S& s) { return s.held_out; })
      .add("discarded", "number of measurements discarded, since they are not within the time of the odometry",
           [](const S& s) { return s.discarded; })
      .add("down_weighted", "number of measurements that the robust loss gives a weight below 0.5",
           [](const S& s) { return s.down_weighted; });
  add_mean_std(fields, "raw_position", "m", "position error of its measurements [m]",
               [](const S& s) { return s.raw_position; });
  return fields;
}

JsonFields<EgoSensorUse> ego_sensor_fields() {
  using S = EgoSensorUse;
  return JsonFields<S>()
      .add("used", "number of measurements used", [](const S& s) { return s.used; })
      .add("discarded", "number of measurements discarded", [](const S& s) { return s.discarded; });
}

JsonFields<Coverage> coverage_fields() {
  using C = Coverage;
  const auto percent = [](int part, int whole) {
    return whole > 0 ? std::optional(100.0 * part / whole) : std::nullopt;
  };
  return JsonFields<C>()
      .add("n", "number of held-out measurements", [](const C& c) { return c.n; })
      .add("inliers_known", "false: all measurements count as inliers, since the solve with all did not converge",
           [](const C& c) { return c.inliers_known; })
      .add("inliers", "number of inliers, which have a weight of 0.5 or more in a solve with all measurements",
           [](const C& c) { return c.inliers; })
      .add("inlier_rows_in_95_percent", "share of the inliers' residual rows within their 95 % intervals [%]",
           [percent](const C& c) { return percent(c.rows_inside, c.rows); })
      .add("inliers_in_95_percent", "share of the inliers within their joint 95 % regions [%]",
           [percent](const C& c) { return percent(c.inside, c.inliers); });
}

JsonFields<SuspectedOutlier> suspect_fields() {
  using S = SuspectedOutlier;
  return JsonFields<S>()
      .add("sensor", "name of the sensor", [](const S& s) { return s.sensor; })
      .add("t", "stamp of the measurement [s]", [](const S& s) { return s.t; })
      .add("sigmas", "distance from the position that all other measurements give, in standard deviations",
           [](const S& s) { return s.sigmas; });
}

JsonFields<Estimate> estimate_fields() {
  using E = Estimate;
  return JsonFields<E>()
      .add("scenario", "name of the scenario", [](const E& e) { return e.scenario; })
      .add("frame", "frame of the scenario: ENU-FLU or NED-FRD", [](const E& e) { return e.frame.name(); })
      .add("model", "motion model of the target", [](const E& e) { return name(e.options.model); })
      .add("mode", "A or B", [](const E& e) { return name(e.options.mode); })
      .add("solver", "name of the solver", [](const E& e) { return e.summary.solver; })
      .add("status", "converged, or why the solve ended", [](const E& e) { return name(e.summary.status); })
      .add("message", "explanation of the status", [](const E& e) { return e.summary.message; })
      .add("unobservable", "unobservable states; their standard deviations are infinite",
           [](const E& e) { return if_given(state_names(e.summary.unobservable)); })
      .add("initial_cost", "cost of the initial guess", [](const E& e) { return e.summary.initial_cost; })
      .add("cost", "final cost", [](const E& e) { return e.summary.cost; })
      .add("keyframes", "number of keyframes", [](const E& e) { return e.keyframes.size(); })
      .add("residual_blocks", "number of residual blocks", [](const E& e) { return e.residual_blocks; })
      .add("iterations", "number of iterations", [](const E& e) { return e.summary.iterations; })
      .add("evaluations", "number of evaluations of the cost", [](const E& e) { return e.summary.evaluations; })
      .add("solve_seconds", "duration of the solve [s]", [](const E& e) { return e.summary.seconds; })
      .add("max_violation", "largest violation of a hard constraint, in its own unit",
           [](const E& e) { return e.summary.max_violation; })
      .add_map("errors", "TYPE",
               "errors by the measurement at the keyframe: position, pose, partial, none; and at all keyframes",
               error_fields(),
               [](const E& e) {
                 Named<ErrorSummary> errors;
                 for (const EstimateErrorRow& row : error_rows(e)) errors.emplace_back(row.type, row.errors);
                 return errors;
               })
      .add_map("sensors", "SENSOR", "use of each target sensor", sensor_fields(),
               [](const E& e) {
                 Named<SensorOutcome> sensors;
                 for (const SensorOutcome& s : e.sensors) sensors.emplace_back(s.name, s);
                 return sensors;
               })
      .add_map("ego_sensors", "SENSOR", "use of each of the chaser's own sensors", ego_sensor_fields(),
               [](const E& e) {
                 Named<EgoSensorUse> sensors;
                 for (const EgoSensorUse& s : e.ego_sensors) sensors.emplace_back(s.name, s);
                 return sensors;
               })
      .add("findings", "sentences about implausible or missing data and about unobservable states",
           [](const E& e) {
             std::vector<std::string> texts;
             for (const NavigationFinding& finding : e.findings) texts.push_back(finding.text());
             if (!e.summary.unobservable.empty()) texts.push_back(unobservable_text(e));
             return texts;
           })
      .add("dvl_scale", "estimated scale factor of the DVL, with --dvl-scale",
           [](const E& e) { return e.dvl_scale ? std::optional(1 + *e.dvl_scale) : std::nullopt; })
      .add("splits", "start and end of each gap of the IMU without an inertial residual [s]",
           [](const E& e) { return e.splits; })
      .add_map("held_out", "SENSOR", "with --hold-out: coverage of the held-out measurements, by sensor and of all",
               coverage_fields(),
               [](const E& e) {
                 Named<Coverage> named;
                 if (!e.held_out.empty())
                   for (const Coverage& c : coverages(e)) named.emplace_back(c.name, c);
                 return named;
               })
      .add_map("fitted_delays", "SENSOR", "delays of --fit-delay", delay_fields(),
               [](const E& e) {
                 Named<DelayFit> fits;
                 for (const DelayFit& fit : e.delays) fits.emplace_back(fit.sensor, fit);
                 return fits;
               })
      .add_map("systematic_errors", "NAME", "estimated systematic errors", systematic_error_fields(),
               [](const E& e) { return by_name(e.constants); })
      .add_object("fit", "agreement of the solution with the data and the stated noise", fit_fields(),
                  [](const E& e) -> const FitReport& { return e.fit; })
      .add_list("likely_causes", "mistakes in the data that would explain misfits, the best first by sensor",
                likely_cause_fields(), [](const E& e) -> const std::vector<LikelyCause>& { return e.causes; })
      .add_list("suspects", "suspected outliers, worst first", suspect_fields(),
                [](const E& e) -> const std::vector<SuspectedOutlier>& { return e.suspects; })
      .add("unmeasured_orientation", "a sentence if the target has an orientation that no sensor measures",
           [](const E& e) { return if_given(e.unmeasured_orientation); })
      .add("target_error_in_world_m",
           "mean distance of the target from its truth in the world, if only the target has a truth [m]",
           [](const E& e) {
             return e.target_error_in_world ? std::optional(e.target_error_in_world->mean) : std::nullopt;
           })
      .add("contradiction", "warning that motion limits contradict the data",
           [](const E& e) { return if_given(e.contradiction); })
      .add("overconfident_nees", "mean NEES of the relative position, if it is above 27; 3 if consistent",
           [](const E& e) { return overconfident_nees(e); })
      .add("no_covariance", "why there are no covariances", [](const E& e) { return if_given(e.why_no_uncertainty); });
}

}  // namespace

std::string summary_json(const Estimate& estimate) {
  return json_text(json_document("estimate", estimate_fields(), estimate));
}

FileDescription summary_json_keys() { return describe_json("summary.json", "estimate", estimate_fields()); }

}  // namespace tandem
