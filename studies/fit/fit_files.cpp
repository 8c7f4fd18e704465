#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/fit/fit_files.hpp>
#include <tandem/studies/support/csv.hpp>
#include <tandem/studies/support/output_file.hpp>

namespace tandem {
namespace {

constexpr const char* kFile = "fit_residuals.csv";

struct ResidualRow {
  const SensorFit& sensor;
  std::optional<std::size_t> component;
  double t;
  std::optional<double> residual;
  const char* outcome;
};

CsvTable<ResidualRow> residual_columns() {
  return CsvTable<ResidualRow>()
      .add("sensor", "name of the sensor", [](const ResidualRow& r) { return r.sensor.name; })
      .add("component", "component of the measurement, for example x or range; empty if rejected",
           [](const ResidualRow& r) { return r.component ? CsvCell(r.sensor.components[*r.component]) : CsvCell(); })
      .add("t", "stamp of the measurement [s]", [](const ResidualRow& r) { return r.t; })
      .add("residual", "residual in expected standard deviations; empty if rejected",
           [](const ResidualRow& r) { return r.residual ? CsvCell::rounded(*r.residual, 6) : CsvCell(); })
      .add("outcome",
           "used; down-weighted: the robust loss leaves a weight below 0.5; rejected: not in the problem, since it "
           "contradicts the others",
           [](const ResidualRow& r) { return r.outcome; });
}

}  // namespace

void write_fit(const FitReport& fit, const std::filesystem::path& folder) {
  std::vector<ResidualRow> rows;
  for (const SensorFit& sensor : fit.sensors) {
    for (const auto& [all, outcome] :
         {std::pair{&sensor.series, "used"}, {&sensor.down_weighted_series, "down-weighted"}})
      for (std::size_t c = 0; c < all->size(); ++c)
        for (std::size_t i = 0; i < (*all)[c].t.size(); ++i)
          rows.push_back({sensor, c, (*all)[c].t[i], (*all)[c].value[i], outcome});
    for (const double t : sensor.rejected_at) rows.push_back({sensor, {}, t, {}, "rejected"});
  }
  write_file(folder / kFile, residual_columns().text(rows));
}

FileDescription fit_file_columns() { return residual_columns().describe(kFile); }

}  // namespace tandem
