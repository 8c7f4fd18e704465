#pragma once

#include <optional>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/residuals/vehicle/vehicle_step.hpp>
#include <tandem/studies/planning/chaser_sensors.hpp>
#include <tandem/studies/planning/rendezvous.hpp>
#include <tandem/studies/planning/swinging_target.hpp>
#include <tandem/studies/simulation/normal_noise.hpp>

namespace tandem {

/// The pose so far behind the target that heads as it does, in the target's frame [m].
inline SE3 pose_behind(double behind) { return SE3(SO3(), {-behind, 0.0, 0.0}); }

/// What sensors tell the chaser at one instant.
struct RendezvousReadings {
  double t = 0.0;                            ///< s
  SE3 odometry;                              ///< dead reckoning since the start
  std::optional<Measurement> usbl, optical;  ///< as sensors_of_chaser() has them
};

/// The truth of a simulated rendezvous: both vehicles, the current that carries them, and what sensors make of it.
template <int N>
class RendezvousWorld {
 public:
  /// The chaser starts some way behind the target. Both arguments must live as long.
  RendezvousWorld(const VehicleModel<N>& model, const RendezvousOptions& options);

  double now() const { return kTick * double(ticks_); }  ///< s
  const SE3& chaser() const { return chaser_.pose; }
  const SE3& target() const { return target_; }
  double distance() const { return (chaser_.pose.translation() - target_.translation()).norm(); }  ///< m
  /// How far the chaser is from the place so far behind the target [m].
  double miss(double behind) const;
  bool is_docked() const;

  /// Goes on by kTick, with this command to the chaser's actuators.
  void advance(const Vector<N>& command);

  /// Of the instant that is now.
  const RendezvousReadings& readings() const { return readings_; }
  /// The chaser's twist, and the current, each with new noise at every call.
  Vector<6> measured_twist();
  Vector<3> measured_current();

 private:
  Vector<6> target_twist() const;
  void read_sensors();

  const RendezvousOptions& options_;
  const TrackingData sensors_ = sensors_of_chaser();
  VehicleStep<N> tick_;
  SwingingTarget motion_;
  NormalNoise odometry_noise_, usbl_noise_, optical_noise_, twist_noise_, current_noise_;
  VehicleState<N> chaser_;
  SE3 target_, last_pose_;  // the latter: of the chaser, at the readings
  Vector<3> current_ = Vector<3>::Zero();
  RendezvousReadings readings_;
  long ticks_ = 0;
};

extern template class RendezvousWorld<3>;
extern template class RendezvousWorld<8>;

}  // namespace tandem
