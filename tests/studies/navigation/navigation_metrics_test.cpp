#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/navigation_results/navigation_metrics.hpp>

namespace tandem {
namespace {

using testing::HasSubstr;

/// A body that moves along x at 2 m/s, with one keyframe per second, and an estimate with known errors.
class NavigationMetrics : public testing::Test {
 protected:
  NavigationMetrics() {
    gps_.name = "gps";
    gps_.type = EgoSensorType::gps;
    gps_.sigma = Vector<3>(1, 1, 1);
  }

  SE3 true_pose(double t) const { return SE3(SO3::Exp({0, 0, 0.3}), Vector<3>(2 * t, 1, -5)); }

  /// Sets truth and estimate. `offset(t)` [m] and `turn(t)` [rad, about the body's axes] are the errors of the
  /// estimate.
  template <class Offset, class Turn>
  void make(int keyframes, Offset offset, Turn turn) {
    for (int k = 0; k < keyframes; ++k) {
      const double t = k;
      scenario_.truth_chaser.push_back({t, true_pose(t)});
      EgoState state;
      state.pose = SE3(true_pose(t).rotation() * SO3::Exp(turn(t)), true_pose(t).translation() + offset(t));
      state.velocity = Vector<3>(2, 0, 0);
      navigation_.states.push_back({t, state});
    }
  }
  void make(int keyframes) {
    make(
        keyframes, [](double) { return Vector<3>(0, 0, 0); }, [](double) { return Vector<3>(0, 0, 0); });
  }
  /// Sets the same covariance at every keyframe.
  void add_covariance(const Vector<6>& sigma) {
    EgoCovariance covariance;
    covariance.pose = sigma.cwiseAbs2().asDiagonal();
    covariance.velocity = Matrix<3, 3>::Identity() * 0.04;
    navigation_.covariance.assign(navigation_.states.size(), covariance);
  }
  /// Adds GPS fixes at these times.
  void add_gps(const std::vector<double>& times, const Vector<3>& lever = Vector<3>::Zero()) {
    gps_.mount = SE3(SO3(), lever);
    for (const double t : times) gps_.measurements.push_back({t, true_pose(t).act(lever)});
    navigation_.data.sensors.push_back(gps_);
    const std::size_t index = navigation_.data.sensors.size() - 1;
    for (const double t : times) navigation_.placed.push_back({index, t, {}});
  }
  NavigationComparison compare() {
    if (!scenario_.navigation) scenario_.navigation = navigation_.data;
    return compare_with_truth(navigation_, scenario_);
  }

  EgoSensor gps_;
  Scenario scenario_;
  Navigation navigation_;
};

TEST_F(NavigationMetrics, ErrorsAreEstimateMinusTruth) {
  make(
      5, [](double t) { return Vector<3>(0.3, 0.4 * t, -1.2); }, [](double) { return Vector<3>(0.01, 0, -0.02); });
  add_gps({0, 1, 2, 3, 4});
  navigation_.states[2].value.velocity = Vector<3>(2.1, 0, 0.2);
  const NavigationComparison c = compare();
  ASSERT_EQ(c.errors.size(), 5u);
  EXPECT_TRUE(c.errors[1].position->isApprox(Vector<3>(0.3, 0.4, -1.2)));
  EXPECT_TRUE(c.errors[1].orientation->isApprox(Vector<3>(0.01, 0, -0.02), 1e-9));
  EXPECT_NEAR((*c.errors[2].velocity - Vector<3>(0.1, 0, 0.2)).norm(), 0, 1e-12);
  EXPECT_FALSE(c.errors[0].velocity || c.errors[4].velocity) << "a central difference needs keyframes on both sides";
  EXPECT_FALSE(c.errors[1].position_sigma || c.errors[1].pose_nees) << "no covariance";
  EXPECT_NEAR(*c.distance, 8, 1e-12);
  EXPECT_EQ(c.alignment, "");

  const NavigationErrorSummary all = summarise(c.errors);
  EXPECT_EQ(all.n, 5);
  EXPECT_EQ(all.compared, 5);
  EXPECT_NEAR(all.position->max, std::hypot(0.3, 1.6, 1.2), 1e-12);
  EXPECT_NEAR(all.horizontal->max, std::hypot(0.3, 1.6), 1e-12);
  EXPECT_NEAR(all.orientation->mean, std::hypot(0.01, 0.02), 1e-9);
  EXPECT_NEAR(all.orientation_rms->z(), 0.02, 1e-9);
  const NavigationErrorSummary late = summarise(c.errors, 3);
  EXPECT_EQ(late.n, 2);
  EXPECT_NEAR(late.position->mean, (std::hypot(0.3, 1.2, 1.2) + std::hypot(0.3, 1.6, 1.2)) / 2, 1e-12);
  EXPECT_NEAR(late.position->rms, std::sqrt((0.09 + 1.44 + 1.44 + 0.09 + 2.56 + 1.44) / 2), 1e-12);
}

TEST_F(NavigationMetrics, ComputesSigmasAndNees) {
  // The body is rotated by 90°: the standard deviation along its x axis refers to the world's y axis.
  make(3);
  for (auto* track : {&scenario_.truth_chaser})
    for (auto& [t, pose] : *track) pose = SE3(SO3::Exp({0, 0, M_PI / 2}), pose.translation());
  for (std::size_t k = 0; k < 3; ++k) {
    const SE3& truth = scenario_.truth_chaser[k].value;
    navigation_.states[k].value.pose =
        SE3(truth.rotation() * SO3::Exp({0, 0, 0.04}), truth.translation() + Vector<3>(0, 0.3, 0));
  }
  Vector<6> sigma;
  sigma << 0.1, 1, 1, 0.5, 0.5, 0.01;
  add_covariance(sigma);
  add_gps({0, 1, 2});
  const NavigationComparison c = compare();
  const NavigationError& e = c.errors[1];
  EXPECT_TRUE(e.position_sigma->isApprox(Vector<3>(1, 0.1, 1), 1e-2)) << e.position_sigma->transpose();
  EXPECT_TRUE(e.orientation_sigma->isApprox(Vector<3>(0.5, 0.5, 0.01)));
  EXPECT_TRUE(e.velocity_sigma->isApprox(Vector<3>(0.2, 0.2, 0.2)));
  EXPECT_NEAR(*e.position_nees, 9, 0.3) << "3σ along y; the rotation of 0.04 rad adds a little";
  EXPECT_NEAR(*e.pose_nees, 9 + 16, 0.5);
  const NavigationErrorSummary all = summarise(c.errors);
  EXPECT_EQ(all.orientation_within->x(), 1);
  EXPECT_EQ(all.orientation_within->z(), 0) << "4σ";
  EXPECT_EQ(all.position_within->x(), 1);
  EXPECT_NEAR(*all.position_nees, *e.position_nees, 1e-9);
}

TEST_F(NavigationMetrics, PropagatesSigmaToAntenna) {
  make(3);
  scenario_.truth_orientation = false;
  add_gps({0, 1, 2}, {0, 0, 2});
  Vector<6> sigma;
  sigma << 0.01, 0.01, 0.01, 0.1, 0.1, 0.1;
  add_covariance(sigma);
  const NavigationComparison c = compare();
  EXPECT_NEAR(c.errors[1].position_sigma->x(), std::hypot(0.01, 0.2), 1e-9) << "roll and pitch move the antenna";
  EXPECT_NEAR(c.errors[1].position_sigma->z(), 0.01, 1e-9);
}

TEST_F(NavigationMetrics, ComparesPositionOnlyTruthAtAntenna) {
  make(4);
  scenario_.truth_orientation = false;
  const Vector<3> lever(-0.2, 0.1, 0.4);
  add_gps({0, 1, 2, 3}, lever);
  for (auto& [t, pose] : scenario_.truth_chaser) pose = SE3(SO3(), true_pose(t).act(lever));
  const NavigationComparison c = compare();
  EXPECT_EQ(c.antenna, "gps");
  EXPECT_EQ(c.point, lever);
  for (const NavigationError& e : c.errors) {
    EXPECT_NEAR(e.position->norm(), 0, 1e-12);
    EXPECT_FALSE(e.orientation || e.velocity || e.pose_nees);
  }

  // A navigation that does not use the sensor is still compared at its antenna.
  scenario_.navigation = navigation_.data;
  navigation_.data.sensors.clear();
  navigation_.placed.clear();
  EXPECT_EQ(compare().antenna, "gps");
}

TEST_F(NavigationMetrics, FindsGpsOutages) {
  make(
      61, [](double t) { return Vector<3>(0, t < 40 ? 0.01 * t : 0, 0); }, [](double) { return Vector<3>(0, 0, 0); });
  add_gps({0, 5, 10, 39.5, 45, 48});
  const NavigationComparison c = compare();
  ASSERT_EQ(c.outages.size(), 2u);
  EXPECT_EQ(c.outages[0].from, 10);
  EXPECT_EQ(c.outages[0].to, 39.5);
  EXPECT_NEAR(*c.outages[0].distance, 2 * 29, 1e-9) << "from keyframe to keyframe";
  EXPECT_NEAR(*c.outages[0].drift, 0.39, 1e-9);
  EXPECT_EQ(c.outages[1].from, 48);
  EXPECT_EQ(c.outages[1].to, 60) << "the end of the recording";
  EXPECT_NEAR(*c.outages[1].drift, 0, 1e-9);
}

TEST_F(NavigationMetrics, AlignsWorldWithoutAbsoluteSensors) {
  make(20);
  const SE3 world(SO3::Exp({0, 0, 1.1}), Vector<3>(30, -20, 4));
  for (auto& [t, state] : navigation_.states) state.pose = world * state.pose;
  for (auto& [t, state] : navigation_.states) state.velocity = world.rotation().act(state.velocity);
  const NavigationComparison c = compare();
  EXPECT_THAT(c.alignment, HasSubstr("the first position and heading were aligned"));
  EXPECT_TRUE(c.outages.empty()) << "no GPS";
  for (const NavigationError& e : c.errors) {
    EXPECT_NEAR(e.position->norm(), 0, 1e-9);
    EXPECT_NEAR(e.orientation->norm(), 0, 1e-9);
  }
  EXPECT_NEAR(c.errors[3].velocity->norm(), 0, 1e-9);

  // Without true orientation, the direction of the track is aligned.
  scenario_.truth_orientation = false;
  const NavigationComparison by_track = compare();
  EXPECT_THAT(by_track.alignment, HasSubstr("the direction of the track were aligned"));
  for (const NavigationError& e : by_track.errors) EXPECT_NEAR(e.position->norm(), 0, 1e-9);
}

TEST_F(NavigationMetrics, KeepsMeasuredHeadingAndDepth) {
  make(
      20, [](double) { return Vector<3>(7, 8, 0.5); }, [](double) { return Vector<3>(0, 0, 0.2); });
  EgoSensor heading, depth;
  heading.name = "heading";
  heading.type = EgoSensorType::heading;
  heading.measurements.push_back({0});
  depth.name = "depth";
  depth.type = EgoSensorType::depth;
  depth.measurements.push_back({0});
  navigation_.data.sensors = {heading, depth};
  const NavigationComparison c = compare();
  EXPECT_THAT(c.alignment, HasSubstr("; the first position was aligned with the truth."));
  EXPECT_NEAR(horizontal(*c.errors[5].position), 0, 1e-9);
  EXPECT_NEAR(c.errors[5].position->z(), 0.5, 1e-9) << "measured by depth";
  EXPECT_NEAR(c.errors[5].orientation->z(), 0.2, 1e-9) << "measured by heading";
}

TEST_F(NavigationMetrics, KeepsHeadingFromEarthRotation) {
  make(
      20, [](double) { return Vector<3>(0, 0, 0); }, [](double) { return Vector<3>(0, 0, 0.05); });
  navigation_.data.earth = Earth::at_latitude(1.0, 9.82);
  Vector<6> sigma = Vector<6>::Constant(0.02);
  add_covariance(sigma);
  EXPECT_NEAR(compare().errors[5].orientation->z(), 0.05, 1e-9);
  sigma[5] = 0.5;  // a gyroscope that does not observe the Earth's rotation
  add_covariance(sigma);
  EXPECT_NEAR(compare().errors[5].orientation->z(), 0, 1e-9);
}

/// A body that oscillates about its x axis with a period of 0.8 s. Truth and keyframes alternate every 0.5 s.
TEST_F(NavigationMetrics, ComparesSparseTruthAtItsOwnTimes) {
  const auto pose = [](double t) { return SE3(SO3::Exp({0.3 * std::sin(8 * t), 0, 0}), Vector<3>(0, 0, 0)); };
  for (int k = 0; k < 6; ++k) {
    EgoState state;
    state.pose = pose(k);
    navigation_.states.push_back({double(k), state});
    scenario_.truth_chaser.push_back({k + 0.5, pose(k + 0.5)});
  }
  ImuSensor& imu = navigation_.data.imu.emplace();
  for (int i = 0; i <= 560; ++i) {
    const double t = 0.01 * i;
    imu.samples.push_back({t, pose(t).rotation().inverse().act({0, 0, 9.80665}), {2.4 * std::cos(8 * t), 0, 0}});
  }
  const NavigationComparison c = compare();
  ASSERT_EQ(c.errors.size(), 6u);
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_EQ(c.errors[k].t, double(k) + 0.5);
    EXPECT_NEAR(c.errors[k].orientation->norm(), 0, 1e-3)
        << "interpolated truth would have errors of tenths of a radian";
    EXPECT_NEAR(c.errors[k].position->norm(), 0, 1e-2);
  }

  imu.samples.clear();  // without samples, the truth is interpolated
  const NavigationComparison interpolated = compare();
  EXPECT_EQ(interpolated.errors[2].t, 2);
  EXPECT_GT(interpolated.errors[2].orientation->norm(), 0.05);
}

TEST_F(NavigationMetrics, GivesOnlySigmasWithoutTruth) {
  make(3);
  add_covariance(Vector<6>::Constant(0.1));
  add_gps({0, 1, 2});
  scenario_.truth_chaser.clear();
  const NavigationComparison c = compare();
  EXPECT_FALSE(c.errors[1].position || c.errors[1].orientation || c.errors[1].velocity || c.distance);
  EXPECT_TRUE(c.errors[1].position_sigma && c.errors[1].orientation_sigma);
  const NavigationErrorSummary all = summarise(c.errors);
  EXPECT_EQ(all.n, 3);
  EXPECT_EQ(all.compared, 0);
  EXPECT_FALSE(all.position || all.position_within || all.pose_nees);
}

}  // namespace
}  // namespace tandem
