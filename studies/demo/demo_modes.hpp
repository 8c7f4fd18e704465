#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/support/csv.hpp>

/// Table I and Figures 1, 6 and 7 of Baxter & Teran Espinoza et al. 2025 on the built-in recording docking_a: Mode A
/// and Mode B side by side.
namespace tandem::modes {

/// What one mode makes of a keyframe.
struct ModeState {
  Vector<3> target;                     ///< position in the world [m]
  std::optional<double> error;          ///< of the relative position [m]
  std::optional<double> angle;          ///< error of the relative orientation [deg]
  std::optional<double> three_sigma{};  ///< 3 √trace of the relative position's covariance [m]
};

/// A keyframe of both modes.
struct Instant {
  double t;  ///< s
  KeyframeType type;
  std::optional<Vector<3>> truth{};                ///< of the target [m]
  std::optional<double> raw_error{}, raw_angle{};  ///< of the measurement itself [m, deg]
  std::optional<ModeState> a{}, b{};
};

/// Both modes by all data. Throws Error when the solver cannot take the problem or does not converge.
std::vector<Instant> by_all_data(const Scenario& scenario, const Solver& solver);
/// Both as data come, by fixed-lag smoothing over the last 60 s: the newest state at each keyframe.
std::vector<Instant> as_data_come(const Scenario& scenario);
/// Those from a minute before the longest time without any measurement to a minute after it.
std::vector<Instant> about_the_longest_gap(const std::vector<Instant>& instants);

/// Table I: mean ± standard deviation of raw measurements, Mode A and Mode B by keyframe type; and below it, what the
/// paper claims and what is found here.
std::string table1(const std::vector<Instant>& instants);

/// Writes a file of a row a keyframe. Throws Error.
void write_instants(const std::vector<Instant>& instants, const std::filesystem::path& file);
/// Its columns, for documents.
CsvDescription file_columns(std::string file);

}  // namespace tandem::modes
