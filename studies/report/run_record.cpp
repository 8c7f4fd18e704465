#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/report/run_record.hpp>
#include <tandem/studies/support/csv.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>
#include <tandem/studies/support/tum.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMaxRows = 6000;  // longer columns are thinned

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
  }
  std::vector<std::string> texts(const std::string& name) const {
    const auto column = std::find(names_.begin(), names_.end(), name);
    if (column == names_.end()) throw Error(fmt::format("{} has no column {}", file_.string(), name));
    std::vector<std::string> cells;
    for (const auto& row : rows_) cells.push_back(row[std::size_t(column - names_.begin())]);
    return cells;
  }
  bool has(const std::string& name) const { return std::find(names_.begin(), names_.end(), name) != names_.end(); }
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
};

/// A trajectory with the orientations and covariances that the file has.
struct Trajectory {
  RunRecord::Path path;
  std::vector<Eigen::Quaterniond> orientation;  ///< NaN for a point
  std::vector<Eigen::Matrix<double, 6, 6>> covariance;
};

Eigen::Quaterniond quaternion(double x, double y, double z, double w) { return {w, x, y, z}; }

Trajectory read_tum(const std::filesystem::path& file) {
  Trajectory read;
  InputFile stream(file);
  bool oriented = true;  // the next row
  for (std::string line; std::getline(stream, line);) {
    if (trimmed(line) == tum_no_orientation) oriented = false;
    if (line.empty() || line.front() == '#') continue;
    const auto cells = words(line);
    if (cells.size() < 4)
      throw Error(fmt::format("{} is not a TUM trajectory: bad line {}", file.string(), quote(line)));
    const auto cell = [&](std::size_t i) { return i < cells.size() ? parse_number(cells[i]).value_or(kNone) : kNone; };
    for (const auto& [column, i] :
         {std::pair{&read.path.t, 0}, {&read.path.x, 1}, {&read.path.y, 2}, {&read.path.z, 3}})
      column->push_back(cell(std::size_t(i)));
    const bool known = std::exchange(oriented, true);
    read.orientation.push_back(known ? quaternion(cell(4), cell(5), cell(6), cell(7))
                                     : quaternion(kNone, kNone, kNone, kNone));
  }
  return read;
}

Trajectory read_full(const CsvColumns& file) {
  Trajectory read{file.path(), {}, {}};
  if (file.has("qw")) {
    const auto x = file.numbers("qx"), y = file.numbers("qy"), z = file.numbers("qz"), w = file.numbers("qw");
    for (std::size_t k = 0; k < x.size(); ++k) read.orientation.push_back(quaternion(x[k], y[k], z[k], w[k]));
  }
  if (!file.has("c11")) return read;
  read.covariance.resize(read.path.t.size());
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      const std::vector<double> entries = file.numbers(fmt::format("c{}{}", i + 1, j + 1));
      for (std::size_t k = 0; k < entries.size(); ++k) read.covariance[k](i, j) = entries[k];
    }
  return read;
}

bool any_positive(const std::vector<double>& values) {
  return std::any_of(values.begin(), values.end(), [](double v) { return std::isfinite(v) && v > 1e-9; });
}

constexpr double kUndetermined = 180;  // deg: larger standard deviations of angles mean nothing

/// Adds the curve if it has a value other than zero.
void add_curve(std::vector<RunRecord::Curve>& curves, RunRecord::Curve curve) {
  if (any_positive(curve.value)) curves.push_back(std::move(curve));
}

void add_rotation_sigma(RunRecord::Curve curve, RunRecord& run) {
  for (double& v : curve.value)
    if (v > kUndetermined) v = kNone;
  add_curve(run.rotation_sigma, std::move(curve));
}

/// Adds the standard deviations in the world: horizontal and vertical position, and heading. The covariance of a pose is
/// along the body axes, that of a point along the world's.
void add_sigmas(const std::string& who, const Trajectory& of, RunRecord& run) {
  RunRecord::Curve horizontal{who + ", horizontal", of.path.t, {}}, vertical{who + ", vertical", of.path.t, {}},
      heading{who + ", heading", of.path.t, {}};
  for (std::size_t k = 0; k < of.covariance.size(); ++k) {
    const auto& covariance = of.covariance[k];
    const bool pose = std::isfinite(covariance(3, 3));
    const Eigen::Matrix3d R =
        pose ? of.orientation[k].toRotationMatrix() : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
    const Eigen::Matrix3d position = R * covariance.topLeftCorner<3, 3>() * R.transpose();
    horizontal.value.push_back(std::sqrt(position(0, 0) + position(1, 1)));
    vertical.value.push_back(std::sqrt(position(2, 2)));
    heading.value.push_back(
        kDegrees * std::sqrt((R.row(2) * covariance.bottomRightCorner<3, 3>() * R.row(2).transpose()).value()));
  }
  add_curve(run.position_sigma, std::move(horizontal));
  add_curve(run.position_sigma, std::move(vertical));
  add_rotation_sigma(std::move(heading), run);
}

Trajectory read_trajectory(const std::filesystem::path& folder, const std::string& who) {
  const std::string full = who + "_full.csv", tum = who + ".tum";
  if (std::filesystem::exists(folder / full)) return read_full(CsvColumns(folder, full));  // also has point targets
  if (std::filesystem::exists(folder / tum)) return read_tum(file_in(folder, tum));
  return {};
}

/// Adds range and bearing of positions in the chaser's body.
void add_relative(const std::string& name, const std::vector<double>& t, const std::vector<Eigen::Vector3d>& positions,
                  RunRecord& run) {
  RunRecord::Curve range{name, t, {}}, bearing{name, t, {}};
  for (const Eigen::Vector3d& p : positions) {
    range.value.push_back(p.norm());
    bearing.value.push_back(kDegrees * std::atan2(p.y(), p.x()));
  }
  run.range.push_back(std::move(range));
  run.bearing.push_back(std::move(bearing));
}

/// Adds range and bearing of the target, and of the fixes at the chaser's keyframes.
void add_relative(const Trajectory& chaser, RunRecord& run) {
  const auto in_body = [&](const RunRecord::Path& path, std::size_t i, std::size_t k) -> Eigen::Vector3d {
    const RunRecord::Path& own = chaser.path;
    const Eigen::Vector3d arm(path.x[i] - own.x[k], path.y[i] - own.y[k], path.z[i] - own.z[k]);
    return chaser.orientation[k].toRotationMatrix().transpose() * arm;
  };
  const auto add = [&](const std::string& name, const RunRecord::Path& path, const auto& counts) {
    std::vector<double> t;
    std::vector<Eigen::Vector3d> positions;
    for (std::size_t i = 0; i < path.t.size(); ++i) {
      const auto at = std::lower_bound(chaser.path.t.begin(), chaser.path.t.end(), path.t[i]);
      if (!counts(i) || at == chaser.path.t.end() || *at != path.t[i]) continue;
      t.push_back(path.t[i]);
      positions.push_back(in_body(path, i, std::size_t(at - chaser.path.t.begin())));
    }
    if (!t.empty()) add_relative(name, t, positions, run);
  };
  add("estimate", run.target, [](std::size_t) { return true; });
  for (const std::string& sensor : different(run.fix_sensors))
    add(sensor, run.fixes, [&](std::size_t i) { return run.fix_sensors[i] == sensor; });
}

/// Returns the list's entry for a sensor, component and outcome.
RunRecord::Residuals& residuals_of(std::vector<RunRecord::Residuals>& all, const std::string& sensor,
                                   const std::string& component, const std::string& outcome) {
  for (RunRecord::Residuals& r : all)
    if (r.sensor == sensor && r.component == component && r.outcome == outcome) return r;
  return all.emplace_back(RunRecord::Residuals{sensor, component, outcome, {}, {}});
}

void read_residuals(const CsvColumns& file, RunRecord& run) {
  const auto sensor = file.texts("sensor"), component = file.texts("component"), outcome = file.texts("outcome");
  const std::vector<double> t = file.numbers("t"), value = file.numbers("residual");
  for (std::size_t i = 0; i < t.size(); ++i) {
    RunRecord::Residuals& of = residuals_of(run.residuals, sensor[i], component[i], outcome[i]);
    of.t.push_back(t[i]);
    of.value.push_back(value[i]);
  }
}

void read_held_out(const CsvColumns& file, RunRecord& run) {
  const auto sensor = file.texts("sensor");
  const std::vector<double> t = file.numbers("t");
  for (std::size_t i = 0; i < t.size(); ++i) {
    RunRecord::Residuals& of = residuals_of(run.residuals, sensor[i], "", "held-out");
    of.t.push_back(t[i]);
    of.value.push_back(kNone);
  }
}

/// Reads the innovations at the updates at which they change, and the relative position with its uncertainty. A
/// measurement whose innovation was tested, but that left the time of the last used one unchanged, was rejected.
void read_track(const CsvColumns& track, RunRecord& run) {
  constexpr std::string_view kSigmas = "_sigmas";
  const std::vector<double> t = track.numbers("t");
  for (const std::string& name : track.names()) {
    if (!name.ends_with(kSigmas)) continue;
    const std::string sensor = name.substr(0, name.size() - kSigmas.size());
    const std::vector<double> sigmas = track.numbers(name), age = track.numbers(sensor + "_age_s");
    for (std::size_t i = 0; i < sigmas.size(); ++i) {
      if (!std::isfinite(sigmas[i]) || (i > 0 && sigmas[i] == sigmas[i - 1])) continue;
      const bool used = i == 0 || !(std::abs(t[i] - age[i] - (t[i - 1] - age[i - 1])) < 1e-6);
      RunRecord::Residuals& of = residuals_of(run.residuals, sensor, "innovation", used ? "used" : "rejected");
      of.t.push_back(t[i]);
      of.value.push_back(sigmas[i]);
    }
  }
  add_curve(run.position_sigma, {"chaser", t, track.numbers("chaser_sigma_m")});
  RunRecord::Path relative = track.path("_m");
  std::vector<Eigen::Vector3d> positions;
  for (std::size_t i = 0; i < t.size(); ++i) positions.emplace_back(relative.x[i], relative.y[i], relative.z[i]);
  if (std::any_of(relative.x.begin(), relative.x.end(), [](double v) { return std::isfinite(v); }))
    add_relative("estimate", t, positions, run);
}

void read_errors(const CsvColumns& errors, RunRecord& run) {
  run.t = errors.numbers("t");
  run.position_error = errors.numbers("position_error_m");
  if (run.has_target()) run.types = errors.texts("type");
  for (std::size_t i = 0; i < 4; ++i) {
    const std::string what = i < 3 ? fmt::format("{}_m", "xyz"[i]) : "rz_deg";
    for (const auto& [column, values] :
         {std::pair{"error_" + what, &run.error[i]}, {"three_sigma_" + what, &run.three_sigma[i]}})
      *values = i < 3 || errors.has(column) ? errors.numbers(column) : std::vector<double>(run.t.size(), kNone);
  }
  if (!run.has_target()) return;
  RunRecord::Curve position{"target relative to chaser", run.t, {}},
      heading{"target relative to chaser, heading", run.t, {}};
  for (std::size_t k = 0; k < run.t.size(); ++k) {
    position.value.push_back(std::hypot(run.three_sigma[0][k], run.three_sigma[1][k], run.three_sigma[2][k]) / 3);
    heading.value.push_back(run.three_sigma[3][k] / 3);
  }
  add_curve(run.position_sigma, std::move(position));
  add_rotation_sigma(std::move(heading), run);
}

/// Keeps every n-th entry of long columns of equal length.
template <class... Columns>
void thin(Columns&... columns) {
  const auto keep = [](auto& column) {
    const std::size_t step = column.size() / kMaxRows + 1;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < column.size(); i += step) column[kept++] = column[i];
    column.resize(kept);
  };
  (keep(columns), ...);
}

void shift(std::vector<double>& t, double by) {
  for (double& value : t) value -= by;
}

void read_summary(const std::filesystem::path& file, RunRecord& run) try {
  run.summary = nlohmann::ordered_json::parse(read_text(file));
  run.is_ned = run.summary.value("frame", "") == "NED-FRD";
} catch (const nlohmann::json::exception&) {
  throw Error(fmt::format("{} is damaged or was not written by tandem", file.string()));
}

}  // namespace

std::vector<std::string> different(const std::vector<std::string>& words) {
  std::vector<std::string> result;
  for (const std::string& word : words)
    if (std::find(result.begin(), result.end(), word) == result.end()) result.push_back(word);
  return result;
}

bool RunRecord::has_truth() const {
  return std::any_of(position_error.begin(), position_error.end(), [](double v) { return std::isfinite(v); });
}

bool is_run(const std::filesystem::path& folder) {
  for (const char* file : {"summary.json", "chaser.tum", "errors.csv"})
    if (!std::filesystem::exists(folder / file)) return false;
  return true;
}

RunRecord read_run(const std::filesystem::path& folder) {
  const auto exists = [&](const char* file) { return std::filesystem::exists(folder / file); };
  RunRecord run;
  read_summary(file_in(folder, "summary.json"), run);
  const Trajectory chaser = read_trajectory(folder, "chaser"), target = read_trajectory(folder, "target");
  run.chaser = chaser.path;
  run.target = target.path;
  run.chaser_truth = read_trajectory(folder, "chaser_truth").path;
  run.target_truth = read_trajectory(folder, "target_truth").path;
  for (const char* file : {"target_fixes.csv", "chaser_fixes.csv"}) {
    if (!exists(file)) continue;
    const CsvColumns fixes(folder, file);
    run.fixes = fixes.path("_m");
    run.fix_sensors = fixes.texts("sensor");
    break;
  }
  if (exists("track.csv"))
    read_track(CsvColumns(folder, "track.csv"), run);
  else if (run.has_target())
    add_relative(chaser, run);
  add_sigmas("chaser", chaser, run);
  read_errors(CsvColumns(folder, "errors.csv"), run);
  if (exists("fit_residuals.csv")) read_residuals(CsvColumns(folder, "fit_residuals.csv"), run);
  if (exists("held_out.csv")) read_held_out(CsvColumns(folder, "held_out.csv"), run);

  run.start = run.chaser.t.empty() ? 0 : run.chaser.t.front();
  for (RunRecord::Path* path : {&run.chaser, &run.target, &run.chaser_truth, &run.target_truth, &run.fixes}) {
    shift(path->t, run.start);
    thin(path->t, path->x, path->y, path->z);
  }
  thin(run.fix_sensors);
  for (auto* curves : {&run.range, &run.bearing, &run.position_sigma, &run.rotation_sigma})
    for (RunRecord::Curve& curve : *curves) shift(curve.t, run.start), thin(curve.t, curve.value);
  for (RunRecord::Residuals& of : run.residuals) shift(of.t, run.start), thin(of.t, of.value);
  shift(run.t, run.start);
  thin(run.t, run.types, run.position_error);
  for (std::size_t i = 0; i < 4; ++i) thin(run.error[i], run.three_sigma[i]);
  return run;
}

}  // namespace tandem
