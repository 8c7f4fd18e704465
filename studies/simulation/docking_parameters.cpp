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
      number("minutes", "min", "how long it takes", &O::minutes, 1, 6000),
      number("keyframe_interval", "s", "the longest time without a keyframe", &O::keyframe_interval, 0.1, 60),
      word_parameter<O, TargetMotion>("target_motion", "circuit, straight, circle, helix or hover", &O::motion,
                                      {{"circuit", TargetMotion::circuit},
                                       {"straight", TargetMotion::straight},
                                       {"circle", TargetMotion::circle},
                                       {"helix", TargetMotion::helix},
                                       {"hover", TargetMotion::hover}}),
      switch_parameter<O>("planar", "0 or 1: on the water's plane, where poses are x, y and heading", &O::planar),
      number("speed", "m/s", "of the target", &O::speed, 0.1, 10),
      number("turn_radius", "m", "of its turns", &O::turn_radius, 5, 1000),
      number("weave", "m", "how far it swings to either side of its course, each 60 s", &O::weave, 0, 20),
      number("waves", "rad", "its roll and pitch in waves", &O::waves, 0, 0.5),
      number("far", "m", "how far the chaser falls back", &O::far, 1, 1000),
      number("near", "m", "how near it comes", &O::near, 1, 1000),
      number("approach", "s", "from one approach to the next", &O::approach, 20, 36000),
      word_parameter<O, UsblKind>("usbl", "position, or range-bearing: errors across grow with the distance", &O::usbl,
                                  {{"position", UsblKind::position}, {"range-bearing", UsblKind::range_bearing}}),
      number("usbl_period", "s", "between USBL fixes", &O::usbl_period, 0.1, 600),
      number("usbl_sigma", "m", "of a fix along each axis, or of its range", &O::usbl_sigma, 1e-3, 1000),
      number("usbl_bearing_sigma", "rad", "of its bearings, where it is range-bearing", &O::usbl_bearing_sigma, 1e-4,
             1),
      number("usbl_outliers", "", "share of the fixes that are outliers", &O::usbl_outliers, 0, 0.9),
      number("usbl_outlier_sigma", "m", "of an outlier along each axis", &O::usbl_outlier_sigma, 0, 10000),
      number("usbl_latency", "s", "how late a fix is stamped; the estimator knows it", &O::usbl_latency, 0, 60),
      number("optical_period", "s", "between optical poses", &O::optical_period, 0.1, 600),
      number("optical_sigma", "m", "of an optical position along each axis", &O::optical_sigma, 1e-4, 100),
      number("optical_angle_sigma", "rad", "of an optical orientation about each axis", &O::optical_angle_sigma, 1e-4,
             1),
      number("optical_range", "m", "within, optical poses; beyond, USBL fixes", &O::optical_range, 0, 1000),
      number("optical_view", "deg", "whole angle of the cone of view about the bow", &O::optical_view, 0, 360),
      number("blind", "", "share of the spells in which a sensor sees nothing", &O::blind, 0, 0.95),
      number("spell", "s", "how long such a spell is", &O::spell, 1, 36000),
      number("gap", "s", "neither sensor sees anything for so long", &O::gap, 0, 600),
      number("gap_period", "s", "from one such gap to the next, the first half a period after the start",
             &O::gap_period, 10, 36000),
      number("odometry_sigma", "m/√s", "random walk of the odometry", &O::odometry_sigma, 1e-5, 10),
      number("odometry_angle_sigma", "rad/√s", "the same of its orientation", &O::odometry_angle_sigma, 1e-6, 1),
      number("odometry_scale", "", "it reads (1 + this) times the way made, unknown to the estimator",
             &O::odometry_scale, -0.5, 0.5),
      number("odometry_yaw_drift", "rad/s", "of its heading, unknown to the estimator", &O::odometry_yaw_drift, -0.1,
             0.1),
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
