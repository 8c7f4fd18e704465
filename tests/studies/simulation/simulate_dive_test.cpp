#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/navigation/navigation_checks.hpp>
#include <tandem/residuals/imu_prediction.hpp>
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/simulation/dive_motion.hpp>
#include <tandem/studies/simulation/simulate_dive_files.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

constexpr std::size_t kTruthEvery = 10;  // IMU samples

DiveOptions short_dive(Grade grade = Grade::mems) { return {.grade = grade, .minutes = 6}; }

/// Derivatives agree with central differences in every phase of the dive.
TEST(DiveMotion, DerivativesMatchCentralDifferences) {
  const DiveMotion motion(360, 0);
  const double h = DiveMotion::step;
  for (std::size_t k = 2; k + 2 < motion.size(); k += 97) {
    const Motion m = motion.at(k), after = motion.at(k + 1), before = motion.at(k - 1);
    const SE23 &x = m.state, &next = after.state, &last = before.state;
    const auto slope = [&](const Vector<3>& a, const Vector<3>& b) -> Vector<3> { return (a - b) / (2 * h); };
    // The error of a central difference is h²/6 times the third derivative.
    EXPECT_LE((slope(next.translation(), last.translation()) - x.velocity()).norm(), 1e-5) << motion.time(k);
    EXPECT_LE((slope(next.velocity(), last.velocity()) - m.acceleration).norm(), 1e-5);
    EXPECT_LE(((last.rotation().inverse() * next.rotation()).Log() / (2 * h) - m.rate).norm(), 1e-5);
    EXPECT_LE((slope(after.rate, before.rate) - m.angular_acceleration).norm(), 1e-5);
  }
}

TEST(DiveMotion, HasDepthSpeedAndTiltOfASurvey) {
  const DiveMotion motion(1200, 1);
  double deepest = 0, fastest = 0, tilt = 0, turning = 0;
  std::size_t at_surface = 0;
  for (std::size_t k = 0; k < motion.size(); k += 10) {
    const Motion m = motion.at(k);
    EXPECT_NEAR(m.depth, -m.state.translation().z(), 1e-12);
    deepest = std::max(deepest, m.depth);
    fastest = std::max(fastest, m.state.velocity().norm());
    tilt = std::max(tilt, std::acos(m.state.rotation().matrix()(2, 2)));
    turning = std::max(turning, m.rate.norm());
    at_surface += m.depth < 0.3;
  }
  EXPECT_NEAR(motion.time(motion.size() - 1), 1200, 1e-9);
  EXPECT_NEAR(deepest, 30, 1.0);
  EXPECT_LT(fastest, 2.0);
  EXPECT_GT(tilt, 0.1);
  EXPECT_LT(tilt, 0.5);
  EXPECT_LT(turning, 0.5);
  EXPECT_GT(at_surface, 1500u) << "60 s at each end, 40 s in between, and parts of the ramps";
  EXPECT_LT(at_surface, 2500u);
}

DiveOptions without_noise() {
  DiveOptions options = short_dive();
  options.noise = false;
  return options;
}

/// Compares IMU samples with finite differences of the sensor's pose in an inertial frame, independent of the formulas
/// of the simulation.
TEST(SimulateDive, ImuSamplesMatchDifferencesInAnInertialFrame) {
  const SimulatedDive dive = simulate_dive(without_noise());
  const ImuSensor& imu = *dive.data.imu;
  const Earth& earth = dive.data.earth;
  const DiveMotion motion(360, 0);
  const double h = 4 * DiveMotion::step;  // rounding and truncation errors are both about 1e-8
  for (std::size_t k = 8; k + 8 < motion.size(); k += 331) {
    const auto earth_rotation = [&](int steps) { return SO3::Exp(steps * DiveMotion::step * earth.rate); };
    const auto pose = [&](int steps) {
      const SE23 x = motion.at(std::size_t(std::ptrdiff_t(k) + steps)).state;
      return SE3(earth_rotation(steps), Vector<3>::Zero()) * SE3(x.rotation(), x.translation()) * imu.mount;
    };
    const auto p = [&](int steps) -> Vector<3> { return pose(steps).translation(); };
    const Vector<3> acceleration = (-p(8) - p(-8) + 16 * (p(4) + p(-4)) - 30 * p(0)) / (12 * h * h);
    // Earth::gravity includes the centrifugal acceleration, and so do the differences.
    const Vector<3> outwards = earth.rate.cross(earth.rate.cross(p(0)));
    const SO3 to_sensor = pose(0).rotation().inverse();
    const auto from_here = [&](int steps) -> Vector<3> { return (to_sensor * pose(steps).rotation()).Log(); };
    const Vector<3> rate = (8 * (from_here(4) - from_here(-4)) - (from_here(8) - from_here(-8))) / (12 * h);
    EXPECT_LE((imu.samples[k].specific_force - to_sensor.act(acceleration - outwards - earth.gravity)).norm(), 2e-6);
    EXPECT_LE((imu.samples[k].angular_rate - rate).norm(), 2e-6) << "the Earth turns at 7e-5 rad/s";
  }
}

/// Returns the position error at the end of the dive after integrating every `stride`-th IMU sample [m].
double off_by_integration(const SimulatedDive& dive, std::size_t stride) {
  const ImuSensor& imu = *dive.data.imu;
  const SE23 &begin = dive.truth.front().value, &end = dive.truth.back().value;
  ImuPrediction<> state{SE3(begin.rotation(), begin.translation()), BasicRn<3, double>(begin.velocity())};
  for (std::size_t i = 0; i + stride < imu.samples.size();) {
    ImuPreintegrator sum(imu.mount, imu.noise);
    for (int n = 0; n < 20; ++n, i += stride) sum.integrate(imu.samples[i], imu.samples[i + stride]);
    state = predict(state.pose, state.velocity, BasicRn<6, double>(Vector<6>::Zero()), sum.delta(), dive.data.earth);
  }
  return (state.pose.translation() - end.translation()).norm();
}

TEST(SimulateDive, IntegratedImuSamplesReproduceTheTruth) {
  const SimulatedDive dive = simulate_dive(without_noise());
  ASSERT_EQ(dive.data.imu->samples.size(), 36'001u);
  const double off = off_by_integration(dive, 1);
  EXPECT_LE(off, 0.1) << "dead reckoning over 540 m and 6 min";
  EXPECT_NEAR(off_by_integration(dive, 2) / off, 4.0, 0.4) << "the error is second order in the sampling interval";
}

TEST(SimulateDive, NoiseFreeSensorsMatchTheMotion) {
  const SimulatedDive dive = simulate_dive(without_noise());
  const DiveMotion motion(360, 0);
  ASSERT_EQ(dive.data.sensors.size(), 4u);
  for (const EgoSensor& sensor : dive.data.sensors) {
    ASSERT_FALSE(sensor.measurements.empty());
    for (const EgoMeasurement& m : sensor.measurements) {
      const SE23 x = motion.at(std::size_t(std::lround(m.t / DiveMotion::step))).state;
      const Vector<3> there = x.translation() + x.rotation().act(sensor.mount.translation());
      if (sensor.type == EgoSensorType::dvl) {
        EXPECT_LE((x.rotation().act(m.value) - x.velocity()).norm(), 1e-12);
      } else if (sensor.type == EgoSensorType::depth) {
        EXPECT_NEAR(m.value.z(), there.z(), 1e-12);
      } else if (sensor.type == EgoSensorType::gps) {
        EXPECT_LE((m.value - there).norm(), 1e-12);
        EXPECT_GT(x.translation().z(), -0.5) << "at the surface only";
      } else {
        ASSERT_EQ(sensor.type, EgoSensorType::heading);
        EXPECT_LE((m.rotation.inverse() * x.rotation()).Log().norm(), 1e-12);
      }
    }
  }
}

/// Expects that normalised errors have unit variance, within five standard deviations of their mean square.
void expect_unit_variance(const std::vector<double>& values, const std::string& what) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  EXPECT_NEAR(sum / double(values.size()), 1.0, 5 * std::sqrt(2.0 / double(values.size()))) << what;
}

TEST(SimulateDive, NoiseHasTheStatedSigmas) {
  for (const Grade grade : {Grade::mems, Grade::tactical}) {
    SCOPED_TRACE(name(grade));
    DiveOptions options = short_dive(grade), exact = without_noise();
    options.dvl_scale = exact.dvl_scale = false;
    const SimulatedDive dive = simulate_dive(options), clean = simulate_dive(exact);
    const ImuSensor& imu = *dive.data.imu;
    std::vector<double> force, rate, force_walk, rate_walk;
    for (std::size_t k = 0; k + kTruthEvery < imu.samples.size(); k += kTruthEvery) {
      const Vector<6> bias = dive.biases[k / kTruthEvery].value, next = dive.biases[k / kTruthEvery + 1].value;
      const Vector<3> f = imu.samples[k].specific_force - clean.data.imu->samples[k].specific_force - bias.head<3>();
      const Vector<3> w = imu.samples[k].angular_rate - clean.data.imu->samples[k].angular_rate - bias.tail<3>();
      for (int i = 0; i < 3; ++i) {
        force.push_back(f[i] * std::sqrt(0.01) / imu.noise.accelerometer);
        rate.push_back(w[i] * std::sqrt(0.01) / imu.noise.gyroscope);
        force_walk.push_back((next - bias)[i] / std::sqrt(0.1) / imu.noise.accelerometer_bias_walk);
        rate_walk.push_back((next - bias)[3 + i] / std::sqrt(0.1) / imu.noise.gyroscope_bias_walk);
      }
    }
    expect_unit_variance(force, "specific force");
    expect_unit_variance(rate, "angular rate");
    expect_unit_variance(force_walk, "accelerometer bias");
    expect_unit_variance(rate_walk, "gyroscope bias");
    for (std::size_t s = 0; s < dive.data.sensors.size(); ++s) {
      const EgoSensor &noisy = dive.data.sensors[s], &sharp = clean.data.sensors[s];
      std::vector<double> errors;
      for (std::size_t i = 0; i < noisy.measurements.size(); ++i) {
        const EgoMeasurement &m = noisy.measurements[i], &c = sharp.measurements[i];
        const Vector<3> e =
            noisy.type == EgoSensorType::heading ? (c.rotation.inverse() * m.rotation).Log() : m.value - c.value;
        if (noisy.type == EgoSensorType::depth)
          errors.push_back(e.z() / noisy.sigma[0]);
        else
          for (int row = 0; row < 3; ++row) errors.push_back(e[row] / noisy.sigma[row]);
      }
      expect_unit_variance(errors, noisy.name);
    }
  }
}

TEST(SimulateDive, ResultDependsOnTheSeed) {
  const auto last = [](std::uint64_t seed) {
    DiveOptions options = {.minutes = 1, .seed = seed};
    const SimulatedDive dive = simulate_dive(options);
    return std::pair{dive.data.imu->samples.back().specific_force, dive.data.sensors[3].measurements.back().value};
  };
  EXPECT_EQ(last(1), last(1));
  EXPECT_NE(last(1), last(2));
  EXPECT_NE(last(1), last(1 + (std::uint64_t(1) << 32)));
}

TEST(SimulateDive, SurfacingGivesGpsFixes) {
  const auto positions = [](int surfacings) {
    const SimulatedDive dive = simulate_dive({.minutes = 20, .surfacings = surfacings});
    std::size_t between = 0;
    for (const EgoMeasurement& m : dive.data.sensors[3].measurements) between += m.t > 200 && m.t < 1000;
    return between;
  };
  EXPECT_EQ(positions(0), 0u);
  EXPECT_NEAR(double(positions(1)), 70, 10);
  EXPECT_NEAR(double(positions(2)), 140, 20);
}

TEST(SimulateDive, FolderReadsBack) {
  const ScratchFolder folder;
  DiveOptions options = short_dive();
  options.latitude = -33.5;
  options.keyframe_interval = 0.5;
  SimulatedDive dive = simulate_dive(options);
  write_dive(dive, options, folder.path());
  EXPECT_THAT(files(folder.path()),
              testing::UnorderedElementsAre("scenario.yaml", "imu.csv", "dvl.csv", "depth.csv", "heading.csv",
                                            "gps.csv", "truth_chaser.tum", "truth_velocity.csv", "truth_bias.csv"));
  Scenario scenario = read_scenario(folder.path());
  NavigationData& data = scenario.navigation.value();
  EXPECT_EQ(data.keyframe_interval, 0.5);
  EXPECT_LE((data.earth.gravity - dive.data.earth.gravity).norm(), 1e-12);
  EXPECT_LE((data.earth.rate - dive.data.earth.rate).norm(), 1e-15);
  const ImuSensor &imu = *data.imu, &written = *dive.data.imu;
  ASSERT_EQ(imu.samples.size(), written.samples.size());
  EXPECT_LE((imu.mount.inverse() * written.mount).Log().norm(), 1e-12);
  EXPECT_EQ(imu.noise.gyroscope, written.noise.gyroscope);
  EXPECT_EQ(imu.initial_accelerometer_bias, written.initial_accelerometer_bias);
  for (std::size_t i = 0; i < imu.samples.size(); i += 1000) {
    EXPECT_LE((imu.samples[i].specific_force - written.samples[i].specific_force).norm(), 1e-7);
    EXPECT_LE((imu.samples[i].angular_rate - written.samples[i].angular_rate).norm(), 1e-9);
  }
  ASSERT_EQ(data.sensors.size(), dive.data.sensors.size());
  for (std::size_t s = 0; s < data.sensors.size(); ++s) {
    const EgoSensor &a = data.sensors[s], &b = dive.data.sensors[s];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.type, b.type);
    EXPECT_LE((a.sigma - b.sigma).norm(), 1e-5 * b.sigma.norm());
    EXPECT_LE((a.mount.inverse() * b.mount).Log().norm(), 1e-12);
    ASSERT_EQ(a.measurements.size(), b.measurements.size());
    EXPECT_NEAR(a.measurements.back().t, b.measurements.back().t, 1e-9);
    EXPECT_LE((a.measurements.back().value - b.measurements.back().value).norm(), 1e-6);
    EXPECT_LE((a.measurements.back().rotation.inverse() * b.measurements.back().rotation).Log().norm(), 1e-8);
  }
  EXPECT_EQ(scenario.truth_chaser.size(), dive.truth.size());
  EXPECT_LE((scenario.truth_chaser.back().value.translation() - dive.truth.back().value.translation()).norm(), 1e-5);

  std::vector<NavigationFinding::Kind> found;
  for (const NavigationFinding& finding : check(data)) found.push_back(finding.kind);
  EXPECT_THAT(found, testing::ElementsAre(NavigationFinding::Kind::silent)) << "only GPS is silent, under water";
}

TEST(SimulateDive, RejectsOptionsOutOfRange) {
  const auto rejection = [](const DiveOptions& options) { return error_of([&] { simulate_dive(options); }); };
  EXPECT_THAT(rejection({.minutes = 0.5}), HasSubstr("minutes must be 1 to 600 for a dive, not 0.5"));
  EXPECT_THAT(rejection({.minutes = 1000}), HasSubstr("for a dive, not 1000"));
  EXPECT_THAT(rejection({.latitude = 91}), HasSubstr("latitude must be -90 to 90 degrees, not 91"));
  EXPECT_THAT(rejection({.keyframe_interval = 0}), HasSubstr("keyframe_interval must be above 0.001 s, not 0 s"));
  EXPECT_THAT(rejection({.minutes = 10, .surfacings = 2}), HasSubstr("2 surfacings need 15 minutes or more, not 10"));
}

}  // namespace
}  // namespace tandem
