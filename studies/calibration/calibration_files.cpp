#include <tandem/studies/calibration/calibration_files.hpp>
#include <tandem/studies/calibration/calibration_report.hpp>
#include <tandem/studies/support/output_file.hpp>

namespace tandem {
namespace {

struct EvidenceRow {
  const CalibratedParameter& parameter;
  double factor, log_evidence;
};
struct ConstantEvidenceRow {
  const CalibratedConstant& constant;
  double value, log_evidence;
};
struct ResidualRow {
  const Misfit& misfit;
  const char* noise;
  std::size_t at;
};

struct CorrelationRow {
  const Autocorrelation& of;
  const char* noise;
  std::size_t lag;
};
constexpr std::size_t kLags = 25;

CsvTable<CorrelationRow> correlation_columns() {
  CsvTable<CorrelationRow> table;
  table
      .add("parameter", "component of the sensor, pooled over all scenarios",
           [](const CorrelationRow& r) { return r.of.parameter; })
      .add("noise", "given or found: the noise used", [](const CorrelationRow& r) { return r.noise; })
      .add("lag", "lag in measurements", [](const CorrelationRow& r) { return r.lag; })
      .add("correlation", "autocorrelation of the standardised residuals at this lag",
           [](const CorrelationRow& r) { return r.of.values[r.lag]; });
  return table;
}

CsvTable<CalibratedParameter> parameter_columns() {
  using Row = CalibratedParameter;
  CsvTable<Row> table;
  table
      .add("parameter", "component of the noise of a sensor or of another noise entry",
           [](const Row& r) { return r.name; })
      .add("given", "given standard deviation, in the units of scenario.yaml", [](const Row& r) { return r.given; })
      .add("found", "estimate, which maximises the marginal likelihood", [](const Row& r) { return r.found(); })
      .add("standard_error", "standard error of the estimate",
           [](const Row& r) { return r.found() * r.result.log_error; })
      .add("identifiable",
           "1: identifiable, the evidence falls on both sides; 0: not identifiable, or bounded on one side only",
           [](const Row& r) { return int(r.result.identifiable); })
      .add("flat_from", "lower end of the range in which the log profile evidence is within 2 of its maximum",
           [](const Row& r) { return r.given * r.result.flat_from; })
      .add("flat_to", "upper end of this range", [](const Row& r) { return r.given * r.result.flat_to; })
      .add("gain", "increase of the log evidence by this parameter alone", [](const Row& r) { return r.result.gain; });
  return table;
}

CsvTable<EvidenceRow> evidence_columns() {
  CsvTable<EvidenceRow> table;
  table.add("parameter", "as in parameters.csv", [](const EvidenceRow& r) { return r.parameter.name; })
      .add("sigma", "value of the parameter; the others stay at their estimates",
           [](const EvidenceRow& r) { return r.parameter.given * r.factor; })
      .add("log_evidence", "log evidence of the data minus that at the estimate",
           [](const EvidenceRow& r) { return r.log_evidence; });
  return table;
}

CsvTable<CalibratedConstant> constant_columns() {
  using Row = CalibratedConstant;
  CsvTable<Row> table;
  table.add("scenario", "name of the scenario", [](const Row& r) { return r.scenario; })
      .add("constant", "constant systematic error", [](const Row& r) { return r.found.name; })
      .add("given_sigma", "standard deviation of its prior, whose mean is 0",
           [](const Row& r) { return r.found.prior_sigma; })
      .add("value", "estimate", [](const Row& r) { return r.found.value; })
      .add("sigma", "standard error of the estimate", [](const Row& r) { return r.found.sigma; })
      .add("verdict", "verdict as in the printed table",
           [](const Row& r) { return std::string(text(r.found.verdict())); });
  return table;
}

CsvTable<ConstantEvidenceRow> constant_evidence_columns() {
  using Row = ConstantEvidenceRow;
  CsvTable<Row> table;
  table.add("scenario", "as in constants.csv", [](const Row& r) { return r.constant.scenario; })
      .add("constant", "scalar constant of constants.csv", [](const Row& r) { return r.constant.found.name; })
      .add("value", "value of the constant; all other unknowns are re-estimated", [](const Row& r) { return r.value; })
      .add("log_evidence", "log evidence of the data minus that at the estimate",
           [](const Row& r) { return r.log_evidence; });
  return table;
}

CsvTable<ResidualRow> residual_columns() {
  CsvTable<ResidualRow> table;
  table.add("scenario", "name of the scenario", [](const ResidualRow& r) { return r.misfit.scenario; })
      .add("parameter", "component of the sensor", [](const ResidualRow& r) { return r.misfit.parameter; })
      .add("noise", "given or found: the noise used", [](const ResidualRow& r) { return r.noise; })
      .add("t", "time stamp of the measurement [s]", [](const ResidualRow& r) { return r.misfit.t[r.at]; })
      .add("standardised", "residual divided by its expected standard deviation",
           [](const ResidualRow& r) { return r.misfit.value[r.at]; });
  return table;
}

}  // namespace

void write_results(const ScenarioCalibration& c, const std::filesystem::path& folder) {
  write_file(folder / "summary.json", calibration_json(c));
  write_file(folder / "parameters.csv", parameter_columns().text(c.parameters));
  std::vector<EvidenceRow> evidence;
  for (const CalibratedParameter& p : c.parameters)
    for (const auto& [factor, value] : p.result.profile) evidence.push_back({p, factor, value});
  write_file(folder / "evidence.csv", evidence_columns().text(evidence));
  if (!c.constants.empty()) {
    write_file(folder / "constants.csv", constant_columns().text(c.constants));
    std::vector<ConstantEvidenceRow> profiles;
    for (const CalibratedConstant& constant : c.constants)
      for (const auto& [at, value] : constant.profile) profiles.push_back({constant, at, value});
    if (!profiles.empty()) write_file(folder / "constants_evidence.csv", constant_evidence_columns().text(profiles));
  }
  std::vector<ResidualRow> residuals;
  for (const auto& [noise, misfits] : {std::pair{"given", &c.before}, {"found", &c.after}})
    for (const Misfit& m : *misfits)
      for (std::size_t i = 0; i < m.value.size(); ++i) residuals.push_back({m, noise, i});
  write_file(folder / "residuals.csv", residual_columns().text(residuals));
  const auto before = autocorrelations(c.before, kLags), after = autocorrelations(c.after, kLags);
  std::vector<CorrelationRow> correlations;
  for (const auto& [noise, all] : {std::pair{"given", &before}, {"found", &after}})
    for (const Autocorrelation& of : *all)
      for (std::size_t lag = 0; lag < of.values.size(); ++lag) correlations.push_back({of, noise, lag});
  write_file(folder / "autocorrelation.csv", correlation_columns().text(correlations));
}

std::vector<FileDescription> calibration_file_columns() {
  return {
      parameter_columns().describe("parameters.csv"), evidence_columns().describe("evidence.csv"),
      constant_columns().describe("constants.csv"),   constant_evidence_columns().describe("constants_evidence.csv"),
      residual_columns().describe("residuals.csv"),   correlation_columns().describe("autocorrelation.csv")};
}

}  // namespace tandem
