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
      .add("parameter", "the component of the sensor, in all scenarios",
           [](const CorrelationRow& r) { return r.of.parameter; })
      .add("noise", "given or found: by which noise", [](const CorrelationRow& r) { return r.noise; })
      .add("lag", "measurements from one to the other", [](const CorrelationRow& r) { return r.lag; })
      .add("correlation", "of standardised residuals so far apart",
           [](const CorrelationRow& r) { return r.of.values[r.lag]; });
  return table;
}

CsvTable<CalibratedParameter> parameter_columns() {
  using Row = CalibratedParameter;
  CsvTable<Row> table;
  table.add("parameter", "a component of a sensor's, or another, noise", [](const Row& r) { return r.name; })
      .add("given", "its standard deviation as given, in the units of scenario.yaml",
           [](const Row& r) { return r.given; })
      .add("found", "that which makes the data likeliest", [](const Row& r) { return r.found(); })
      .add("standard_error", "of that", [](const Row& r) { return r.found() * r.result.log_error; })
      .add("determined",
           "1: by the data, whose evidence falls to both sides; 0: they do not tell it, or bound it to one side alone",
           [](const Row& r) { return int(r.result.determined); })
      .add("flat_from", "from here the evidence is less than 2 below its greatest, the others as found",
           [](const Row& r) { return r.given * r.result.flat_from; })
      .add("flat_to", "to here", [](const Row& r) { return r.given * r.result.flat_to; })
      .add("gain", "of the logarithm of the evidence by it alone", [](const Row& r) { return r.result.gain; });
  return table;
}

CsvTable<EvidenceRow> evidence_columns() {
  CsvTable<EvidenceRow> table;
  table.add("parameter", "as in parameters.csv", [](const EvidenceRow& r) { return r.parameter.name; })
      .add("sigma", "a standard deviation, the others as found",
           [](const EvidenceRow& r) { return r.parameter.given * r.factor; })
      .add("log_evidence", "of the data there, against what was found",
           [](const EvidenceRow& r) { return r.log_evidence; });
  return table;
}

CsvTable<CalibratedConstant> constant_columns() {
  using Row = CalibratedConstant;
  CsvTable<Row> table;
  table.add("scenario", "its name", [](const Row& r) { return r.scenario; })
      .add("constant", "of an error that stays", [](const Row& r) { return r.found.name; })
      .add("given_sigma", "its standard deviation around 0 as given", [](const Row& r) { return r.found.given; })
      .add("value", "that was found", [](const Row& r) { return r.found.value; })
      .add("sigma", "standard error of that", [](const Row& r) { return r.found.deviation; })
      .add("verdict", "as in the table", [](const Row& r) { return std::string(text(r.found.verdict())); });
  return table;
}

CsvTable<ConstantEvidenceRow> constant_evidence_columns() {
  using Row = ConstantEvidenceRow;
  CsvTable<Row> table;
  table.add("scenario", "as in constants.csv", [](const Row& r) { return r.constant.scenario; })
      .add("constant", "of those that are one number", [](const Row& r) { return r.constant.found.name; })
      .add("value", "of it, all else as likeliest", [](const Row& r) { return r.value; })
      .add("log_evidence", "of the data there, against what was found", [](const Row& r) { return r.log_evidence; });
  return table;
}

CsvTable<ResidualRow> residual_columns() {
  CsvTable<ResidualRow> table;
  table.add("scenario", "its name", [](const ResidualRow& r) { return r.misfit.scenario; })
      .add("parameter", "the component of the sensor", [](const ResidualRow& r) { return r.misfit.parameter; })
      .add("noise", "given or found: by which noise", [](const ResidualRow& r) { return r.noise; })
      .add("t", "of the measurement, as stamped [s]", [](const ResidualRow& r) { return r.misfit.t[r.at]; })
      .add("standardised", "residual by the standard deviation that it should have there",
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
    std::vector<ConstantEvidenceRow> along;
    for (const CalibratedConstant& constant : c.constants)
      for (const auto& [at, value] : constant.profile) along.push_back({constant, at, value});
    if (!along.empty()) write_file(folder / "constants_evidence.csv", constant_evidence_columns().text(along));
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

std::vector<CsvDescription> calibration_file_columns() {
  return {
      parameter_columns().describe("parameters.csv"), evidence_columns().describe("evidence.csv"),
      constant_columns().describe("constants.csv"),   constant_evidence_columns().describe("constants_evidence.csv"),
      residual_columns().describe("residuals.csv"),   correlation_columns().describe("autocorrelation.csv")};
}

}  // namespace tandem
