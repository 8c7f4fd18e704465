#include <tandem/studies/simulation/dive_parameters.hpp>
#include <tandem/studies/support/option_values.hpp>

namespace tandem {
namespace {

std::vector<NamedParameter<DiveOptions>> make_dive_parameters() {
  using O = DiveOptions;
  const auto number = number_parameter<O>;
  return {
      number("minutes", "min", "duration of the dive", &O::minutes, 1, 600),
      word_parameter<O, Grade>("grade", "sensor grade: mems or tactical", &O::grade,
                               {{"mems", Grade::mems}, {"tactical", Grade::tactical}}),
      number("latitude", "deg", "latitude, which determines the Earth's rotation and gravity", &O::latitude, -90, 90),
      number("keyframe_interval", "s", "maximum time between keyframes", &O::keyframe_interval, 0.1, 60),
      {"surfacings", "", "number of intermediate ascents to the surface, for GPS",
       [](O& o, const std::string& where, const std::string& text) { o.surfacings = parse_count_or_zero(where, text); },
       [](const O& o) { return std::to_string(o.surfacings); }},
      switch_parameter<O>("dvl_scale", "0 or 1: the DVL has a scale factor error", &O::dvl_scale),
      number("dvl_outage", "s", "duration of a DVL outage (no bottom track)", &O::dvl_outage, 0, 3600),
      number("dvl_outage_period", "s", "period of the outages; the first starts after half a period",
             &O::dvl_outage_period, 10, 36000),
      switch_parameter<O>("target", "0 or 1: the vehicle measures a surface vessel by USBL", &O::target),
      number("usbl_period", "s", "interval of the target's USBL fixes", &O::usbl_period, 0.1, 600),
      number("usbl_sigma", "m", "standard deviation of a USBL fix along each axis", &O::usbl_sigma, 1e-3, 1000),
  };
}

}  // namespace

const std::vector<NamedParameter<DiveOptions>>& dive_parameters() {
  static const std::vector<NamedParameter<DiveOptions>> all = make_dive_parameters();
  return all;
}

}  // namespace tandem
