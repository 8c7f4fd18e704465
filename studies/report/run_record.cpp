#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/lie/error.hpp>
#include <tandem/studies/report/run_record.hpp>
#include <tandem/studies/support/csv.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMaxRows = 6000;  // longer files are subsampled

/// Columns of a CSV file by name.
class CsvColumns {
 public:
  CsvColumns(const std::filesystem::path& folder, const std::string& name) : file_(file_in(folder, name)) {
    InputFile stream(file_);
    std::string line;
    if (!std::getline(stream, line)) throw Error(fmt::format("{} is empty", file_.string()));
    names_ = csv_cells(line);
    while (std::getline(stream, line))
      if (!line.empty()) rows_.push_back(csv_cells(line));
    for (const auto& row : rows_)
      if (row.size() != names_.size())
        throw Error(
            fmt::format("{} has a row of {} cells; its header has {}", file_.string(), row.size(), names_.size()));
    step_ = rows_.size() / kMaxRows + 1;
  }
  std::vector<std::string> texts(const std::string& name) const {
    const auto column = std::find(names_.begin(), names_.end(), name);
    if (column == names_.end()) throw Error(fmt::format("{} has no column {}", file_.string(), name));
    std::vector<std::string> cells;
    for (std::size_t i = 0; i < rows_.size(); i += step_)
      cells.push_back(rows_[i][std::size_t(column - names_.begin())]);
    return cells;
  }
  const std::vector<std::string>& names() const { return names_; }
  std::vector<double> numbers(const std::string& name) const {
    std::vector<double> values;
    for (const std::string& cell : texts(name)) values.push_back(parse_number(cell).value_or(kNone));
    return values;
  }
  RunRecord::Path path(const std::string& unit = "") const {
    return {numbers("t"), numbers("x" + unit), numbers("y" + unit), numbers("z" + unit)};
  }

 private:
  std::filesystem::path file_;
  std::vector<std::string> names_;
  std::vector<std::vector<std::string>> rows_;
  std::size_t step_ = 1;
};

RunRecord::Path read_path(const std::filesystem::path& file) {
  RunRecord::Path path;
  InputFile stream(file);
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(stream, line);) {
    if (line.empty() || line.front() == '#') continue;
    const auto cells = words(line);
    if (cells.size() < 4)
      throw Error(fmt::format("{} is not a TUM trajectory: bad line {}", file.string(), quote(line)));
    auto& row = rows.emplace_back();
    for (int i = 0; i < 4; ++i) row.push_back(parse_number(cells[std::size_t(i)]).value_or(kNone));
  }
  for (std::size_t i = 0; i < rows.size(); i += rows.size() / kMaxRows + 1) {
    path.t.push_back(rows[i][0]);
    path.x.push_back(rows[i][1]);
    path.y.push_back(rows[i][2]);
    path.z.push_back(rows[i][3]);
  }
  return path;
}

/// Returns the innovations of each sensor at the updates at which they change.
std::vector<RunRecord::Innovations> read_innovations(const std::filesystem::path& folder) {
  constexpr std::string_view kSigmas = "_sigmas";
  const CsvColumns track(folder, "track.csv");
  const std::vector<double> t = track.numbers("t");
  std::vector<RunRecord::Innovations> all;
  for (const std::string& name : track.names()) {
    if (!name.ends_with(kSigmas)) continue;
    RunRecord::Innovations& of = all.emplace_back();
    of.sensor = name.substr(0, name.size() - kSigmas.size());
    const std::vector<double> sigmas = track.numbers(name);
    for (std::size_t i = 0; i < sigmas.size(); ++i) {
      if (!std::isfinite(sigmas[i]) || (i > 0 && sigmas[i] == sigmas[i - 1])) continue;
      of.t.push_back(t[i]);
      of.sigmas.push_back(sigmas[i]);
    }
  }
  return all;
}

void shift(std::vector<double>& t, double by) {
  for (double& value : t) value -= by;
}

std::string mean_std_text(const nlohmann::json& of, const std::string& key, const std::string& unit) {
  const std::string mean = key + "_mean_" + unit, std = key + "_std_" + unit;
  if (!of.contains(mean)) return "–";
  const std::string text = fmt::format("{:.3f}", of[mean].get<double>());
  return of.contains(std) ? fmt::format("{} ± {:.3f}", text, of[std].get<double>()) : text;
}

void read_summary(const std::filesystem::path& file, RunRecord& run) try {
  const nlohmann::json json = nlohmann::json::parse(read_text(file));
  run.scenario = json.value("scenario", "");
  run.model = json.value("model", "");
  if (json.contains("mode"))
    run.model += fmt::format("{}mode {}", run.model.empty() ? "" : ", ", json.value("mode", ""));
  run.solver = json.value("solver", "");
  run.status = json.value("status", "");
  if (!json.contains("errors")) return;
  const auto n_of = [&](const char* type) {
    return json["errors"].contains(type) ? json["errors"][type].value("n", 0.0) : 0.0;
  };
  // As in the table of the command: a mean of raw errors compares only if all keyframes have measurements.
  const bool all_measured = n_of("partial") + n_of("none") == 0;
  for (const char* type : {"position", "pose", "partial", "none", "all"})
    if (n_of(type) > 0) {
      const auto& of = json["errors"][type];
      const bool comparable = std::string_view(type) != "all" || all_measured;
      run.table.push_back({type, fmt::format("{:.0f}", of.value("n", 0.0)), mean_std_text(of, "position", "m"),
                           mean_std_text(of, "orientation", "deg"),
                           comparable ? mean_std_text(of, "raw_position", "m") : "–"});
    }
} catch (const nlohmann::json::exception&) {
  throw Error(fmt::format("{} is damaged or was not written by tandem", file.string()));
}

}  // namespace

bool is_run(const std::filesystem::path& folder) {
  for (const char* file : {"summary.json", "chaser.tum", "errors.csv"})
    if (!std::filesystem::exists(folder / file)) return false;
  return true;
}

RunRecord read_run(const std::filesystem::path& folder) {
  RunRecord run;
  read_summary(file_in(folder, "summary.json"), run);
  for (const auto& [name, path] : {std::pair{"chaser", &run.chaser},
                                   {"target", &run.target},
                                   {"chaser_truth", &run.chaser_truth},
                                   {"target_truth", &run.target_truth}}) {
    const std::string tum = fmt::format("{}.tum", name), full = fmt::format("{}_full.csv", name);
    if (std::filesystem::exists(folder / full))  // also has point targets
      *path = CsvColumns(folder, full).path();
    else if (std::filesystem::exists(folder / tum))
      *path = read_path(file_in(folder, tum));
  }
  for (const char* file : {"target_fixes.csv", "chaser_fixes.csv"}) {
    if (!std::filesystem::exists(folder / file)) continue;
    const CsvColumns fixes(folder, file);
    run.fixes = fixes.path("_m");
    run.fix_sensors = fixes.texts("sensor");
    break;
  }
  if (std::filesystem::exists(folder / "track.csv")) run.innovations = read_innovations(folder);
  const CsvColumns errors(folder, "errors.csv");
  run.t = errors.numbers("t");
  run.position_error = errors.numbers("position_error_m");
  run.orientation_error = errors.numbers("orientation_error_deg");
  if (run.has_target())
    run.types = errors.texts("type");
  else  // there are no raw errors of the chaser
    for (std::vector<std::string>& row : run.table) row.pop_back();
  for (std::size_t i = 0; i < 3; ++i) {
    const char axis = "xyz"[i];
    run.error[i] = errors.numbers(fmt::format("error_{}_m", axis));
    run.three_sigma[i] = errors.numbers(fmt::format("three_sigma_{}_m", axis));
  }
  const double begin = run.chaser.t.empty() ? 0 : run.chaser.t.front();
  for (std::vector<double>* t :
       {&run.t, &run.chaser.t, &run.target.t, &run.chaser_truth.t, &run.target_truth.t, &run.fixes.t})
    shift(*t, begin);
  for (RunRecord::Innovations& of : run.innovations) shift(of.t, begin);
  return run;
}

}  // namespace tandem
