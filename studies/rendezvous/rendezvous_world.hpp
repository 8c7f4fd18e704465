#pragma once

#include <optional>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/residuals/vehicle/vehicle_step.hpp>
#include <tandem/studies/rendezvous/chaser_sensors.hpp>
#include <tandem/studies/rendezvous/rendezvous.hpp>
#include <tandem/studies/simulation/normal_noise.hpp>
#include <tandem/studies/simulation/swinging_target.hpp>

namespace tandem {

/// Returns the pose `behind` metres behind the target with the target's orientation, in the target's body frame.
inline SE3 pose_behind(double behind) { return SE3(SO3(), {-behind, 0.0, 0.0}); }

/// Sensor readings of the chaser at one instant.
struct RendezvousReadings {
  double t = 0.0;                            ///< s
  SE3 odometry;                              ///< dead-reckoned pose
  std::optional<Measurement> usbl, optical;  ///< measurements of the sensors of chaser_sensors()
};

/// True state of a simulated rendezvous (both vehicles and the current) with its sensor simulation.
template <int N>
class RendezvousWorld {
 public:
  /// Places the chaser behind the target. Both arguments must outlive this object.
  RendezvousWorld(const VehicleModel<N>& model, const RendezvousOptions& options);

  double now() const { return kTick * double(ticks_); }  ///< s
  const SE3& chaser() const { return chaser_.pose; }
  const SE3& target() const { return target_; }
  double distance() const { return (chaser_.pose.translation() - target_.translation()).norm(); }  ///< m
  /// Returns the distance of the chaser from the point `behind` metres behind the target [m].
  double miss(double behind) const;
  /// Returns whether the chaser is within DockingTolerance of the docked pose.
  bool is_docked() const;

  /// Advances the time by kTick with this actuator command of the chaser.
  void advance(const Vector<N>& command);

  /// Returns the readings of the current instant.
  const RendezvousReadings& readings() const { return readings_; }
  /// Return the chaser's twist (body axes) and the current (world axes), with new noise at each call.
  Vector<6> measured_twist();
  Vector<3> measured_current();

 private:
  Vector<6> target_twist() const;
  void read_sensors();

  const RendezvousOptions& options_;
  const TrackingData sensors_ = chaser_sensors();
  VehicleStep<N> tick_;
  SwingingTarget motion_;
  NormalNoise odometry_noise_, usbl_noise_, optical_noise_, twist_noise_, current_noise_;
  VehicleState<N> chaser_;
  SE3 target_, last_pose_;  // last_pose_: the chaser's at the last odometry reading
  Vector<3> current_ = Vector<3>::Zero();
  RendezvousReadings readings_;
  long ticks_ = 0;
};

extern template class RendezvousWorld<3>;
extern template class RendezvousWorld<8>;

}  // namespace tandem
