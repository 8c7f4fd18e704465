#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/estimation/estimate_metrics.hpp>
#include <tandem/studies/support/down_weighted.hpp>

namespace tandem {

/// What a robust loss left of one residual of a measurement.
struct PartWeight {
  std::string_view part;  ///< "all", or "position" or "orientation" where these are residuals of their own
  double weight;          ///< ρ′, 1 without a loss
};

/// What became of one measurement.
struct MeasurementOutcome {
  std::size_t sensor, index;  ///< in the data
  double t;                   ///< s, as stamped
  bool held_out = false;
  std::vector<PartWeight> parts{};       ///< none when held out
  std::optional<double> raw_position{};  ///< ‖z − t(C⁻¹T)‖ against the truth when it was valid [m]

  bool down_weighted() const;
};

/// What became of one sensor's measurements.
struct SensorOutcome {
  std::string name;
  SensorType type;
  double delay = 0;     ///< s
  bool robust = false;  ///< whether it has a robust loss
  int used = 0, held_out = 0;
  int left_out = 0;  ///< valid before the odometry begins, by the delay
  int down_weighted = 0;
  std::optional<MeanStd> raw_position{};  ///< of the measurements that give a position [m]
};

/// One each a measurement in the problem, in its order, weights at the problem's values.
std::vector<MeasurementOutcome> measurement_outcomes(const Scenario& scenario, const TrackingProblem& tracking);

/// One each a sensor.
std::vector<SensorOutcome> sensor_outcomes(const Scenario& scenario, const TrackingOptions& options,
                                           const TrackingProblem& tracking,
                                           const std::vector<MeasurementOutcome>& measurements);

}  // namespace tandem
