#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/import/default_noise.hpp>
#include <tandem/studies/import/import_assumptions.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

bool has_part(const ImportType& type, ImportPart part) {
  return std::find(type.parts.begin(), type.parts.end(), part) != type.parts.end();
}

/// The conventions of one sensor.
class SensorConventions {
 public:
  SensorConventions(const ImportedSensor& imported, const ImportMap& map, const std::function<void(std::string)>& add)
      : imported_(imported), sensor_(imported.sensor()), map_(map), add_(add) {}

  void list() const {
    const ImportType& type = *sensor_.type;
    const bool pose = !type.file.empty();  // odometry and truth
    if (!sensor_.axes_stated && (pose || !geographic_or_scalar()))
      say("axes {}-{}, those of the scenario", sensor_.axes.world, sensor_.axes.body);
    list_frames();
    list_units();
    list_angles();
    list_time();
    if (!pose) list_mounting();
    if (!sensor_.latency && !has_setting(sensor_.settings, "delay")) say("delay 0: rows are valid at their times");
    if (has_part(type, ImportPart::height) && sensor_.find("pressure") && !map_.water_given)
      say("depth from pressure with {:g} Pa at the surface and {:g} kg/m^3", map_.atmosphere, map_.density);
    if (sensor_.find("latitude") && !sensor_.find("height") && !sensor_.find("depth")) say("height 0");
    list_noise();
  }

 private:
  template <class... T>
  void say(fmt::format_string<T...> format, T&&... values) const {
    add_(sensor_.name + ": " + fmt::format(format, std::forward<T>(values)...));
  }

  /// Returns whether the rows do not depend on axes: geographic positions, ranges, heights, and headings alone.
  bool geographic_or_scalar() const {
    return sensor_.find("latitude") || sensor_.type->name == "range" || has_part(*sensor_.type, ImportPart::height) ||
           (sensor_.find("heading") && !sensor_.find("roll"));
  }

  void list_frames() const {
    if (sensor_.frame_field.empty()) return;
    std::vector<std::string> names;
    for (const std::string& frame : imported_.frames()) names.push_back(frame.empty() ? "without a name" : frame);
    say("the frame {} ({}) is taken as the chaser's body", listed(names), sensor_.frame_field);
  }

  void list_units() const {
    if (sensor_.fields_by_rule) return;
    std::vector<std::string> fields;
    for (const ImportPart part : sensor_.type->parts)
      for (const ImportQuantity& quantity : quantities(part)) {
        const std::vector<ImportField>* of = sensor_.find(quantity.name);
        if (!of || quantity.quantity == Quantity::number) continue;
        for (const ImportField& f : *of) {
          const std::string text = fmt::format("{} in {}", f.field, si_unit(quantity.quantity));
          if (!f.field.empty() && f.unit.empty() && std::find(fields.begin(), fields.end(), text) == fields.end())
            fields.push_back(text);
        }
      }
    if (!fields.empty()) say("{}, since no unit is stated", listed(fields));
  }

  void list_angles() const {
    const bool ned = sensor_.axes.body == "FRD";
    if (const auto* heading = sensor_.find("heading"); heading && sensor_.fields_by_rule) {
      if (heading->front().field == "heading_true")
        say("true headings: deviation and variation of the sentences are added, east positive");
      if (heading->front().field == "heading_magnetic") say("the deviation of the sentences is added, east positive");
    }
    if (sensor_.find("azimuth") && !sensor_.fields_by_rule)
      say("azimuths turn from x towards y ({}), elevations count towards z ({})", ned ? "starboard" : "port",
          ned ? "down" : "up");
    if (sensor_.find("roll") && !sensor_.fields_by_rule)
      say("roll, pitch and yaw turn in the order yaw, pitch, roll about the turned axes");
    if (sensor_.find("heading") && !sensor_.fields_by_rule) say("headings turn clockwise from north");
    if ((sensor_.find("heading") || sensor_.find("yaw")) && !sensor_.north_stated && !sensor_.magnetic)
      say("north is true north");
  }

  void list_time() const {
    const ImportTime& time = sensor_.time;
    if (!sensor_.time_note.empty()) say("{}", sensor_.time_note);
    if (!sensor_.time_stated)
      say("the time is {}{}", time.receive ? "that of receipt" : time.field.field + ", by its name",
          time.date_field.empty() ? "" : ", with the date in " + time.date_field);
    if (!time.receive && !sensor_.fields_by_rule && !std::isnan(imported_.unstated_time())) {
      const std::string_view unit = unit_by_magnitude(imported_.unstated_time());
      say("times are in {}{}", unit == "s" ? "seconds" : unit, unit == "s" ? "" : ", by their magnitude");
    }
    if (time.gps && time.leap_seconds == kLeapSeconds) say("{:g} leap seconds between GPS and UTC", time.leap_seconds);
  }

  void list_mounting() const {
    const bool place = has_setting(sensor_.settings, "position"), turn = has_setting(sensor_.settings, "orientation");
    if (!place && !turn)
      say("mounted at the origin of the body, along its axes");
    else if (!turn && sensor_.type->name != "gps" && sensor_.type->name != "depth")
      say("mounted along the axes of the body");
    else if (!place && sensor_.type->name != "heading")
      say("mounted at the origin of the body");
    if (observes_target(*sensor_.type) && !has_setting(sensor_.settings, "target_position"))
      say("observes the origin of the target");
  }

  void list_noise() const {
    if (!sensor_.type->file.empty()) return;
    if (sensor_.type->name == "imu") {
      std::vector<std::string> values;
      for (const DefaultNoise& noise : missing_imu_noise(sensor_))
        values.push_back(fmt::format("{} {}", noise.name, noise.values));
      if (!values.empty()) say("noise of a MEMS sensor: {}", listed(values));
    } else if (!has_setting(sensor_.settings, "sigma") && imported_.stated_sigma().empty()) {
      say("sigma {}", sensor_.type->sigma);
    }
  }

  const ImportedSensor& imported_;
  const ImportSensor& sensor_;
  const ImportMap& map_;
  const std::function<void(std::string)>& add_;
};

}  // namespace

std::vector<std::string> assumed_conventions(const Import& import) {
  std::vector<std::string> result;
  const std::function<void(std::string)> add = [&](std::string sentence) { result.push_back(std::move(sentence)); };
  if (!import.map.frame_stated)
    add(fmt::format("frame: the scenario is in {}", import.map.ned ? "NED-FRD" : "ENU-FLU"));
  for (const auto& s : import.sensors) SensorConventions(*s, import.map, add).list();
  if (!has_noise(import)) return result;
  for (const DefaultNoise& noise : missing_noise(import))
    add(fmt::format("noise.{}: {}, {}", noise.name, noise.values, noise.comment));
  return result;
}

}  // namespace tandem
