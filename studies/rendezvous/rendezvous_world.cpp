#include <cmath>
#include <numbers>

#include <tandem/studies/rendezvous/rendezvous_world.hpp>
#include <tandem/studies/simulation/pose_sigmas.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

constexpr double kCurrentSigma = 0.03;                   // σ of the current measured by the Doppler log [m/s]
constexpr double kSpeedSigma = 5e-3, kRateSigma = 1e-3;  // σ of the measured twist [m/s, rad/s]

}  // namespace

template <int N>
RendezvousWorld<N>::RendezvousWorld(const VehicleModel<N>& model, const RendezvousOptions& options)
    : options_(options),
      tick_(model, kTick),
      motion_(options.seed, options.target_speed),
      odometry_noise_(options.seed, 1),
      usbl_noise_(options.seed, 2),
      optical_noise_(options.seed, 3),
      twist_noise_(options.seed, 4),
      current_noise_(options.seed, 5) {
  NormalNoise draw(options.seed, 10);
  const double bearing = 0.7 * draw(), course = 2.0 * std::numbers::pi * draw();
  target_ = SE3(SO3::Exp({0.0, 0.0, course}), {0.0, 0.0, -10.0});
  const Vector<3> behind(-options.start_distance * std::cos(bearing), options.start_distance * std::sin(bearing),
                         2.0 * draw());
  const Vector<3> position = target_.act(behind), ahead = target_.translation() - position;
  chaser_.pose = SE3(SO3::Exp({0.0, 0.0, std::atan2(ahead.y(), ahead.x()) + 0.3 * draw()}), position);
  chaser_.twist[0] = options.target_speed;
  current_ = options.current * Vector<3>{draw(), draw(), 0.0};
  readings_.odometry = last_pose_ = chaser_.pose;
  read_sensors();
}

template <int N>
double RendezvousWorld<N>::miss(double behind) const {
  return (chaser_.pose.translation() - target_.act(pose_behind(behind).translation())).norm();
}

template <int N>
bool RendezvousWorld<N>::is_docked() const {
  const DockingTolerance within;
  const SE3 dock = pose_behind(options_.dock);
  const SE3 docked = target_ * dock;
  const SE3 off = docked.inverse() * chaser_.pose;
  const Vector<6> along = dock.inverse().Ad() * target_twist();
  const Vector<3> velocity = off.rotation().act(Vector<3>(chaser_.twist.template head<3>())) - along.head<3>();
  const Matrix<3, 3> R = off.rotation().matrix();
  const double heading = std::abs(std::atan2(R(1, 0), R(0, 0)));
  return off.translation().norm() <= within.position && kDegrees * heading <= within.heading &&
         velocity.norm() <= within.speed;
}

template <int N>
void RendezvousWorld<N>::advance(const Vector<N>& command) {
  chaser_ = tick_(chaser_, command, current_);
  target_ = target_ * SE3::Exp(kTick * target_twist());
  ++ticks_;
  readings_.odometry =
      readings_.odometry * last_pose_.inverse() * chaser_.pose *
      SE3::Exp(odometry_noise_.vector<6>(Vector<6>(std::sqrt(kTick) * Vector<6>(sensors_.noise.odometry))));
  last_pose_ = chaser_.pose;
  read_sensors();
}

template <int N>
Vector<6> RendezvousWorld<N>::measured_twist() {
  return chaser_.twist + twist_noise_.vector<6>(pose_sigmas(kSpeedSigma, kRateSigma));
}

template <int N>
Vector<3> RendezvousWorld<N>::measured_current() {
  return current_ + current_noise_.vector(kCurrentSigma);
}

/// Returns the target's body twist relative to the world, including the current.
template <int N>
Vector<6> RendezvousWorld<N>::target_twist() const {
  Vector<6> twist = motion_.twist(now());
  twist.head<3>() += target_.rotation().inverse().act(current_);
  return twist;
}

/// Updates all readings except the odometry.
template <int N>
void RendezvousWorld<N>::read_sensors() {
  readings_.t = now();
  readings_.usbl.reset();
  readings_.optical.reset();
  const SE3 seen = chaser_.pose.inverse() * target_;
  const Vector<3> p = seen.translation();
  const bool in_view = std::atan2(std::hypot(p.y(), p.z()), p.x()) < kCameraHalfAngle;
  Measurement m;
  m.t = now();
  if (ticks_ % kUsblEvery == 0) {
    m.position = p + usbl_noise_.vector<3>(Vector<3>(sensors_.sensors[0].sigma));
    readings_.usbl = m;
  }
  if (ticks_ % kOpticalEvery == 0 && p.norm() < kOpticalRange && in_view) {
    const Vector<6> error = optical_noise_.vector<6>(Vector<6>(sensors_.sensors[1].sigma));
    m.position = p + error.head<3>();
    m.rotation = seen.rotation() * SO3::Exp(error.tail<3>());
    readings_.optical = m;
  }
}

template class RendezvousWorld<3>;
template class RendezvousWorld<8>;

}  // namespace tandem
