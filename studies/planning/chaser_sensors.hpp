#pragma once

#include <tandem/problem/planning/expected_fixes.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/studies/simulation/pose_sigmas.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {

/// What the chaser of a simulated rendezvous senses of the target, and how often: USBL all around, and optical poses by a
/// camera that looks ahead.
inline constexpr double kTick = 0.1;   // s: truth and odometry
inline constexpr int kUsblEvery = 20;  // ticks
inline constexpr int kOpticalEvery = 5;
inline constexpr double kOpticalRange = 9.0;      // m
inline constexpr double kView = 45.0 / kDegrees;  // half angle of the camera [rad]

/// Sensors and noise, as the chaser knows them: USBL first, then the camera.
inline TrackingData sensors_of_chaser() {
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

/// The same, for fixes that are still to come.
inline std::vector<ExpectedSensor> expected_sensors(const TrackingData& data) {
  Sight sight;
  sight.range = kOpticalRange;
  sight.half_angle = kView;
  const Vector<3> usbl = data.sensors[0].sigma;
  const Vector<6> optical = data.sensors[1].sigma;
  return {{1.0 / (kTick * kUsblEvery), usbl, {}, {}},
          {1.0 / (kTick * kOpticalEvery), optical.head<3>(), Vector<3>(optical.tail<3>()), sight}};
}

}  // namespace tandem
