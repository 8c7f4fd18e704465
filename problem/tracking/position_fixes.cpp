#include <algorithm>

#include <tandem/problem/tracking/position_fixes.hpp>

namespace tandem::detail {

std::vector<UsableMeasurement> usable_measurements(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                                   const std::vector<std::vector<bool>>& skip) {
  std::vector<UsableMeasurement> usable;
  for (std::size_t s = 0; s < data.sensors.size(); ++s)
    for (std::size_t i = 0; i < data.sensors[s].measurements.size(); ++i) {
      const Measurement& m = data.sensors[s].measurements[i];
      if (m.held_out || (!skip.empty() && skip[s][i])) continue;
      if (const auto k = keyframe_at(keyframes, data.sensors[s].valid_at(m))) usable.push_back({s, i, *k});
    }
  return usable;
}

double position_variance(SensorType type, const Eigen::VectorXd& sigma, bool planar, double range) {
  if (type->has(measured::range)) {
    const double across = range * sigma.tail(sigma.size() - 1).norm();
    return (sigma[0] * sigma[0] + across * across) / double(sigma.size());
  }
  const int n = planar ? 2 : 3;
  return sigma.head(n).squaredNorm() / double(n);
}

std::vector<PositionFix> measured_positions(const TrackingData& data, const std::vector<Keyframe>& keyframes,
                                            const std::vector<SE3>& chaser, const std::vector<std::vector<bool>>& skip,
                                            const std::vector<SE3>* target) {
  std::vector<PositionFix> fixes;
  for (const auto& [s, i, k] : usable_measurements(data, keyframes, skip)) {
    const TargetSensor& sensor = data.sensors[s];
    const auto position = sensor.position_in_chaser(sensor.measurements[i]);
    if (!position) continue;
    Vector<3> lever = Vector<3>::Zero();
    if (target && !sensor.type->has(measured::rotation))
      lever = (*target)[k].rotation().act(sensor.marker.translation());
    fixes.push_back({k, chaser[k].act(*position) - lever,
                     position_variance(sensor.type, sensor.sigma, data.planar, position->stableNorm()), s, i});
  }
  std::stable_sort(fixes.begin(), fixes.end(), [](const auto& a, const auto& b) { return a.keyframe < b.keyframe; });
  return fixes;
}

double target_acceleration_density(const TrackingData& data) {
  const TrackingNoise& noise = data.noise;
  for (const Eigen::VectorXd* sigma : {&noise.constant_twist, &noise.acceleration, &noise.constant_velocity})
    if (const double largest = sigma->head(data.planar ? 2 : 3).maxCoeff(); largest > 0) return largest * largest;
  return 0;
}

}  // namespace tandem::detail
