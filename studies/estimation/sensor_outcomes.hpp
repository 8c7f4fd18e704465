#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/solvers/fit_report.hpp>
#include <tandem/studies/estimation/estimate_metrics.hpp>

namespace tandem {

/// Weight of one residual of a measurement.
struct PartWeight {
  std::string_view part;  ///< "all", or "position" or "orientation" if these are separate residuals
  double weight;          ///< ρ′ of the robust loss; 1 without a loss
};

/// Use of one measurement in the problem.
struct MeasurementOutcome {
  std::size_t sensor, index;  ///< sensor in the data, and measurement of the sensor
  double t;                   ///< stamp [s]
  bool held_out = false;
  std::vector<PartWeight> parts{};       ///< empty if held out
  std::optional<double> raw_position{};  ///< ‖z − t(C⁻¹T)‖ at the time when it was valid [m]

  /// Returns whether the weight of any part is below kDownweightThreshold.
  bool down_weighted() const;
};

/// Use of one sensor's measurements.
struct SensorOutcome {
  std::string name;
  SensorType type;
  double delay = 0;     ///< s
  bool robust = false;  ///< whether the sensor has a robust loss
  int used = 0, held_out = 0;
  int discarded = 0;  ///< number discarded, because they were valid before the odometry begins or after it ends
  int down_weighted = 0;
  std::optional<MeanStd> raw_position{};  ///< error of the measurements that give a position [m]
};

/// Returns the outcome of each measurement of the problem, in its order, with weights at its current values.
std::vector<MeasurementOutcome> measurement_outcomes(const Scenario& scenario, const TrackingProblem& tracking);

/// Summarises the outcomes of each sensor, in the order of the data.
std::vector<SensorOutcome> sensor_outcomes(const Scenario& scenario, const TrackingOptions& options,
                                           const TrackingProblem& tracking,
                                           const std::vector<MeasurementOutcome>& measurements);

}  // namespace tandem
