#include <algorithm>
#include <cmath>
#include <numbers>

#include <tandem/studies/simulation/dive_motion.hpp>

namespace tandem {
namespace {

constexpr double kCruise = 1.5, kDepth = 30.0;                // m/s, m
constexpr double kSurface = 60.0;                             // s at the surface, at the start and at the end
constexpr double kRamp = 90.0;                                // s for one descent or ascent
constexpr double kSurfacing = 40.0;                           // s at the surface in each intermediate surfacing
constexpr double kStraight = 120.0, kTurn = 40.0;             // s
constexpr double kCurrentEast = 0.06, kCurrentNorth = -0.04;  // m/s

/// Value of a function of time with its first two derivatives.
struct Jet {
  double f = 0, d = 0, dd = 0;

  friend Jet operator+(const Jet& a, const Jet& b) { return {a.f + b.f, a.d + b.d, a.dd + b.dd}; }
  friend Jet operator*(const Jet& a, const Jet& b) {
    return {a.f * b.f, a.d * b.f + a.f * b.d, a.dd * b.f + 2 * a.d * b.d + a.f * b.dd};
  }
  friend Jet operator*(double s, const Jet& a) { return {s * a.f, s * a.d, s * a.dd}; }
  friend Jet operator+(double s, const Jet& a) { return {s + a.f, a.d, a.dd}; }
};

Jet sine(double t, double period, double phase) {
  const double w = 2 * std::numbers::pi / period, s = std::sin(w * t + phase);
  return {s, w * std::cos(w * t + phase), -w * w * s};
}

/// Returns a step from 0 to 1 over [begin, begin + length] with three continuous derivatives.
Jet smooth_step(double t, double begin, double length) {
  const double x = (t - begin) / length, y = 1 - x;
  if (x <= 0) return {};
  if (x >= 1) return {1};
  return {x * x * x * x * (35 + x * (-84 + x * (70 - 20 * x))), 140 * x * x * x * y * y * y / length,
          420 * x * x * y * y * (y - x) / (length * length)};
}

}  // namespace

/// Closed-form part of the motion, with time derivatives.
struct DiveMotion::Profile {
  Jet surge, sway, height;  // m/s, m/s, m
  Jet yaw, pitch, roll;     // rad; pitch and roll have no valid second derivative
};

DiveMotion::DiveMotion(double duration, int surfacings) : ramp_(std::min(kRamp, duration / 8)) {
  const double surface = std::min(kSurface, duration / 10), up = std::min(kSurfacing, surface);
  const double begin = surface, end = duration - surface - ramp_;  // starts of the first dive and of the last ascent
  dives_ = {begin};
  for (int i = 1; i <= surfacings; ++i) {
    const double middle = begin + (end - begin) * i / (surfacings + 1);
    ascents_.push_back(middle - ramp_);
    dives_.push_back(middle + up);
  }
  ascents_.push_back(end);
  for (double t = begin + ramp_; t + kTurn < end; t += kStraight + kTurn) turns_.push_back(t);

  // Three-point Gauss-Legendre quadrature per step: exact to rounding for this slow motion.
  const double offset = 0.5 * std::sqrt(0.6) * step;
  const auto count = static_cast<std::size_t>(std::floor(duration / step + 1e-9));
  positions_.push_back(Vector<3>::Zero());
  for (std::size_t k = 0; k < count; ++k) {
    const double t = time(k) + 0.5 * step;
    positions_.push_back(positions_.back() +
                         step / 18 * (5 * velocity(t - offset) + 8 * velocity(t) + 5 * velocity(t + offset)));
  }
  // The quadrature gives only changes; the height is known in closed form.
  for (std::size_t k = 0; k < positions_.size(); ++k) positions_[k].z() = profile(time(k)).height.f;
}

DiveMotion::Profile DiveMotion::profile(double t) const {
  Jet down;
  for (const double begin : dives_) down = down + smooth_step(t, begin, ramp_);
  for (const double begin : ascents_) down = down + -1.0 * smooth_step(t, begin, ramp_);
  const Jet waves = 1.0 + -0.85 * down;  // decay with depth

  Profile p;
  p.surge = kCruise + 0.15 * sine(t, 170, 0.4);
  p.sway = 0.04 * sine(t, 37, 1.1);
  p.height = -1.0 * down * (kDepth + 0.6 * sine(t, 80, 0.0)) + 0.08 * waves * sine(t, 5.3, 0.3);
  p.yaw = 0.3 + 0.04 * sine(t, 23, 0.7) + 0.02 * waves * sine(t, 6.1, 0.2);
  for (std::size_t i = 0; i < turns_.size(); ++i)
    p.yaw = p.yaw + (i % 2 == 0 ? 1.0 : -1.0) * std::numbers::pi * smooth_step(t, turns_[i], kTurn);
  // The vehicle pitches down when it dives and banks when it turns.
  p.pitch = Jet{-0.5 / kCruise * p.height.d, -0.5 / kCruise * p.height.dd} + 0.015 * sine(t, 11, 2.0) +
            0.04 * waves * sine(t, 5.3, 1.2);
  p.roll = Jet{-0.6 * p.yaw.d, -0.6 * p.yaw.dd} + 0.02 * sine(t, 7.7, 0.9) + 0.06 * waves * sine(t, 4.4, 0.0);
  return p;
}

Vector<3> DiveMotion::velocity(double t) const {
  const Profile p = profile(t);
  const double c = std::cos(p.yaw.f), s = std::sin(p.yaw.f);
  return {p.surge.f * c - p.sway.f * s + kCurrentEast, p.surge.f * s + p.sway.f * c + kCurrentNorth, p.height.d};
}

Motion DiveMotion::at(std::size_t k) const {
  const double t = time(k);
  const Profile p = profile(t);
  const double c = std::cos(p.yaw.f), s = std::sin(p.yaw.f);
  const Vector<3> forward(c, s, 0), left(-s, c, 0);
  const auto rate = [](const Profile& q) {
    const double cr = std::cos(q.roll.f), sr = std::sin(q.roll.f), cp = std::cos(q.pitch.f), sp = std::sin(q.pitch.f);
    return Vector<3>(q.roll.d - q.yaw.d * sp, q.pitch.d * cr + q.yaw.d * cp * sr, -q.pitch.d * sr + q.yaw.d * cp * cr);
  };

  Motion m;
  const SO3 R = SO3::Exp({0, 0, p.yaw.f}) * SO3::Exp({0, p.pitch.f, 0}) * SO3::Exp({p.roll.f, 0, 0});
  SE23::Columns columns;
  columns << positions_[k], velocity(t);
  m.state = SE23(R, columns);
  m.acceleration = (p.surge.d - p.sway.f * p.yaw.d) * forward + (p.sway.d + p.surge.f * p.yaw.d) * left;
  m.acceleration.z() = p.height.dd;
  m.rate = rate(p);
  const double h = 1e-3;  // s: step of a fourth-order central difference; its error is about 1e-13 rad/s²
  const auto later = [&](double dt) { return rate(profile(t + dt)); };
  m.angular_acceleration = (8 * (later(h) - later(-h)) - (later(2 * h) - later(-2 * h))) / (12 * h);
  m.depth = -p.height.f;
  return m;
}

}  // namespace tandem
