#pragma once

#include <array>
#include <string>

#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

/// A signed permutation of axes: out[i] = sign[i] · in[from[i]].
struct AxisMap {
  std::array<int, 3> from{0, 1, 2};
  std::array<double, 3> sign{1, 1, 1};

  std::array<double, 3> apply(const std::array<double, 3>& v) const {
    return {sign[0] * v[from[0]], sign[1] * v[from[1]], sign[2] * v[from[2]]};
  }
  bool is_identity() const { return from == std::array{0, 1, 2} && sign == std::array{1.0, 1.0, 1.0}; }
};

/// The axes of recorded data: those of the world and those of the body, as letters in the order x y z. World letters
/// are N E S W U D; body letters are F(orward), A(ft), L(eft) or P(ort), R(ight) or S(tarboard), U(p), D(own).
struct ImportAxes {
  std::string world = "ENU", body = "FLU";
};

/// Reads the key `axes` of a sensor: "NED", "FRD", "NED-FRD", or the directions of the body axes,
/// {x: starboard, y: forward, z: up}. Axes that are not given keep their value in `given`. Throws Error on unknown or
/// left-handed axes.
ImportAxes read_axes(const YamlSection& sensor, ImportAxes given);

/// Returns the map from one set of body axes, or one set of world axes, to another.
AxisMap axis_map(const std::string& from, const std::string& to);

}  // namespace tandem
