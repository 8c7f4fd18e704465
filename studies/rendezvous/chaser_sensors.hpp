#pragma once

#include <tandem/problem/planning/expected_fixes.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/studies/simulation/pose_sigmas.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {

/// Target sensors of the chaser in a simulated rendezvous: an omnidirectional USBL and a forward camera that measures
/// poses.
inline constexpr double kTick = 0.1;                         // Sampling interval of truth and odometry [s].
inline constexpr int kUsblEvery = 20;                        // Ticks between USBL fixes.
inline constexpr int kOpticalEvery = 5;                      // Ticks between optical poses.
inline constexpr double kOpticalRange = 9.0;                 // m
inline constexpr double kCameraHalfAngle = 45.0 / kDegrees;  // Half angle of view of the camera [rad].

/// Returns the sensors (USBL, then camera) and the noise that the chaser's estimator assumes, without measurements.
inline TrackingData chaser_sensors() {
  TrackingData data;
  data.noise.prior = pose_sigmas(1e-3, 1e-3);
  data.noise.odometry = pose_sigmas(0.01, 6e-4);
  data.noise.constant_twist = (Vector<6>() << 0.03, 0.01, 0.01, 4e-3, 4e-3, 0.015).finished();
  data.noise.constant_velocity = Vector<3>(0.05, 0.05, 0.02);
  TargetSensor usbl, optical;
  usbl.name = "usbl";
  usbl.sigma = Vector<3>::Constant(0.5);
  optical.name = "optical";
  optical.type = SensorType::pose;
  optical.sigma = pose_sigmas(0.05, 0.03);
  data.sensors = {usbl, optical};
  return data;
}

/// Returns the sensors as the planner expects their future fixes.
inline std::vector<ExpectedSensor> expected_sensors(const TrackingData& data) {
  FieldOfView sight;
  sight.range = kOpticalRange;
  sight.half_angle = kCameraHalfAngle;
  const Vector<3> usbl = data.sensors[0].sigma;
  const Vector<6> optical = data.sensors[1].sigma;
  return {{1.0 / (kTick * kUsblEvery), usbl, {}, {}},
          {1.0 / (kTick * kOpticalEvery), optical.head<3>(), Vector<3>(optical.tail<3>()), sight}};
}

}  // namespace tandem
