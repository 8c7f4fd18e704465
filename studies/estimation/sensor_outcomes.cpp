#include <algorithm>

#include <tandem/studies/estimation/sensor_outcomes.hpp>

namespace tandem {
namespace {

std::vector<PartWeight> part_weights(const Problem& problem, const PlacedMeasurement& m) {
  std::vector<PartWeight> parts;
  // If the orientation is a separate residual, the first block has only the position.
  if (m.block) parts.push_back({m.orientation ? "position" : "all", problem.weight(*m.block)});
  if (m.orientation) parts.push_back({"orientation", problem.weight(*m.orientation)});
  if (m.position) parts.push_back({"position", problem.weight(*m.position)});
  if (parts.empty() && !m.innovation) parts.push_back({"all", 0.0});  // a gross outlier that the robust start discarded
  return parts;
}

bool robust(const Loss& loss) { return loss.kind != Loss::Kind::none; }

bool robust(const TargetSensor& sensor, const TrackingOptions& options) {
  const auto orientation = orientation_loss_of(sensor, options);
  return robust(loss_of(sensor, options)) || (sensor.type == SensorType::pose && orientation && robust(*orientation));
}

}  // namespace

bool MeasurementOutcome::down_weighted() const {
  return std::any_of(parts.begin(), parts.end(), [](const PartWeight& p) { return p.weight < kDownweightThreshold; });
}

std::vector<MeasurementOutcome> measurement_outcomes(const Scenario& scenario, const TrackingProblem& tracking) {
  std::vector<MeasurementOutcome> outcomes;
  for (const PlacedMeasurement& placed : tracking.measurements) {
    const TargetSensor& sensor = scenario.data.sensors[placed.sensor];
    const Measurement& m = sensor.measurements[placed.index];
    MeasurementOutcome& outcome = outcomes.emplace_back(
        MeasurementOutcome{placed.sensor, placed.index, m.t, m.held_out, part_weights(tracking.problem, placed), {}});
    const auto measured = sensor.position_in_chaser(m);
    const auto truth =
        true_relative_position(scenario, sensor.valid_at(m), tracking.chaser_pose(placed.keyframe).rotation());
    if (measured && truth) outcome.raw_position = (*measured - *truth).norm();
  }
  return outcomes;
}

std::vector<SensorOutcome> sensor_outcomes(const Scenario& scenario, const TrackingOptions& options,
                                           const TrackingProblem& tracking,
                                           const std::vector<MeasurementOutcome>& measurements) {
  std::vector<SensorOutcome> outcomes;
  for (std::size_t i = 0; i < scenario.data.sensors.size(); ++i) {
    const TargetSensor& sensor = scenario.data.sensors[i];
    SensorOutcome& outcome =
        outcomes.emplace_back(SensorOutcome{sensor.name, sensor.type, sensor.delay, robust(sensor, options)});
    outcome.discarded = static_cast<int>(tracking.num_discarded[i]);
    Moments raw;
    for (const MeasurementOutcome& m : measurements) {
      if (m.sensor != i) continue;
      ++(m.held_out ? outcome.held_out : outcome.used);
      outcome.down_weighted += m.down_weighted();
      raw.add(m.raw_position);
    }
    outcome.raw_position = raw.mean_std();
  }
  return outcomes;
}

}  // namespace tandem
