#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/navigation_results/navigation_report.hpp>

/// Parts that the table and the JSON document of a navigation share.
namespace tandem {

/// A row of the table of errors.
struct NavigationErrorRow {
  std::string name, key;  ///< name in tables, key in JSON
  NavigationErrorSummary errors;
};

/// Returns the errors at all keyframes and, with NavigationStudy::after, at the later ones.
std::vector<NavigationErrorRow> error_rows(const NavigationStudy& study);

/// Returns the error at the last keyframe that the truth covers, or null.
const NavigationError* last_compared(const NavigationStudy& study);

/// Returns the time between the first and the last keyframe [s].
double data_seconds(const Navigation& navigation);

/// Returns the ratio in percent; nothing if a value is absent or `whole` is not positive.
std::optional<double> percent_of(const std::optional<double>& part, const std::optional<double>& whole);

/// Biases at the end, along the axes of the IMU in the scenario's frame [m/s², rad/s].
struct FinalBiases {
  Vector<3> accelerometer, gyroscope;
  std::optional<Vector<3>> accelerometer_sigma, gyroscope_sigma;
};

/// Returns the biases at the last keyframe; nothing without an IMU.
std::optional<FinalBiases> final_biases(const NavigationStudy& study);

}  // namespace tandem
