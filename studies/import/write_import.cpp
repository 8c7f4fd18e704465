#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/import/default_noise.hpp>
#include <tandem/studies/import/import.hpp>
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text.hpp>

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

/// The text of scenario.yaml, and the places in the map that its lines come from.
class ScenarioText {
 public:
  /// `apart`: each setting of a sensor is on its own line, so that the line of an error names it.
  explicit ScenarioText(const Import& import, bool apart) : import_(import), apart_(apart) {
    write_head();
    write_sensors();
    write_noise();
  }

  const std::string& text() const { return text_; }
  /// Returns the place of the last marked line that is not after `line`, or an empty text.
  std::string place_of(int line) const {
    std::string place;
    for (const auto& [marked, of_line] : marks_)
      if (marked <= line) place = of_line;
    return place;
  }

 private:
  void mark(const std::string& place) {
    marks_.emplace_back(1 + static_cast<int>(std::count(text_.begin(), text_.end(), '\n')), place);
  }

  void write_head() {
    const ImportMap& map = import_.map;
    text_ = fmt::format("name: {}\n", quoted(map.name));
    if (!has_setting(map.settings, "source"))
      text_ += fmt::format("source: {}\n", quoted("imported from " + import_.source.filename().string()));
    for (const ImportSetting& setting : map.settings) {
      mark(setting.place);
      text_ += fmt::format("{}: {}\n", setting.key, setting.value);
    }
    text_ += fmt::format("frame: {}\n", map.ned ? "NED-FRD" : "ENU-FLU");
    if (!import_.frame) return;
    const GeographicPoint& origin = import_.frame->origin();
    text_ +=
        fmt::format("origin: [{:.9f}, {:.9f}, {:.3f}]   # latitude, longitude [deg], height [m] of x = y = z = 0\n",
                    origin.latitude, origin.longitude, origin.height);
    if (!has_setting(map.settings, "latitude") && has_type(import_, "imu"))
      text_ += fmt::format("latitude: {:.4f}\n", origin.latitude);
  }

  void write_sensors() {
    bool truth_without_orientation = false, sensors = false;
    for (const auto& s : import_.sensors) {
      const bool truth = s->sensor().type->name.starts_with("truth");
      const bool orientation = std::any_of(s->sensor().fields.begin(), s->sensor().fields.end(), [](const auto& f) {
        return f.first.starts_with("quaternion") || f.first == "yaw" || f.first == "heading" || f.first == "euler";
      });
      truth_without_orientation |= truth && !orientation;
      sensors |= !is_truth_or_odometry(*s);
    }
    if (truth_without_orientation && !has_setting(import_.map.settings, "truth_orientation"))
      text_ += "truth_orientation: false\n";
    if (sensors) text_ += "sensors:\n";
    for (const auto& s : import_.sensors)
      if (!is_truth_or_odometry(*s)) write_sensor(*s);
  }

  /// Writes the entry of a sensor, and a comment on its assumed values.
  void write_sensor(const ImportedSensor& s) {
    const ImportSensor& sensor = s.sensor();
    std::string comment;
    mark(fmt::format("{}: {}", sensor.place, sensor.name));
    text_ += fmt::format("  {}: {{type: {}, file: {}", sensor.name, sensor.type->name, s.file());
    for (const ImportSetting& setting : sensor.settings) {
      text_ += apart_ ? ",\n      " : ", ";
      mark(setting.place);
      text_ += fmt::format("{}: {}", setting.key, setting.value);
    }
    if (apart_ && !sensor.settings.empty()) text_ += "\n      ";
    if (sensor.type->name == "imu") {
      for (const DefaultNoise& noise : missing_imu_noise(sensor)) {
        text_ += fmt::format(", {}: {}", noise.name, noise.values);
        comment = "   # noise of a MEMS sensor is assumed; see its data sheet";
      }
    } else if (!has_setting(sensor.settings, "sigma")) {
      if (const std::vector<double> stated = s.stated_sigma(); !stated.empty()) {
        std::string values;
        for (const double sigma : stated) values += fmt::format("{}{:.4g}", values.empty() ? "" : ", ", sigma);
        text_ += fmt::format(", sigma: [{}]", values);
        comment = "   # sigma: median of the stated variances";
      } else {
        text_ += fmt::format(", sigma: {}", sensor.type->sigma);
        comment = "   # sigma is assumed; see the data sheet";
      }
    }
    text_ += "}" + comment + "\n";
  }

  void write_noise() {
    if (!has_noise(import_)) return;
    text_ += "noise:\n";
    for (const ImportSetting& setting : import_.map.noise) {
      mark(setting.place);
      text_ += fmt::format("  {}: {}\n", setting.key, setting.value);
    }
    for (const DefaultNoise& noise : missing_noise(import_))
      text_ += fmt::format("  {}: {}   # assumed: {}\n", noise.name, noise.values, noise.comment);
  }

  const Import& import_;
  bool apart_;
  std::string text_;
  std::vector<std::pair<int, std::string>> marks_;  ///< line and place
};

/// Reads scenario.yaml of a folder that has its other files. Throws Error with the place in the map if it is not valid.
void check_scenario(const Import& import, const std::filesystem::path& folder) {
  const ScenarioText scenario(import, true);
  try {
    read_settings(scenario.text(), folder, RowsIn::files);
  } catch (const Error& error) {
    const std::string message = error.what(), file = (folder / "scenario.yaml").string() + ":";
    if (!message.starts_with(file)) throw;
    const std::size_t end = message.find(": ", file.size());
    const auto line = parse_positive_integer(std::string_view(message).substr(file.size(), end - file.size()));
    const std::string place = line ? scenario.place_of(*line) : "";
    if (place.empty()) throw;
    throw Error(place + message.substr(end));
  }
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
  check_scenario(import, folder);
  write_file(folder / "scenario.yaml", ScenarioText(import, false).text());
}

}  // namespace tandem
