#pragma once

#include <array>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace tandem::plot {

using Json = nlohmann::ordered_json;

/// Numbers of a figure, to five digits, null where they are not finite.
Json numbers(const std::vector<double>& values);
Json number(double value);

/// Colours that people who see colours differently tell apart, in turn. Okabe & Ito 2008.
std::string colour(std::size_t i);
/// The same, see-through.
std::string faint(std::size_t i);
inline const char* const kGrey = "#7b8794";

/// The common ground of all layouts, with titles of the axes.
Json layout(const std::string& x, const std::string& y);

/// Of a scene whose sides have the data's ratio: from the south-east and above, so far away that all is in view. `extent`
/// of the data along x, y and z.
Json camera(const std::array<double, 3>& extent);

/// A line through points; `name` empty: not in the legend.
Json line(const std::string& name, const std::vector<double>& x, const std::vector<double>& y,
          const std::string& colour, double width = 1.5);
/// The space between two lines, in two traces.
void add_band(Json& traces, const std::vector<double>& x, const std::vector<double>& low,
              const std::vector<double>& high, const std::string& colour, const std::string& y_axis);
/// The share of values up to each, as steps.
Json cumulative(const std::string& name, std::vector<double> values, const std::string& colour);

/// A box for each set of values: quartiles, median, whiskers to the farthest value within 1.5 times the box's height
/// (Tukey 1977), those beyond as points. Of one colour; at x, so wide.
struct Boxes {
  std::string name, colour, faint;
  double width = 0.2;
  std::vector<double> x;
  std::vector<std::vector<double>> values;
  std::vector<std::vector<std::string>> labels;  ///< of each value, shown where a pointer rests
};
void add_boxes(Json& traces, const Boxes& boxes);

}  // namespace tandem::plot
