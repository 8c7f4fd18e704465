#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/studies/simulation/docking_parameters.hpp>
#include <tandem/studies/simulation/normal_noise.hpp>
#include <tandem/studies/simulation/pose_sigmas.hpp>
#include <tandem/studies/simulation/simulate_docking.hpp>

namespace tandem {
namespace {

constexpr double kStep = 0.1;         // s: sampling interval of odometry and truth.
constexpr double kLeg = 180.0;        // m: straight legs of the circuit.
constexpr double kClimb = -0.1;       // Slope of the helix.
constexpr double kWeave = 60.0;       // s: period of the lateral oscillation.
constexpr double kHoverTurn = 600.0;  // s: full turn of a hovering target.
constexpr double kChaserDepth = 3.0;  // m below the target's waterline.

double wave(double t, double period, double phase = 0) { return std::sin(2 * std::numbers::pi * t / period + phase); }

struct Course {
  double x, y, heading;
};

/// Returns the circuit after s metres: legs of kLeg in alternating directions, joined by half circles that advance in
/// y.
Course on_circuit(double s, double radius) {
  const double turn = std::numbers::pi * radius, lap = kLeg + turn;
  const double n = std::floor(s / lap), along = s - n * lap;
  const bool back = std::fmod(std::abs(n), 2.0) == 1.0;
  const double direction = back ? -1 : 1, y = 2 * radius * n;
  const double start = back ? kLeg : 0;
  if (along <= kLeg) return {start + direction * along, y, back ? std::numbers::pi : 0.0};
  const double angle = (along - kLeg) / radius;
  return {start + direction * (kLeg + radius * std::sin(angle)), y + radius * (1 - std::cos(angle)),
          back ? std::numbers::pi - angle : angle};
}

/// Motion of the target and of the chaser, which follows on the same course.
class DockingMotion {
 public:
  explicit DockingMotion(const DockingOptions& options) : o_(options) {}

  SE3 target(double t) const {
    const bool hovers = o_.motion == TargetMotion::hover;
    const double sideways = o_.weave * wave(t, kWeave);
    const double rate = o_.weave * 2 * std::numbers::pi / kWeave * wave(t, kWeave, std::numbers::pi / 2);
    const double turned = hovers ? 2 * std::numbers::pi * t / kHoverTurn : std::atan2(rate, o_.speed);
    return on_course(hovers ? 0 : o_.speed * t, sideways, turned, 0.4 + 0.1 * wave(t, 6.1), t, o_.waves);
  }
  SE3 chaser(double t) const {
    const double way = o_.motion == TargetMotion::hover ? 0 : o_.speed * t;
    return on_course(way - distance_behind(t), 2 * wave(t, 300), 0, -kChaserDepth, t, 0.01);
  }

 private:
  Course course(double s) const {
    const double r = o_.turn_radius;
    switch (o_.motion) {
      case TargetMotion::circuit:
        return on_circuit(s, r);
      case TargetMotion::circle:
      case TargetMotion::helix:
        return {r * std::sin(s / r), r * (1 - std::cos(s / r)), s / r};
      case TargetMotion::straight:
      case TargetMotion::hover:
        break;
    }
    return {s, 0, 0};
  }

  SE3 on_course(double s, double sideways, double turned, double height, double t, double sway) const {
    const Course c = course(s);
    const bool helix = o_.motion == TargetMotion::helix;
    if (helix) height += kClimb * s;
    const double heading = c.heading + turned + 0.02 * wave(t, 19);
    const double pitch = (helix ? std::atan(-kClimb) : 0.0) + sway * wave(t, 5.3);
    const Vector<3> p(c.x - sideways * std::sin(c.heading), c.y + sideways * std::cos(c.heading), height);
    if (o_.planar) return SE3(SO3::Exp({0, 0, heading}), Vector<3>(p.x(), p.y(), 0));
    return SE3(SO3::Exp({0, 0, heading}) * SO3::Exp({0, pitch, 0}) * SO3::Exp({sway * wave(t, 4.1, 1), 0, 0}), p);
  }

  /// Returns the distance of the chaser behind the target along the course, periodic with o_.approach [m].
  double distance_behind(double t) const {
    const double phase = t / o_.approach - std::floor(t / o_.approach);
    const auto step = [&](double at, double width) {
      const double x = std::clamp((phase - at) / width, 0.0, 1.0);
      return x * x * x * (10 + x * (-15 + 6 * x));
    };
    return o_.far - (o_.far - o_.near) * (step(0.35, 0.2) - step(0.85, 0.15));
  }

  const DockingOptions& o_;
};

/// Maps a standard normal number to a uniform one in (0, 1).
double uniform_from_normal(double normal) { return std::erfc(normal / std::numbers::sqrt2) / 2; }

/// Random visibility of the target for one sensor, drawn once per spell.
class SensorVisibility {
 public:
  SensorVisibility(const DockingOptions& options, std::uint32_t stream)
      : seed_(options.seed), stream_(stream), blind_(options.blind), steps_(whole_steps(options.spell)) {}
  static int whole_steps(double seconds) { return std::max(1, static_cast<int>(std::lround(seconds / kStep))); }

  bool operator()(int k) {
    if (const int spell = k / steps_; spell != spell_) {
      spell_ = spell;
      NormalNoise draw(seed_ + std::uint64_t(spell) * 1000003, stream_);
      sees_ = uniform_from_normal(draw()) > blind_;
    }
    return sees_;
  }

 private:
  std::uint64_t seed_;
  std::uint32_t stream_;
  double blind_;
  int steps_, spell_ = -1;
  bool sees_ = true;
};

/// Returns the standard deviations of a pose: all six in space, or x, y and heading in the plane.
Eigen::VectorXd group_sigmas(const Vector<6>& sigma, bool planar) {
  if (!planar) return sigma;
  return Vector<3>(sigma[0], sigma[1], sigma[5]);
}
/// Returns the error; in the plane, only its x, y and heading components.
Vector<6> restrict_to_group(const Vector<6>& error, bool planar) {
  if (!planar) return error;
  return (Vector<6>() << error.head<2>(), Vector<3>::Zero(), error[5]).finished();
}

/// Generator of USBL fixes with outliers.
class UsblFixes {
 public:
  explicit UsblFixes(const DockingOptions& options)
      : o_(options), noise_(options.seed, 1), outlier_draw_(options.seed, 5), outlier_noise_(options.seed, 6) {}

  /// Returns a fix of a target at p in the chaser's body frame.
  Measurement at(double t, const Vector<3>& p) {
    Measurement m;
    m.t = t + o_.usbl_latency;
    Vector<3> draw = noise_.vector(1.0);
    const bool outlier = o_.usbl_outliers > 0 && uniform_from_normal(outlier_draw_()) < o_.usbl_outliers;
    if (o_.usbl == UsblKind::position) {
      m.position = p + level(outlier ? outlier_noise_.vector(o_.usbl_outlier_sigma) : Vector<3>(o_.usbl_sigma * draw));
      return m;
    }
    if (o_.planar) draw[2] = 0;
    const Vector<3> seen = outlier ? Vector<3>(p + level(outlier_noise_.vector(o_.usbl_outlier_sigma))) : p;
    const double sigma = outlier ? 0.0 : o_.usbl_bearing_sigma, across = std::hypot(seen.x(), seen.y());
    m.range = seen.norm() + (outlier ? 0.0 : o_.usbl_sigma * draw[0]);
    m.elevation = std::atan2(seen.z(), across) + sigma * draw[2];
    m.azimuth = std::atan2(seen.y(), seen.x()) + sigma * draw[1] * seen.norm() / std::max(across, 1e-3);
    return m;
  }

 private:
  Vector<3> level(Vector<3> error) const {
    if (o_.planar) error.z() = 0;
    return error;
  }

  const DockingOptions& o_;
  NormalNoise noise_, outlier_draw_, outlier_noise_;
};

void check_options(const DockingOptions& options) {
  if (!(options.minutes >= 1 && options.minutes <= 6000))
    throw Error(fmt::format("minutes must be 1 to 6000 for a docking, not {:g}", options.minutes));
  if (options.planar && options.motion == TargetMotion::helix)
    throw Error("planar excludes target_motion helix: a helix is not planar");
  DockingOptions ignored;
  for (const auto& parameter : docking_parameters()) parameter.set(ignored, parameter.name, parameter.text(options));
  if (options.near > options.far)
    throw Error(fmt::format("near must be at most far ({:g} m), not {:g} m", options.far, options.near));
  if (options.gap >= options.gap_period)
    throw Error(fmt::format("gap must be less than gap_period ({:g} s), not {:g} s", options.gap_period, options.gap));
}

std::vector<std::pair<double, double>> gaps_of(const DockingOptions& options) {
  std::vector<std::pair<double, double>> gaps;
  if (options.gap > 0)
    for (double t = options.gap_period / 2; t + options.gap <= 60 * options.minutes; t += options.gap_period)
      gaps.emplace_back(t, t + options.gap);
  return gaps;
}

/// Sets the noise that the estimator assumes.
void add_noise(const DockingOptions& options, TrackingNoise& noise) {
  const bool planar = options.planar;
  noise = TrackingNoise(planar);
  noise.prior = group_sigmas(pose_sigmas(1e-3, 1e-3), planar);
  noise.odometry = group_sigmas(pose_sigmas(options.odometry_sigma, options.odometry_angle_sigma), planar);
  noise.constant_twist = group_sigmas((Vector<6>() << 0.15, 0.05, 0.05, 0.02, 0.02, 0.06).finished(), planar);
  noise.constant_velocity = Vector<3>(0.15, 0.15, 0.05).head(planar ? 2 : 3);
}

TargetSensor usbl_sensor(const DockingOptions& options) {
  TargetSensor usbl;
  usbl.name = "usbl";
  usbl.sigma = Eigen::VectorXd::Constant(options.planar ? 2 : 3, options.usbl_sigma);
  usbl.delay = options.usbl_latency;
  if (options.usbl == UsblKind::range_bearing) {
    usbl.type = SensorType::range_bearing;
    usbl.sigma.tail(usbl.sigma.size() - 1).setConstant(options.usbl_bearing_sigma);
  }
  return usbl;
}

TargetSensor optical_sensor(const DockingOptions& options) {
  TargetSensor optical;
  optical.name = "optical";
  optical.type = SensorType::pose;
  optical.sigma = group_sigmas(pose_sigmas(options.optical_sigma, options.optical_angle_sigma), options.planar);
  return optical;
}

/// Returns the dead-reckoned pose after the motion from `before` to `now`, with scale error and yaw drift, without
/// noise.
SE3 advance_odometry(const SE3& reckoned, const SE3& before, const SE3& now, const DockingOptions& options) {
  if (options.odometry_scale == 0 && options.odometry_yaw_drift == 0) return reckoned * before.inverse() * now;
  const SE3 step = before.inverse() * now;
  return reckoned * SE3(step.rotation() * SO3::Exp({0, 0, options.odometry_yaw_drift * kStep}),
                        (1 + options.odometry_scale) * step.translation());
}

}  // namespace

std::vector<TargetSensor> docking_sensors(const DockingOptions& options) {
  return {usbl_sensor(options), optical_sensor(options)};
}

SimulatedDocking simulate_docking(const DockingOptions& options) {
  check_options(options);
  SimulatedDocking docking;
  docking.data.planar = options.planar;
  docking.data.keyframe_interval = options.keyframe_interval;
  add_noise(options, docking.data.noise);
  TargetSensor usbl = usbl_sensor(options), optical = optical_sensor(options);
  docking.gaps = gaps_of(options);

  NormalNoise odometry_noise(options.seed, 0), optical_noise(options.seed, 2);
  UsblFixes fixes(options);
  SensorVisibility optical_sees(options, 3), usbl_sees(options, 4);
  const DockingMotion motion(options);
  const int steps = static_cast<int>(std::lround(60 * options.minutes / kStep));
  const int usbl_every = SensorVisibility::whole_steps(options.usbl_period);
  const int optical_every = SensorVisibility::whole_steps(options.optical_period);
  const double least_cosine = std::cos(options.optical_view / 2 * std::numbers::pi / 180);
  const Vector<6> sigma = std::sqrt(kStep) * pose_sigmas(options.odometry_sigma, options.odometry_angle_sigma);
  const Vector<6> optical_sigma = pose_sigmas(options.optical_sigma, options.optical_angle_sigma);
  auto gap = docking.gaps.begin();
  SE3 reckoned;
  for (int k = 0; k <= steps; ++k) {
    const double t = kStep * k;
    const SE3 target = motion.target(t), chaser = motion.chaser(t);
    reckoned = k == 0 ? chaser
                      : advance_odometry(reckoned, docking.truth_chaser.back().value, chaser, options) *
                            SE3::Exp(restrict_to_group(odometry_noise.vector<6>(sigma), options.planar));
    docking.data.odometry.push_back({t, reckoned});
    docking.truth_chaser.push_back({t, chaser});
    docking.truth_target.push_back({t, target});

    while (gap != docking.gaps.end() && t > gap->second) ++gap;
    if (gap != docking.gaps.end() && t >= gap->first) continue;
    const SE3 seen = chaser.inverse() * target;
    const double distance = seen.translation().norm();
    const bool near = distance < options.optical_range;
    const bool in_view = options.optical_view >= 360 || seen.translation().x() >= least_cosine * distance;
    if (near && in_view && k % optical_every == 0 && optical_sees(k)) {
      const Vector<6> error = restrict_to_group(optical_noise.vector<6>(optical_sigma), options.planar);
      Measurement m;
      m.t = t;
      m.position = seen.translation() + error.head<3>();
      m.rotation = seen.rotation() * SO3::Exp(error.tail<3>());
      optical.measurements.push_back(m);
    } else if (!near && k % usbl_every == 0 && (k == 0 || usbl_sees(k))) {
      const Measurement m = fixes.at(t, seen.translation());
      if (m.t <= 60 * options.minutes) usbl.measurements.push_back(m);
    }
  }
  docking.data.sensors = {std::move(usbl), std::move(optical)};
  return docking;
}

}  // namespace tandem
