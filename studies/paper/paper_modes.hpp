#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <tandem/lie/error.hpp>
#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/support/csv.hpp>

/// Table I and Figures 1, 6 and 7 of Baxter & Teran Espinoza et al. 2025 on the built-in scenario docking_a: comparison
/// of Mode A and Mode B.
namespace tandem::modes {

/// Estimate of one mode at a keyframe.
struct ModeState {
  Vector<3> target;                     ///< position in the world [m]
  std::optional<double> error;          ///< error of the relative position [m]
  std::optional<double> angle;          ///< error of the relative orientation [deg]
  std::optional<double> three_sigma{};  ///< 3 √trace of the covariance of the relative position [m]
};

/// Estimates of both modes at a keyframe.
struct Instant {
  double t;  ///< s
  KeyframeType type;
  std::optional<Vector<3>> truth{};                ///< true position of the target [m]
  std::optional<double> raw_error{}, raw_angle{};  ///< errors of the measurement [m, deg]
  std::optional<ModeState> a{}, b{};
};

/// A solve that did not converge.
class NotConverged : public Error {
 public:
  using Error::Error;
};

/// Returns the batch estimates of both modes. Throws Error if the solver does not support the problem, and NotConverged
/// if it does not converge.
std::vector<Instant> batch_estimates(const Scenario& scenario, const AnySolver& solver);
/// Returns the newest state at each keyframe of both modes, by fixed-lag smoothing with a window of 60 s.
std::vector<Instant> online_estimates(const Scenario& scenario);
/// Returns the instants from 60 s before the longest interval without measurements to 60 s after it.
std::vector<Instant> around_longest_gap(const std::vector<Instant>& instants);

/// Returns Table I, mean ± standard deviation of the errors of raw measurements, Mode A and Mode B by keyframe type,
/// and the ratios that the paper reports.
std::string table1(const std::vector<Instant>& instants);

/// Returns the statistics of Table I as a JSON document. `figure` is its name: "table1".
std::string json(const std::string& figure, const std::vector<Instant>& instants);
/// Returns the keys of that document.
FileDescription json_keys();

/// Writes a CSV file with one row per keyframe. Throws Error if it cannot be written.
void write_instants(const std::vector<Instant>& instants, const std::filesystem::path& file);
/// Returns the columns of that file, for documentation.
FileDescription file_columns(std::string file);

}  // namespace tandem::modes
