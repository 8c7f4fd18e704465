#include <algorithm>
#include <cctype>

#include <fmt/format.h>

#include <tandem/studies/import/import_axes.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Returns the line of an axis letter (0: forward or north, 1: left or west, 2: up) and its sign; line -1 if unknown.
std::pair<int, double> direction(char letter) {
  switch (letter) {
    case 'F':
    case 'N':
      return {0, 1};
    case 'A':
    case 'S':  // south; in body axes, starboard is replaced by R
      return {0, -1};
    case 'L':
    case 'W':
      return {1, 1};
    case 'R':
    case 'E':
      return {1, -1};
    case 'U':
      return {2, 1};
    case 'D':
      return {2, -1};
    default:
      return {-1, 0};
  }
}

bool has_any(const std::string& text, const char* letters) { return text.find_first_of(letters) != std::string::npos; }

std::string upper_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

/// Replaces port and starboard by left and right.
std::string canonical_body(std::string axes) {
  for (char& c : axes) c = c == 'P' ? 'L' : c == 'S' ? 'R' : c == 'B' ? 'A' : c;
  return axes;
}

/// Returns why three letters are not axes; empty if they are.
std::string why_not_axes(const std::string& axes) {
  if (axes.size() != 3) return "needs three letters, one for each of x, y and z";
  std::array<int, 3> line{};
  double handed = 1;
  for (int i = 0; i < 3; ++i) {
    const auto [axis, sign] = direction(axes[static_cast<std::size_t>(i)]);
    if (axis < 0) return fmt::format("has the unknown letter {}", axes[static_cast<std::size_t>(i)]);
    line[static_cast<std::size_t>(i)] = axis;
    handed *= sign;
  }
  if (line[0] == line[1] || line[1] == line[2] || line[0] == line[2]) return "names one direction twice";
  const bool even = (line[1] - line[0] + 3) % 3 == 1;
  if ((even ? handed : -handed) < 0) return "is left-handed; change the sign of one field instead (-FIELD)";
  return "";
}

}  // namespace

ImportAxes read_axes(const YamlSection& sensor, ImportAxes given) {
  if (!sensor.has("axes")) return given;
  const auto check = [&](const std::string& axes) {
    if (const std::string why = why_not_axes(axes); !why.empty())
      sensor.fail("axes", fmt::format("axes {} {}", quote(axes), why));
  };
  if (sensor.is_mapping("axes")) {
    const YamlSection axes = sensor.section("axes");
    axes.allow_only({"x", "y", "z"});
    std::string letters;
    for (const char* key : {"x", "y", "z"}) letters += axes.text(key).substr(0, 1);
    given.body = canonical_body(upper_case(letters));
    check(given.body);
    return given;
  }
  const std::string text = sensor.text("axes");
  for (const std::string_view part : split(text, '-')) {
    const std::string axes = upper_case(std::string(part));
    const bool world = has_any(axes, "NEW") && !has_any(axes, "FALPR");
    std::string& target = world ? given.world : given.body;
    target = world ? axes : canonical_body(axes);
    check(target);
  }
  return given;
}

AxisMap axis_map(const std::string& from, const std::string& to) {
  AxisMap map;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const auto [out, out_sign] = direction(to[i]);
      const auto [in, in_sign] = direction(from[j]);
      if (out != in) continue;
      map.from[i] = static_cast<int>(j);
      map.sign[i] = out_sign * in_sign;
    }
  return map;
}

}  // namespace tandem
