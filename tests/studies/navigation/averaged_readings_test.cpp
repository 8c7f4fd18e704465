#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/navigation/averaged_readings.hpp>
#include <tandem/studies/navigation/navigate.hpp>

namespace tandem {
namespace {

using ::testing::HasSubstr;

constexpr double kSeconds = 120, kYawAmplitude = 0.8, kPeriod = 60, kSpeed = 1.5;

double yaw_at(double t) { return 3.0 + kYawAmplitude * std::sin(2 * M_PI * t / kPeriod); }  // crosses ±π

EgoSensor compass(double rate, double sigma, double delay = 0) {
  EgoSensor sensor{.name = "compass", .type = EgoSensorType::heading, .sigma = Vector<3>(0.1, 0.1, sigma)};
  sensor.delay = delay;
  std::mt19937 engine(3);
  std::normal_distribution<double> noise(0, sigma);
  for (int i = 0; i <= int(kSeconds * rate); ++i) {
    const double t = i / rate;
    EgoMeasurement m{t + delay};
    m.rotation = SO3::Exp({0, 0, yaw_at(t) + noise(engine)});
    sensor.measurements.push_back(m);
  }
  return sensor;
}

EgoSensor gps() {
  EgoSensor sensor{.name = "gps", .type = EgoSensorType::gps, .sigma = Vector<3>(0.5, 0.5, 0.5)};
  std::mt19937 engine(4);
  std::normal_distribution<double> noise(0, 0.5);
  Vector<3> p = Vector<3>::Zero();
  for (int t = 0; t <= int(kSeconds); ++t) {
    sensor.measurements.push_back({double(t), p + Vector<3>{noise(engine), noise(engine), noise(engine)}});
    for (int i = 0; i < 10; ++i)
      p += 0.1 * kSpeed * Vector<3>(std::cos(yaw_at(t + 0.1 * i)), std::sin(yaw_at(t + 0.1 * i)), 0);
  }
  return sensor;
}

double yaw_error(const EgoMeasurement& m, double t) { return (SO3::Exp({0, 0, -yaw_at(t)}) * m.rotation).Log().z(); }

TEST(AveragedReadings, StandAtTheKeyframesWithTheNoiseOfTheirMean) {
  const double sigma = 0.03, delay = 0.3;
  NavigationData data{.sensors = {compass(10, sigma, delay), gps()}};
  const std::vector<NavigationFinding> findings = average_readings(data);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_THAT(
      findings[0].text(),
      HasSubstr("compass: dropped 1201 lines between 0.3 and 120.3 s in favour of 119 averages, one per keyframe"));
  const EgoSensor& averaged = data.sensors[0];
  ASSERT_EQ(averaged.measurements.size(), 119u);
  EXPECT_EQ(data.sensors[1].measurements.size(), 121u);
  EXPECT_NEAR(averaged.sigma[2], sigma / std::sqrt(10), 0.1 * sigma);
  double nees = 0;
  for (const EgoMeasurement& m : averaged.measurements) {
    const double t = averaged.valid_at(m);
    EXPECT_NEAR(t, std::round(t), 1e-6);
    nees += std::pow(yaw_error(m, t) / averaged.sigma[2], 2) / 119;
  }
  EXPECT_NEAR(nees, 1, 0.4);
  EXPECT_TRUE(average_readings(data).empty());
}

TEST(AveragedReadings, KeepSlowSensorsAndDataWithAnImu) {
  NavigationData slow{.sensors = {compass(1, 0.03), gps()}};
  EXPECT_TRUE(average_readings(slow).empty());
  EXPECT_EQ(slow.sensors[0].measurements.size(), 121u);
  NavigationData fine{.sensors = {compass(10, 0.03), gps()}, .keyframe_interval = 0.1};
  EXPECT_TRUE(average_readings(fine).empty());
  NavigationData inertial{.imu = ImuSensor(), .sensors = {compass(10, 0.03), gps()}};
  EXPECT_TRUE(average_readings(inertial).empty());
  EXPECT_EQ(inertial.sensors[0].measurements.size(), 1201u);
}

TEST(AveragedReadings, LeaveOutWrongReadings) {
  NavigationData data{.sensors = {compass(10, 0.03), gps()}};
  for (const std::size_t i : {200u, 333u, 700u, 703u})
    data.sensors[0].measurements[i].rotation = SO3::Exp({0, 0, yaw_at(0.1 * double(i)) + 2.5});
  const std::vector<NavigationFinding> findings = average_readings(data);
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_THAT(findings[1].text(), HasSubstr("compass: rejected 4 measurements between 20 and 70.3 s"));
  for (const EgoMeasurement& m : data.sensors[0].measurements) EXPECT_LT(std::abs(yaw_error(m, m.t)), 0.06) << m.t;
}

TEST(AveragedReadings, BridgeGapsWithoutExtrapolation) {
  NavigationData data{.sensors = {compass(10, 1e-4), gps()}};
  std::erase_if(data.sensors[0].measurements, [](const EgoMeasurement& m) { return m.t > 30.7 && m.t < 45.2; });
  average_readings(data);
  for (const EgoMeasurement& m : data.sensors[0].measurements) {
    EXPECT_TRUE(m.t < 30.8 || m.t > 45.1) << m.t;
    EXPECT_LT(std::abs(yaw_error(m, m.t)), 2e-3) << m.t;
  }
}

/// The keyframe interval decides the number of keyframes. More of them do not make the heading better.
TEST(AveragedReadings, NavigateAsAccuratelyAsAllReadings) {
  const auto rms = [](double rate, double interval) {
    const Navigation found =
        navigate({.sensors = {compass(rate, 0.05), gps()}, .keyframe_interval = interval}, NavigationOptions());
    EXPECT_TRUE(found.summary.converged());
    EXPECT_EQ(found.states.size(), std::size_t(std::lround(kSeconds / std::max(interval, 1 / rate))) + 1);
    double sum = 0, nees = 0;
    int n = 0;
    for (std::size_t k = 0; k < found.states.size(); ++k) {
      const double t = found.states[k].t;
      if (std::abs(t - std::round(t)) > 1e-6) continue;
      const double off = (SO3::Exp({0, 0, -yaw_at(t)}) * found.states[k].value.pose.rotation()).Log().z();
      sum += off * off;
      nees += off * off / found.covariance[k].pose(5, 5);
      ++n;
    }
    EXPECT_LT(nees / n, 2);
    return std::sqrt(sum / n);
  };
  const double slow = rms(1, 1), all = rms(10, 0.1), averaged = rms(10, 1);
  EXPECT_LT(averaged, 0.7 * slow);
  EXPECT_LT(averaged, 1.1 * all);
}

}  // namespace
}  // namespace tandem
