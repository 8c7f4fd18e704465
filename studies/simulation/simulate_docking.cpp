#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>
#include <tandem/studies/simulation/normal_noise.hpp>
#include <tandem/studies/simulation/number_rows.hpp>
#include <tandem/studies/simulation/simulate_docking.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/tum.hpp>

namespace tandem {
namespace {

constexpr double kStep = 0.1;                       // s: odometry and truth
constexpr double kTurnRadius = 35.0, kLeg = 180.0;  // m
constexpr double kSpeed = 1.0;                      // m/s
constexpr double kApproach = 240.0;                 // s: to fall back and come up again
constexpr double kOpticalRange = 9.0;               // m
constexpr int kUsblEvery = 42, kOpticalEvery = 5;   // steps
constexpr double kBlind = 0.2;                      // share of spells of 60 s in which a sensor sees nothing
constexpr int kSpell = 600;                         // steps

struct Course {
  double x, y, heading;
};

/// Where a vessel is after s metres: legs of kLeg to and fro, joined by half circles, always onwards in y.
Course on_course(double s) {
  const double turn = std::numbers::pi * kTurnRadius, lap = kLeg + turn;
  const double n = std::floor(s / lap), along = s - n * lap;
  const bool back = std::fmod(std::abs(n), 2.0) == 1.0;
  const double direction = back ? -1 : 1, y = 2 * kTurnRadius * n;
  const double start = back ? kLeg : 0;
  if (along <= kLeg) return {start + direction * along, y, back ? std::numbers::pi : 0.0};
  const double angle = (along - kLeg) / kTurnRadius;
  return {start + direction * (kLeg + kTurnRadius * std::sin(angle)), y + kTurnRadius * (1 - std::cos(angle)),
          back ? std::numbers::pi - angle : angle};
}

SE3 pose_on_course(double s, double sideways, double height, double t, double sway) {
  const Course c = on_course(s);
  const double heading = c.heading + 0.02 * std::sin(2 * std::numbers::pi * t / 19);
  const Vector<3> p(c.x - sideways * std::sin(c.heading), c.y + sideways * std::cos(c.heading), height);
  return SE3(SO3::Exp({0, 0, heading}) * SO3::Exp({0, sway * std::sin(2 * std::numbers::pi * t / 5.3), 0}) *
                 SO3::Exp({sway * std::sin(2 * std::numbers::pi * t / 4.1 + 1), 0, 0}),
             p);
}

/// How far the chaser is behind the target [m], along the course.
double distance_behind(double t) {
  const double phase = t / kApproach - std::floor(t / kApproach);
  const double far = 40.0, near = 5.5;
  // Far for the first half, near for a third, smooth in between.
  const auto step = [&](double at, double width) {
    const double x = std::clamp((phase - at) / width, 0.0, 1.0);
    return x * x * x * (10 + x * (-15 + 6 * x));
  };
  return far - (far - near) * (step(0.35, 0.2) - step(0.85, 0.15));
}

bool sees(std::uint64_t seed, std::uint32_t stream, int k) {
  NormalNoise draw(seed + std::uint64_t(k / kSpell) * 1000003, stream);
  return std::erfc(draw() / std::numbers::sqrt2) / 2 > kBlind;
}

Vector<6> six(double position, double angle) {
  return (Vector<6>() << Vector<3>::Constant(position), Vector<3>::Constant(angle)).finished();
}

}  // namespace

SimulatedDocking simulate_docking(const DockingOptions& options) {
  if (!(options.minutes >= 1 && options.minutes <= 6000))
    throw Error(fmt::format("a simulated docking takes 1 to 6000 minutes, not {:g}", options.minutes));
  SimulatedDocking docking;
  TrackingNoise& noise = docking.data.noise;
  noise.prior = six(1e-3, 1e-3);
  noise.odometry = six(0.01, 6e-4);
  noise.constant_twist = (Vector<6>() << 0.15, 0.05, 0.05, 0.02, 0.02, 0.06).finished();
  noise.constant_velocity = Vector<3>(0.15, 0.15, 0.05);
  TargetSensor usbl, optical;
  usbl.name = "usbl";
  usbl.sigma = Vector<3>::Constant(1.72);
  optical.name = "optical";
  optical.type = SensorType::pose;
  optical.sigma = six(0.137, 0.04);

  NormalNoise odometry_noise(options.seed, 0), usbl_noise(options.seed, 1), optical_noise(options.seed, 2);
  const int steps = static_cast<int>(std::lround(60 * options.minutes / kStep));
  SE3 reckoned;
  for (int k = 0; k <= steps; ++k) {
    const double t = kStep * k, s = kSpeed * t;
    const SE3 target = pose_on_course(s, 0, 0.4 + 0.1 * std::sin(2 * std::numbers::pi * t / 6.1), t, 0.03);
    const SE3 chaser =
        pose_on_course(s - distance_behind(t), 2 * std::sin(2 * std::numbers::pi * t / 300), -3, t, 0.01);
    if (k == 0)
      reckoned = chaser;
    else
      reckoned = reckoned * docking.truth_chaser.back().value.inverse() * chaser *
                 SE3::Exp(odometry_noise.vector<6>(std::sqrt(kStep) * Vector<6>(noise.odometry)));
    docking.data.odometry.push_back({t, reckoned});
    docking.truth_chaser.push_back({t, chaser});
    docking.truth_target.push_back({t, target});

    const SE3 seen = chaser.inverse() * target;
    const bool near = seen.translation().norm() < kOpticalRange;
    Measurement m;
    m.t = t;
    if (near && k % kOpticalEvery == 0 && sees(options.seed, 3, k)) {
      const Vector<6> error = optical_noise.vector<6>(Vector<6>(optical.sigma));
      m.position = seen.translation() + error.head<3>();
      m.rotation = seen.rotation() * SO3::Exp(error.tail<3>());
      optical.measurements.push_back(m);
    } else if (!near && k % kUsblEvery == 0 && (k == 0 || sees(options.seed, 4, k))) {
      m.position = seen.translation() + usbl_noise.vector<3>(Vector<3>(usbl.sigma));
      usbl.measurements.push_back(m);
    }
  }
  docking.data.sensors = {std::move(usbl), std::move(optical)};
  return docking;
}

void write_docking(const SimulatedDocking& docking, const DockingOptions& options,
                   const std::filesystem::path& folder) {
  const TrackingNoise& noise = docking.data.noise;
  const auto list = [](const Eigen::VectorXd& v) {
    return fmt::format("[{:g}]", fmt::join(v.data(), v.data() + v.size(), ", "));
  };
  const TargetSensor &usbl = docking.data.sensors[0], &optical = docking.data.sensors[1];
  write_file(folder / "scenario.yaml",
             fmt::format("name: docking_{}\n"
                         "description: Simulated opto-acoustic rendezvous of {:g} minutes\n"
                         "source: simulated by tandem, seed {}\n"
                         "keyframe_interval: {:g}\n"
                         "noise:   # standard deviations [m, rad]; pose tangents ordered x y z, then rotation\n"
                         "  prior: {}\n  odometry: {}\n  usbl: {}\n  optical: {}\n  constant_twist: {}\n"
                         "  constant_velocity: {}\n",
                         options.seed, options.minutes, options.seed, docking.data.keyframe_interval, list(noise.prior),
                         list(noise.odometry), list(usbl.sigma), list(optical.sigma), list(noise.constant_twist),
                         list(noise.constant_velocity)));

  const auto write_poses = [&](const std::string& file, const std::vector<Stamped<SE3>>& poses) {
    std::string text = tum_header;
    for (const auto& [t, pose] : poses) text += tum_row(t, pose, TumDecimals{3, 5, 8});
    write_file(folder / file, text);
  };
  write_poses("chaser_odometry.tum", docking.data.odometry);
  write_poses("truth_chaser.tum", docking.truth_chaser);
  write_poses("truth_target.tum", docking.truth_target);

  for (const TargetSensor* sensor : {&usbl, &optical}) {
    std::vector<NumberRow> rows;
    for (const Measurement& m : sensor->measurements) {
      Eigen::VectorXd row(sensor->type == SensorType::pose ? 7 : 3);
      row.head<3>() = m.position;
      if (row.size() == 7) row.tail<4>() = m.rotation.quaternion().coeffs();
      rows.push_back({m.t, row});
    }
    const auto table = number_columns(columns(sensor->type, false), 3, [](const std::string& name, double value) {
      return CsvCell::fixed(value, name.starts_with("q") ? 8 : 5);
    });
    write_file(folder / (sensor->name + ".csv"), table.text(rows));
  }
}

}  // namespace tandem
