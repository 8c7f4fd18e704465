#pragma once

#include <array>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace tandem::plot {

using Json = nlohmann::ordered_json;

/// Return numbers as JSON with five significant digits; null for values that are not finite.
Json numbers(const std::vector<double>& values);
Json number(double value);

/// Returns the i-th colour of a cyclic palette that suits all kinds of colour vision (Okabe & Ito 2008).
std::string colour(std::size_t i);
/// Returns the i-th colour with an opacity of 25 %.
std::string translucent(std::size_t i);
inline const char* const kGrey = "#7b8794";

/// Returns the common layout with these axis titles.
Json layout(const std::string& x, const std::string& y);

/// Returns a camera position south-east of and above a scene with the aspect ratio of the data, far enough to show all
/// of it. `extent`: size of the data along x, y and z.
Json camera(const std::array<double, 3>& extent);

/// Returns a line through points. An empty `name` omits it from the legend.
Json line(const std::string& name, const std::vector<double>& x, const std::vector<double>& y,
          const std::string& colour, double width = 1.5);
/// Adds the band between two lines as two traces.
void add_band(Json& traces, const std::vector<double>& x, const std::vector<double>& low,
              const std::vector<double>& high, const std::string& colour, const std::string& y_axis);
/// Returns the empirical cumulative distribution of the values as a step line.
Json cumulative(const std::string& name, std::vector<double> values, const std::string& colour);

/// Box plots (Tukey 1977) of several sets of values: quartiles, median, whiskers to the farthest value within 1.5 times
/// the box height, and points beyond.
struct Boxes {
  std::string name, colour, translucent;
  double width = 0.2;
  std::vector<double> x;
  std::vector<std::vector<double>> values;
  std::vector<std::vector<std::string>> labels;  ///< hover text of each value
};
void add_boxes(Json& traces, const Boxes& boxes);

}  // namespace tandem::plot
