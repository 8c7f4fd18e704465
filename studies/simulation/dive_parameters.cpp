#include <tandem/studies/simulation/dive_parameters.hpp>
#include <tandem/studies/support/option_values.hpp>

namespace tandem {
namespace {

std::vector<NamedParameter<DiveOptions>> make_dive_parameters() {
  using O = DiveOptions;
  const auto number = number_parameter<O>;
  return {
      number("minutes", "min", "how long it takes", &O::minutes, 1, 600),
      word_parameter<O, Grade>("grade", "of its sensors, mems or tactical", &O::grade,
                               {{"mems", Grade::mems}, {"tactical", Grade::tactical}}),
      number("latitude", "deg", "where, for the Earth's rotation and gravity", &O::latitude, -90, 90),
      number("keyframe_interval", "s", "the longest time without a keyframe", &O::keyframe_interval, 0.1, 60),
      {"surfacings", "", "how often it comes up for GPS on the way",
       [](O& o, const std::string& where, const std::string& text) { o.surfacings = parse_count_or_none(where, text); },
       [](const O& o) { return std::to_string(o.surfacings); }},
      switch_parameter<O>("dvl_scale", "0 or 1: whether the DVL's scale is off", &O::dvl_scale),
      number("dvl_outage", "s", "the DVL sees no bottom for so long", &O::dvl_outage, 0, 3600),
      number("dvl_outage_period", "s", "from one such outage to the next, the first half a period after the start",
             &O::dvl_outage_period, 10, 36000),
      switch_parameter<O>("target", "0 or 1: a surface vessel that it fixes by USBL", &O::target),
      number("usbl_period", "s", "between the fixes of a target", &O::usbl_period, 0.1, 600),
      number("usbl_sigma", "m", "of such a fix along each axis", &O::usbl_sigma, 1e-3, 1000),
  };
}

}  // namespace

const std::vector<NamedParameter<DiveOptions>>& dive_parameters() {
  static const std::vector<NamedParameter<DiveOptions>> all = make_dive_parameters();
  return all;
}

}  // namespace tandem
