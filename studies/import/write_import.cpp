#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/import/default_noise.hpp>
#include <tandem/studies/import/import.hpp>
#include <tandem/studies/support/output_file.hpp>

namespace tandem {
namespace {

bool is_truth_or_odometry(const ImportedSensor& s) { return !s.sensor().type->file.empty(); }

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += static_cast<unsigned char>(c) < 32 ? ' ' : c;
  }
  return result + "\"";
}

/// Returns the entry of a sensor, and a comment on its assumed values.
std::string sensor_entry(const ImportedSensor& s) {
  const ImportSensor& sensor = s.sensor();
  std::string text = fmt::format("  {}: {{type: {}, file: {}", sensor.name, sensor.type->name, s.file()), comment;
  for (const auto& [key, value] : sensor.settings) text += fmt::format(", {}: {}", key, value);
  if (sensor.type->name == "imu") {
    for (const DefaultNoise& noise : missing_imu_noise(sensor)) {
      text += fmt::format(", {}: {}", noise.name, noise.values);
      comment = "   # noise of a MEMS sensor is assumed; see its data sheet";
    }
  } else if (!has_setting(sensor.settings, "sigma")) {
    if (const std::vector<double> stated = s.stated_sigma(); !stated.empty()) {
      std::string values;
      for (const double sigma : stated) values += fmt::format("{}{:.4g}", values.empty() ? "" : ", ", sigma);
      text += fmt::format(", sigma: [{}]", values);
      comment = "   # sigma: median of the stated variances";
    } else {
      text += fmt::format(", sigma: {}", sensor.type->sigma);
      comment = "   # sigma is assumed; see the data sheet";
    }
  }
  return text + "}" + comment + "\n";
}

std::string scenario_yaml(const Import& import) {
  const ImportMap& map = import.map;
  std::string text = fmt::format("name: {}\n", quoted(map.name));
  if (!has_setting(map.settings, "source"))
    text += fmt::format("source: {}\n", quoted("imported from " + import.source.filename().string()));
  for (const auto& [key, value] : map.settings) text += fmt::format("{}: {}\n", key, value);
  text += fmt::format("frame: {}\n", map.ned ? "NED-FRD" : "ENU-FLU");
  if (import.frame) {
    const GeographicPoint& origin = import.frame->origin();
    text += fmt::format("origin: [{:.9f}, {:.9f}, {:.3f}]   # latitude, longitude [deg], height [m] of x = y = z = 0\n",
                        origin.latitude, origin.longitude, origin.height);
    if (!has_setting(map.settings, "latitude") && has_type(import, "imu"))
      text += fmt::format("latitude: {:.4f}\n", origin.latitude);
  }
  bool truth_without_orientation = false, sensors = false;
  for (const auto& s : import.sensors) {
    const bool truth = s->sensor().type->name.starts_with("truth");
    const bool orientation = std::any_of(s->sensor().fields.begin(), s->sensor().fields.end(), [](const auto& f) {
      return f.first.starts_with("quaternion") || f.first == "yaw" || f.first == "heading" || f.first == "euler";
    });
    truth_without_orientation |= truth && !orientation;
    sensors |= !is_truth_or_odometry(*s);
  }
  if (truth_without_orientation && !has_setting(map.settings, "truth_orientation"))
    text += "truth_orientation: false\n";
  if (sensors) text += "sensors:\n";
  bool target = false;
  for (const auto& s : import.sensors) {
    if (!is_truth_or_odometry(*s)) text += sensor_entry(*s);
    target |= observes_target(*s->sensor().type);
  }
  if (!target) return text;
  text += "noise:\n";
  for (const auto& [key, value] : map.noise) text += fmt::format("  {}: {}\n", key, value);
  for (const DefaultNoise& noise : missing_noise(import))
    text += fmt::format("  {}: {}   # assumed: {}\n", noise.name, noise.values, noise.comment);
  return text;
}

/// Appends a time without the rounding errors of its conversion: a double since 1970 has a resolution of 0.24 μs.
void append_time(fmt::memory_buffer& line, double t) {
  const std::string text = fmt::format("{:.{}f}", t, std::abs(t) > 1e8 ? 6 : 9);
  const std::size_t last = text.find_last_not_of('0');
  const std::string_view kept = std::string_view(text).substr(0, text[last] == '.' ? last : last + 1);
  line.append(kept.data(), kept.data() + kept.size());
}

void write_rows(const ImportedSensor& s, const std::filesystem::path& file) {
  const bool tum = s.sensor().type->columns.empty();
  OutputFile out(file);
  out.write(tum ? "# t x y z qx qy qz qw\n" : std::string(s.sensor().type->columns) + "\n");
  fmt::memory_buffer line;
  for (std::size_t i = 0; i < s.rows(); ++i) {
    line.clear();
    for (std::size_t c = 0; c < s.width(); ++c) {
      if (c > 0) line.push_back(tum ? ' ' : ',');
      if (c == 0)
        append_time(line, s.at(i, 0));
      else
        fmt::format_to(std::back_inserter(line), "{:.12g}", s.at(i, c));  // rounding errors are not data
    }
    line.push_back('\n');
    out.write({line.data(), line.size()});
  }
  out.close();
}

}  // namespace

void write_import(const Import& import, const std::filesystem::path& folder) {
  for (const auto& s : import.sensors) write_rows(*s, folder / s->file());
  write_file(folder / "scenario.yaml", scenario_yaml(import));
}

}  // namespace tandem
