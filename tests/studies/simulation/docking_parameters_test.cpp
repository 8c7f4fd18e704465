#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/simulation/docking_parameters.hpp>
#include <tandem/studies/simulation/simulate_docking_files.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

DockingOptions with(std::initializer_list<std::pair<const char*, const char*>> settings) {
  DockingOptions options;
  for (const auto& [name, value] : settings)
    parameter_named(docking_parameters(), "a test", name).set(options, name, value);
  return options;
}

TEST(DockingParameters, DefaultsRoundTrip) {
  for (const auto& parameter : docking_parameters()) {
    SCOPED_TRACE(parameter.name);
    DockingOptions options;
    parameter.set(options, parameter.name, parameter.text(DockingOptions()));
    EXPECT_EQ(changed_parameters(options), "");
    EXPECT_FALSE(parameter.doc.empty());
  }
  EXPECT_EQ(changed_parameters(with({{"gap", "30.0"}, {"target_motion", "helix"}})), "target_motion=helix, gap=30");
}

TEST(DockingParameters, ErrorsNameParameterAndRange) {
  EXPECT_THAT(error_of([] {
                with({{"usbl_sigm", "1"}});
              }),
              HasSubstr("unknown parameter 'usbl_sigm'; did you mean usbl_sigma?"));
  EXPECT_THAT(error_of([] {
                with({{"usbl_sigma", "-1"}});
              }),
              HasSubstr("usbl_sigma takes a number from 0.001 to 1000, not -1"));
  EXPECT_THAT(error_of([] { with({{"usbl_sigma", "much"}}); }), HasSubstr("usbl_sigma"));
  EXPECT_THAT(error_of([] { with({{"target_motion", "circel"}}); }), HasSubstr("did you mean circle?"));
  EXPECT_THAT(error_of([] {
                simulate_docking(with({{"gap", "120"}, {"gap_period", "100"}}));
              }),
              HasSubstr("gap must be less than gap_period (100 s), not 120 s"));
  EXPECT_THAT(error_of([] {
                simulate_docking(with({{"near", "50"}}));
              }),
              HasSubstr("near must be at most far (40 m), not 50 m"));
}

TEST(DockingParameters, ReadsYamlDescription) {
  const ScratchFolder folder;
  DockingOptions options;
  read_docking_description(folder.write("a.yaml", "minutes: 3\nseed: 9\nwaves: 0.1\n"), options);
  EXPECT_EQ(options.minutes, 3);
  EXPECT_EQ(options.seed, 9u);
  EXPECT_EQ(options.waves, 0.1);
  const auto refused = [&](const std::string& text) {
    return error_of([&] { read_docking_description(folder.write("b.yaml", text), options); });
  };
  EXPECT_THAT(refused("minutes: 3\nwavess: 1\n"), HasSubstr("b.yaml:2: unknown key 'wavess'; did you mean waves?"));
  EXPECT_THAT(refused("minutes: 3\nwaves: high\n"), HasSubstr("b.yaml:2: waves takes a finite number, not 'high'"));
}

TEST(DockingParameters, GapHasNoMeasurements) {
  const SimulatedDocking docking = simulate_docking(with({{"gap", "30"}, {"blind", "0"}}));
  ASSERT_EQ(docking.gaps.size(), 10u);
  EXPECT_EQ(docking.gaps.front(), std::pair(60.0, 90.0));
  for (const TargetSensor& sensor : docking.data.sensors) {
    EXPECT_GT(sensor.measurements.size(), 100u);
    for (const Measurement& m : sensor.measurements)
      for (const auto& [from, to] : docking.gaps) EXPECT_FALSE(m.t > from - 1e-9 && m.t < to) << m.t;
  }
}

TEST(DockingParameters, OpticalPosesAreWithinTheFieldOfView) {
  const SimulatedDocking docking = simulate_docking(with({{"optical_view", "70"}, {"blind", "0"}}));
  const auto& optical = docking.data.sensors[1].measurements;
  const auto all = simulate_docking(with({{"blind", "0"}})).data.sensors[1].measurements.size();
  EXPECT_GT(optical.size(), 50u);
  EXPECT_LT(optical.size(), all);
  for (const Measurement& m : optical) {
    const auto k = std::size_t(std::lround(m.t / 0.1));
    const Vector<3> p = docking.truth_chaser[k].value.inverse().act(docking.truth_target[k].value.translation());
    EXPECT_LE(std::acos(p.x() / p.norm()), 35.0001 * M_PI / 180);
  }
}

TEST(DockingParameters, OutliersHaveTheRequestedFraction) {
  const SimulatedDocking docking = simulate_docking(with({{"minutes", "200"}, {"usbl_outliers", "0.2"}}));
  double far = 0, n = 0;
  for (const Measurement& m : docking.data.sensors[0].measurements) {
    const auto k = std::size_t(std::lround(m.t / 0.1));
    const Vector<3> p = docking.truth_chaser[k].value.inverse().act(docking.truth_target[k].value.translation());
    far += (m.position - p).norm() > 6 * 1.72;  // 98.7 % of a 3D N(0, 30²) exceed this
    ++n;
  }
  EXPECT_NEAR(far / n, 0.2 * 0.987, 4 * std::sqrt(0.2 * 0.8 / n));
}

TEST(DockingParameters, DelayedFixesAndBearingsRoundTripThroughFiles) {
  for (const char* kind : {"position", "range-bearing"}) {
    SCOPED_TRACE(kind);
    const ScratchFolder folder;
    const DockingOptions options = with({{"minutes", "4"}, {"usbl", kind}, {"usbl_latency", "1.5"}});
    const SimulatedDocking docking = simulate_docking(options);
    write_docking(docking, options, folder.path());
    const Scenario scenario = read_scenario(folder.path());
    EXPECT_THAT(scenario.source, HasSubstr("usbl_latency=1.5"));
    EXPECT_TRUE(scenario.without_extrinsics.empty());
    const TargetSensor &read = scenario.data.sensors[0], &made = docking.data.sensors[0];
    EXPECT_EQ(read.type, made.type);
    EXPECT_EQ(read.delay, 1.5);
    EXPECT_EQ(read.sigma, made.sigma);
    ASSERT_EQ(read.measurements.size(), made.measurements.size());
    const Estimate estimated = estimate(scenario, {}, GaussNewtonOptions{});
    EXPECT_TRUE(estimated.summary.converged());
    EXPECT_LT(summarise(estimated.errors).position->mean, 5.0);
  }
}

/// Every target moves smoothly. All but the hovering one move along their bow, except for waves and weaving.
TEST(DockingParameters, TargetMotionsAreSmoothAndForward) {
  for (const char* motion : {"circuit", "straight", "circle", "helix", "hover"}) {
    SCOPED_TRACE(motion);
    const SimulatedDocking docking = simulate_docking(
        with({{"minutes", "5"}, {"target_motion", motion}, {"weave", "3"}, {"speed", "1.2"}, {"waves", "0.01"}}));
    double sway = 0, surge = 0, n = 0;
    for (std::size_t k = 1; k < docking.truth_target.size(); ++k, ++n) {
      const Vector<6> twist = (docking.truth_target[k - 1].value.inverse() * docking.truth_target[k].value).Log() / 0.1;
      ASSERT_LT(twist.head<3>().norm(), 2.0);
      ASSERT_LT(twist.tail<3>().norm(), 0.2);
      sway += std::abs(twist[1]);
      surge += twist[0];
    }
    if (std::string(motion) == "hover") continue;
    EXPECT_LT(sway / n, 0.05);
    EXPECT_NEAR(surge / n, 1.2, 0.08);
  }
}

/// Planar poses have exactly zero height, roll and pitch. Sensor errors have the stated sigmas. Folders read back.
TEST(DockingParameters, PlanarDockingStaysInThePlane) {
  for (const char* kind : {"position", "range-bearing"}) {
    SCOPED_TRACE(kind);
    const DockingOptions options = with({{"minutes", "20"}, {"planar", "1"}, {"usbl", kind}, {"waves", "0.1"}});
    const SimulatedDocking docking = simulate_docking(options);
    ASSERT_TRUE(docking.data.planar);
    for (const auto* track : {&docking.truth_chaser, &docking.truth_target, &docking.data.odometry})
      for (const auto& [t, pose] : *track) {
        EXPECT_EQ(pose.translation().z(), 0);
        EXPECT_EQ(pose.rotation().quaternion().vec().head<2>().norm(), 0);
      }
    double sum = 0, count = 0;
    for (const TargetSensor& sensor : docking.data.sensors)
      for (const Measurement& m : sensor.measurements) {
        const auto k = std::size_t(std::lround(m.t / 0.1));
        const SE3 seen = docking.truth_chaser[k].value.inverse() * docking.truth_target[k].value;
        const Vector<3> p = seen.translation();
        Vector<3> e = m.position - p;
        if (sensor.type == SensorType::pose) e.z() = (seen.rotation().inverse() * m.rotation).Log().z();
        if (sensor.type == SensorType::range_bearing)
          e = {m.range - p.norm(), std::remainder(m.azimuth - std::atan2(p.y(), p.x()), 2 * M_PI), m.elevation};
        EXPECT_EQ(sensor.sigma.size(), sensor.type == SensorType::pose ? 3 : 2);
        sum += e.head(sensor.sigma.size()).cwiseQuotient(sensor.sigma).squaredNorm();
        count += double(sensor.sigma.size());
      }
    EXPECT_NEAR(sum / count, 1.0, 5 * std::sqrt(2 / count));

    const ScratchFolder folder;
    write_docking(docking, options, folder.path());
    const Scenario scenario = read_scenario(folder.path());
    ASSERT_TRUE(scenario.data.planar);
    EXPECT_EQ(scenario.data.sensors[0].sigma, docking.data.sensors[0].sigma);
    const Estimate estimated = estimate(scenario, {}, GaussNewtonOptions{});
    EXPECT_TRUE(estimated.summary.converged());
    EXPECT_LT(summarise(estimated.errors, KeyframeType::pose).position->mean, 0.2);
  }
  EXPECT_THAT(error_of([] {
                simulate_docking(with({{"planar", "1"}, {"target_motion", "helix"}}));
              }),
              HasSubstr("a helix is not planar"));
}

TEST(DockingParameters, OdometryScaleLengthensOdometry) {
  const auto length = [](const SimulatedDocking& docking) {
    double sum = 0;
    const auto& odometry = docking.data.odometry;
    for (std::size_t k = 1; k < odometry.size(); ++k)
      sum += (odometry[k].value.translation() - odometry[k - 1].value.translation()).norm();
    return sum;
  };
  EXPECT_NEAR(length(simulate_docking(with({{"odometry_scale", "0.05"}}))) / length(simulate_docking()), 1.05, 2e-3);
}

}  // namespace
}  // namespace tandem
