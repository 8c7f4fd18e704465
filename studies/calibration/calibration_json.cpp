#include <set>

#include <fmt/format.h>

#include <tandem/studies/calibration/calibration_report.hpp>
#include <tandem/studies/navigation/systematic_error_estimates_json.hpp>

namespace tandem {
namespace {

JsonFields<CalibratedParameter> parameter_fields() {
  using P = CalibratedParameter;
  return JsonFields<P>()
      .add("name", "component of the noise of a sensor or of another noise entry", [](const P& p) { return p.name; })
      .add("given", "given standard deviation, in the units of scenario.yaml", [](const P& p) { return p.given; })
      .add("found", "estimate, which maximises the marginal likelihood", [](const P& p) { return p.found(); })
      .add("standard_error", "standard error of the estimate",
           [](const P& p) { return p.found() * p.result.log_error; })
      .add("gain", "increase of the log evidence by this parameter alone", [](const P& p) { return p.result.gain; })
      .add("identifiable", "whether the evidence falls on both sides of the estimate",
           [](const P& p) { return p.result.identifiable; })
      .add("bounded", "whether the evidence bounds the parameter on one side only",
           [](const P& p) { return p.result.bounded; })
      .add("given_kept", "whether the given value is kept, because the estimate cannot be accepted",
           [](const P& p) { return p.keep_reason != KeepReason::none; })
      .add("at_bound", "whether the estimate ran to the limit, a factor of 1000",
           [](const P& p) { return p.result.at_limit; })
      .add("rows", "number of residual rows", [](const P& p) { return p.result.rows; })
      .add("effective_rows", "degrees of freedom: rows minus the share that the estimated states absorb",
           [](const P& p) { return p.result.effective_rows; })
      .add("flat_from", "lower end of the range in which the log profile evidence is within 2 of its maximum",
           [](const P& p) { return p.given * p.result.flat_from; })
      .add("flat_to", "upper end of that range", [](const P& p) { return p.given * p.result.flat_to; });
}

JsonFields<SystematicErrorEstimate::HeldOut> held_out_gain_fields() {
  using H = SystematicErrorEstimate::HeldOut;
  return JsonFields<H>()
      .add("gain", "increase of the log-likelihood of held-out measurements by the constant",
           [](const H& h) { return h.gain; })
      .add("gain_error", "its standard error", [](const H& h) { return h.error; });
}

JsonFields<CalibratedConstant> constant_fields() {
  using C = CalibratedConstant;
  return JsonFields<C>()
      .add("scenario", "name of the scenario", [](const C& c) { return c.scenario; })
      .add_all(systematic_error_fields(), [](const C& c) -> const SystematicErrorEstimate& { return c.found; })
      .add_object("held_out", "cross-validation of the constant, if done", held_out_gain_fields(),
                  [](const C& c) { return c.found.held_out; });
}

struct Residuals {
  const Misfit &given, &found;
};

JsonFields<Misfit> misfit_fields() {
  using M = Misfit;
  return JsonFields<M>()
      .add("n", "number of residuals", [](const M& m) { return m.value.size(); })
      .add("down_weighted", "number of residuals not counted, since a robust loss gives them a weight below 0.5",
           [](const M& m) { return m.down_weighted; })
      .add("mean", "mean; 0 if white", [](const M& m) { return m.mean(); })
      .add("spread", "standard deviation; 1 if white", [](const M& m) { return m.standard_deviation(); })
      .add("correlation", "autocorrelation at lag 1; 0 if white", [](const M& m) { return m.correlation(); })
      .add("correlation_time", "correlation time [s]; 0 if not significant",
           [](const M& m) { return m.correlation_time(); });
}

JsonFields<Residuals> residual_fields() {
  using R = Residuals;
  return JsonFields<R>()
      .add("scenario", "name of the scenario", [](const R& r) { return r.found.scenario; })
      .add("parameter", "component of the sensor", [](const R& r) { return r.found.parameter; })
      .add_object("given", "standardised residuals with the given noise", misfit_fields(),
                  [](const R& r) -> const Misfit& { return r.given; })
      .add_object("found", "standardised residuals with the calibrated noise", misfit_fields(),
                  [](const R& r) -> const Misfit& { return r.found; })
      .add("diagnosis", "sentence on deviations from white noise; empty if there are none",
           [](const R& r) { return r.found.diagnosis(); });
}

JsonFields<HeldOutScore> score_fields() {
  using S = HeldOutScore;
  return JsonFields<S>()
      .add("scenario", "name of the scenario", [](const S& s) { return s.scenario; })
      .add("measurements", "number of held-out measurements", [](const S& s) { return s.measurements; })
      .add("given", "mean log-likelihood of a measurement with the given noise", [](const S& s) { return s.given; })
      .add("found", "mean log-likelihood of a measurement with the calibrated noise",
           [](const S& s) { return s.found; });
}

JsonFields<ScenarioCalibration> held_out_fields() {
  using C = ScenarioCalibration;
  return JsonFields<C>()
      .add("folds", "number of folds; 0: none", [](const C& c) { return c.folds; })
      .add("gain", "increase of the log-likelihood of held-out measurements by the calibrated noise",
           [](const C& c) { return c.gain; })
      .add("gain_error", "its standard error", [](const C& c) { return c.gain_error; })
      .add("recommended", "whether the calibrated noise predicts better", [](const C& c) { return c.recommended(); })
      .add("why_not", "why the cross-validation failed; empty if it did not",
           [](const C& c) { return c.why_not_validated; })
      .add_list("scenarios", "results by scenario", score_fields(),
                [](const C& c) -> const std::vector<HeldOutScore>& { return c.scores; });
}

std::vector<std::pair<std::string, CalibratedConstant>> constants_by_name(const ScenarioCalibration& c) {
  std::vector<std::pair<std::string, CalibratedConstant>> named;
  std::set<std::string> names;
  for (const CalibratedConstant& constant : c.constants) {
    std::string name = display_name(c, constant);
    for (int k = 2; names.contains(name); ++k)  // scenarios with the same name
      name = fmt::format("{} ({})", display_name(c, constant), k);
    names.insert(name);
    named.emplace_back(name, constant);
  }
  return named;
}

std::vector<Residuals> residuals(const ScenarioCalibration& c) {
  std::vector<Residuals> result;
  for (std::size_t i = 0; i < c.after.size() && i < c.before.size(); ++i) result.push_back({c.before[i], c.after[i]});
  return result;
}

nlohmann::ordered_json entries_json(const std::vector<NoiseEntry>& entries) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const NoiseEntry& entry : entries) json[entry.name] = entry.sigmas;
  return json;
}

JsonFields<ScenarioCalibration> calibration_fields() {
  using C = ScenarioCalibration;
  return JsonFields<C>()
      .add("scenarios", "names of the scenarios", [](const C& c) { return c.scenarios; })
      .add("status", "converged, or why the search ended", [](const C& c) { return name(c.summary.status); })
      .add("message", "explanation of the status", [](const C& c) { return c.summary.message; })
      .add("evidence_gain", "increase of the log evidence by all parameters", [](const C& c) { return c.summary.gain; })
      .add("iterations", "number of iterations", [](const C& c) { return c.summary.iterations; })
      .add("solves", "number of solves", [](const C& c) { return c.summary.solves; })
      .add("seconds", "duration [s]", [](const C& c) { return c.seconds; })
      .add_list("parameters", "calibrated parameters", parameter_fields(),
                [](const C& c) -> const std::vector<CalibratedParameter>& { return c.parameters; })
      .add_map("systematic_errors", "NAME",
               "constant systematic errors; of several recordings, NAME is \"NAME of SCENARIO\"", constant_fields(),
               constants_by_name)
      .add_list("residuals", "statistics of the standardised residuals", residual_fields(), residuals)
      .add_object("held_out", "cross-validation of the noise", held_out_fields(),
                  [](const C& c) -> const C& { return c; })
      .add("notes", "sentences on parameters without calibration or cross-validation",
           [](const C& c) { return c.notes; })
      .add("noise", "noise entries with calibrated values where recommended; by name, one number per component",
           [](const C& c) { return entries_json(c.noise); })
      .add("given_noise", "given noise entries", [](const C& c) { return entries_json(c.given_noise); });
}

}  // namespace

std::string calibration_json(const ScenarioCalibration& calibration) {
  return json_text(json_document("calibrate", calibration_fields(), calibration));
}

FileDescription calibration_json_keys() { return describe_json("summary.json", "calibrate", calibration_fields()); }

}  // namespace tandem
