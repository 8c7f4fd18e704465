#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/simulation/docking_parameters.hpp>
#include <tandem/studies/support/option_values.hpp>

namespace tandem {
namespace {

std::vector<NamedParameter<DockingOptions>> make_docking_parameters() {
  using O = DockingOptions;
  const auto number = number_parameter<O>;
  return {
      number("minutes", "min", "duration of the docking", &O::minutes, 1, 6000),
      number("keyframe_interval", "s", "maximum time between keyframes", &O::keyframe_interval, 0.1, 60),
      word_parameter<O, TargetMotion>("target_motion",
                                      "motion of the target: circuit, straight, circle, helix or hover", &O::motion,
                                      {{"circuit", TargetMotion::circuit},
                                       {"straight", TargetMotion::straight},
                                       {"circle", TargetMotion::circle},
                                       {"helix", TargetMotion::helix},
                                       {"hover", TargetMotion::hover}}),
      switch_parameter<O>("planar", "0 or 1: planar motion; poses are x, y and heading", &O::planar),
      number("speed", "m/s", "speed of the target", &O::speed, 0.1, 10),
      number("turn_radius", "m", "radius of the target's turns", &O::turn_radius, 5, 1000),
      number("weave", "m", "amplitude of the target's lateral oscillation, period 60 s", &O::weave, 0, 20),
      number("waves", "rad", "amplitude of the target's roll and pitch in waves", &O::waves, 0, 0.5),
      number("far", "m", "maximum distance of the chaser behind the target", &O::far, 1, 1000),
      number("near", "m", "minimum distance of the chaser behind the target", &O::near, 1, 1000),
      number("approach", "s", "period of the approaches", &O::approach, 20, 36000),
      word_parameter<O, UsblKind>("usbl", "USBL model: position, or range-bearing (lateral errors grow with range)",
                                  &O::usbl,
                                  {{"position", UsblKind::position}, {"range-bearing", UsblKind::range_bearing}}),
      number("usbl_period", "s", "interval of USBL fixes", &O::usbl_period, 0.1, 600),
      number("usbl_sigma", "m", "standard deviation of a fix along each axis, or of its range", &O::usbl_sigma, 1e-3,
             1000),
      number("usbl_bearing_sigma", "rad", "standard deviation of the bearings of range-bearing", &O::usbl_bearing_sigma,
             1e-4, 1),
      number("usbl_outliers", "", "fraction of the fixes that are outliers", &O::usbl_outliers, 0, 0.9),
      number("usbl_outlier_sigma", "m", "standard deviation of an outlier along each axis", &O::usbl_outlier_sigma, 0,
             10000),
      number("usbl_latency", "s", "delay of the fixes' time stamps; known to the estimator", &O::usbl_latency, 0, 60),
      number("optical_period", "s", "interval of optical poses", &O::optical_period, 0.1, 600),
      number("optical_sigma", "m", "standard deviation of an optical position along each axis", &O::optical_sigma, 1e-4,
             100),
      number("optical_angle_sigma", "rad", "standard deviation of an optical orientation about each axis",
             &O::optical_angle_sigma, 1e-4, 1),
      number("optical_range", "m", "below this distance optical poses, above it USBL fixes", &O::optical_range, 0,
             1000),
      number("optical_view", "deg", "full angle of the forward cone of view", &O::optical_view, 0, 360),
      number("blind", "", "probability that a sensor is blind during a spell", &O::blind, 0, 0.95),
      number("spell", "s", "duration of a spell, an interval of constant visibility", &O::spell, 1, 36000),
      number("gap", "s", "duration of a gap without any measurement of the target", &O::gap, 0, 600),
      number("gap_period", "s", "period of the gaps; the first starts after half a period", &O::gap_period, 10, 36000),
      number("odometry_sigma", "m/√s", "random walk of the odometry position", &O::odometry_sigma, 1e-5, 10),
      number("odometry_angle_sigma", "rad/√s", "random walk of the odometry orientation", &O::odometry_angle_sigma,
             1e-6, 1),
      number("odometry_scale", "", "scale factor error of the odometry; unknown to the estimator", &O::odometry_scale,
             -0.5, 0.5),
      number("odometry_yaw_drift", "rad/s", "yaw drift of the odometry; unknown to the estimator",
             &O::odometry_yaw_drift, -0.1, 0.1),
  };
}

}  // namespace

const std::vector<NamedParameter<DockingOptions>>& docking_parameters() {
  static const std::vector<NamedParameter<DockingOptions>> all = make_docking_parameters();
  return all;
}

void read_docking_description(const std::filesystem::path& file, DockingOptions& options) {
  const YamlSection yaml = YamlSection::load(file);
  std::vector<std::string> known = {"seed"};
  for (const auto& parameter : docking_parameters()) known.push_back(parameter.name);
  yaml.allow_only(known);
  for (const std::string& key : yaml.keys()) {
    const std::string text = yaml.text(key);
    try {
      if (key == "seed")
        options.seed = static_cast<std::uint64_t>(parse_count(key, text));
      else
        parameter_named(docking_parameters(), "a docking", key).set(options, key, text);
    } catch (const Error& error) {
      yaml.fail(key, error.what());
    }
  }
}

std::string changed_parameters(const DockingOptions& options) {
  std::string text;
  for (const auto& parameter : docking_parameters())
    if (const std::string value = parameter.text(options); value != parameter.text(DockingOptions()))
      text += fmt::format("{}{}={}", text.empty() ? "" : ", ", parameter.name, value);
  return text;
}

}  // namespace tandem
