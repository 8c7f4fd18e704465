#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/navigation_checks.hpp>

namespace tandem {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using Kind = NavigationFinding::Kind;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Returns a deterministic disturbance that differs from line to line.
double wobble(int i) { return std::sin(1.7 * i) + 0.3 * std::sin(0.37 * i); }

/// Returns 60 s of data without defects: a level vehicle with all sensors, whose yaw oscillates.
NavigationData healthy() {
  NavigationData data;
  ImuSensor& imu = data.imu.emplace();
  const auto yaw_rate = [](double t) { return 0.2 * std::cos(0.3 * t); };
  for (int i = 0; i <= 6000; ++i) {
    const double t = 0.01 * i;
    imu.samples.push_back({t,
                           {0.1 * wobble(i), 0.1 * wobble(i + 500), 9.8 + 0.1 * wobble(i + 900)},
                           {0.01 * wobble(i + 40), 0.01 * wobble(i + 70), yaw_rate(t) + 0.01 * wobble(i)}});
  }
  const auto add = [&](EgoSensorType type, int rows, double interval, auto measure) {
    EgoSensor& sensor = data.sensors.emplace_back();
    sensor.name = name(type);
    sensor.type = type;
    sensor.sigma = Eigen::VectorXd::Constant(rows, 0.05);
    for (int i = 0; i * interval <= 60; ++i) sensor.measurements.push_back(measure(i, i * interval));
  };
  add(EgoSensorType::dvl, 3, 0.2, [](int i, double t) {
    return EgoMeasurement{t, Vector<3>(1.5, 0, 0) + 0.01 * Vector<3>(wobble(i), wobble(i + 9), wobble(i + 5))};
  });
  add(EgoSensorType::depth, 1, 0.1, [](int i, double t) {
    return EgoMeasurement{t, Vector<3>(0, 0, -5 + 0.1 * wobble(i))};
  });
  add(EgoSensorType::gps, 3, 1.0, [](int i, double t) { return EgoMeasurement{t, Vector<3>(1.5 * t, wobble(i), 0)}; });
  add(EgoSensorType::heading, 3, 0.5, [](int i, double t) {
    const double yaw = 0.2 / 0.3 * std::sin(0.3 * t);
    return EgoMeasurement{t, Vector<3>::Zero(), SO3::Exp({0.01 * wobble(i), 0.01 * wobble(i + 3), yaw})};
  });
  return data;
}

EgoSensor& sensor(NavigationData& data, EgoSensorType type) {
  return *std::find_if(data.sensors.begin(), data.sensors.end(), [&](const EgoSensor& s) { return s.type == type; });
}

std::string error_of_check(NavigationData data) {
  try {
    check(data);
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "no Error was thrown";
  return "";
}

/// Expects exactly one finding and returns it.
NavigationFinding finding(NavigationData& data) {
  const auto all = check(data);
  EXPECT_EQ(all.size(), 1u);
  for (const NavigationFinding& other : all) {
    EXPECT_EQ(other.text().find('\n'), std::string::npos);
    if (all.size() > 1) ADD_FAILURE() << other.text();
  }
  return all.empty() ? NavigationFinding{Kind::empty, "none"} : all.front();
}

template <class T>
bool increase(const std::vector<T>& lines) {
  for (std::size_t i = 1; i < lines.size(); ++i)
    if (!(lines[i].t > lines[i - 1].t)) return false;
  return true;
}

TEST(NavigationChecks, HealthyDataHaveNoFindings) {
  NavigationData data = healthy();
  for (const NavigationFinding& other : check(data)) ADD_FAILURE() << other.text();
  EXPECT_EQ(data.imu->samples.size(), 6001u);
  EXPECT_EQ(sensor(data, EgoSensorType::depth).measurements.size(), 600u + 1u);
}

TEST(NavigationChecks, DropsLineThatJumpsBack) {
  NavigationData data = healthy();
  data.imu->samples[100].t = 0.5;
  const NavigationFinding f = finding(data);
  EXPECT_EQ(f.text(), "imu: dropped 1 line at 0.5 s whose time runs backwards");
  EXPECT_EQ(data.imu->samples.size(), 6000u);
  EXPECT_TRUE(increase(data.imu->samples));
}

TEST(NavigationChecks, DropsOnlyTheLineThatJumpsAhead) {
  NavigationData data = healthy();
  auto& depth = sensor(data, EgoSensorType::depth).measurements;
  depth[100].t = 1e9;
  const NavigationFinding f = finding(data);
  EXPECT_EQ(f.kind, Kind::backwards);
  EXPECT_EQ(f.sensor, "depth");
  EXPECT_EQ(f.count, 1u);
  EXPECT_EQ(depth.size(), 600u);
  EXPECT_TRUE(increase(depth));
}

TEST(NavigationChecks, DropsRepeatedLines) {
  NavigationData data = healthy();
  auto& samples = data.imu->samples;
  const std::vector<ImuSample> stretch(samples.begin() + 1000, samples.begin() + 1200);
  samples.insert(samples.begin() + 1200, stretch.begin(), stretch.end());
  const NavigationFinding f = finding(data);
  EXPECT_EQ(f.kind, Kind::backwards);
  EXPECT_EQ(f.count, 200u);
  EXPECT_THAT(f.text(), ::testing::StartsWith("imu: dropped 200 lines between "));
  EXPECT_EQ(samples.size(), 6001u);
}

TEST(NavigationChecks, KeepsFirstOfRepeatedTimes) {
  NavigationData data = healthy();
  auto& gps = sensor(data, EgoSensorType::gps).measurements;
  const Vector<3> first = gps[3].value;
  gps[4].t = gps[5].t = gps[3].t;
  const NavigationFinding f = finding(data);
  EXPECT_EQ(f.text(), "gps: dropped 2 lines at 3 s with a repeated time");
  EXPECT_EQ(gps[3].value, first);
  EXPECT_EQ(gps[4].t, 6.0);
}

TEST(NavigationChecks, DropsLinesThatAreNotFinite) {
  NavigationData data = healthy();
  data.imu->samples[7].angular_rate.y() = kNan;
  data.imu->samples[9].t = std::numeric_limits<double>::infinity();
  const NavigationFinding f = finding(data);
  EXPECT_EQ(f.kind, Kind::not_finite);
  EXPECT_EQ(f.count, 2u);
  EXPECT_EQ(data.imu->samples.size(), 5999u);
}

TEST(NavigationChecks, FindsSaturationAtGivenLimit) {
  NavigationData data = healthy();
  data.imu->max_specific_force = 40;
  for (const int i : {200, 201, 300}) data.imu->samples[std::size_t(i)].specific_force.x() = i == 300 ? -41 : 40;
  const NavigationFinding f = finding(data);
  EXPECT_EQ(f.text(), "imu: 3 samples of specific force x between 2 and 3 s are saturated, but kept");
  EXPECT_EQ(data.imu->samples.size(), 6001u);
}

TEST(NavigationChecks, FindsSaturationAtUnknownLimit) {
  NavigationData data = healthy();
  for (std::size_t i = 200; i < 212; ++i) data.imu->samples[i].angular_rate.z() = -4.3633;
  for (std::size_t i = 400; i < 404; ++i) data.imu->samples[i].angular_rate.z() = 4.3633;  // too few to count
  const NavigationFinding f = finding(data);
  EXPECT_EQ(f.kind, Kind::saturated);
  EXPECT_EQ(f.channel, "angular rate z");
  EXPECT_EQ(f.count, 12u);
  EXPECT_EQ(f.from, 2.0);
}

TEST(NavigationChecks, FindsStuckImuAxis) {
  NavigationData data = healthy();
  for (std::size_t i = 1000; i < 1150; ++i) data.imu->samples[i].specific_force.y() = 0;
  const NavigationFinding f = finding(data);
  EXPECT_EQ(f.text(), "imu: specific force y is stuck at one value for 150 samples between 10 and 11.49 s");
  data = healthy();
  for (ImuSample& sample : data.imu->samples) sample.angular_rate.x() = 0.01;
  EXPECT_EQ(finding(data).count, 6001u) << "stuck for the whole recording";
}

TEST(NavigationChecks, QuantisedOrRestingImuIsNotStuck) {
  NavigationData data = healthy();
  for (std::size_t i = 0; i < data.imu->samples.size(); ++i) {
    auto& rate = data.imu->samples[i].angular_rate;
    rate.x() = 0.001 * std::round(3 * std::sin(0.013 * double(i)));  // equal for up to a second
  }
  EXPECT_TRUE(check(data).empty());
  data = healthy();
  for (std::size_t i = 1000; i < 3000; ++i) data.imu->samples[i] = {data.imu->samples[i].t, {0, 0, 9.81}, {0, 0, 0}};
  sensor(data, EgoSensorType::heading).measurements.resize(20);
  for (const NavigationFinding& other : check(data)) EXPECT_NE(other.kind, Kind::stuck) << "all axes are at rest";
}

TEST(NavigationChecks, DropsRepeatedValuesOfStuckSensor) {
  NavigationData data = healthy();
  auto& dvl = sensor(data, EgoSensorType::dvl).measurements;
  for (std::size_t i = 51; i < 62; ++i) dvl[i].value = dvl[50].value;
  const NavigationFinding f = finding(data);
  EXPECT_EQ(f.text(), "dvl: dropped 11 lines between 10.2 and 12.2 s with a repeated value; the sensor may be stuck");
  EXPECT_EQ(dvl.size(), 290u);
  data = healthy();
  auto& absent = sensor(data, EgoSensorType::dvl).measurements;
  for (std::size_t i = 51; i < 62; ++i) absent[i].value.setZero();
  EXPECT_THAT(finding(data).text(), HasSubstr("dvl: dropped 11 lines between 10.2 and 12.2 s with exact zeros"));
  data = healthy();
  auto& still = sensor(data, EgoSensorType::dvl).measurements;
  for (std::size_t i = 0; i < still.size(); ++i)
    still[i].value *= std::clamp(0.01 * std::abs(double(i) - 150) - 0.2, 0.0, 1.0);
  EXPECT_TRUE(check(data).empty()) << "at rest for a while";
  data = healthy();
  auto& heading = sensor(data, EgoSensorType::heading).measurements;
  for (std::size_t i = 20; i < 32; ++i) heading[i].rotation = heading[20].rotation;
  EXPECT_EQ(finding(data).sensor, "heading");
}

TEST(NavigationChecks, DepthMayRepeatForSeconds) {
  NavigationData data = healthy();
  auto& depth = sensor(data, EgoSensorType::depth).measurements;
  for (std::size_t i = 100; i < 140; ++i) depth[i].value.z() = -5;
  EXPECT_TRUE(check(data).empty());
  for (std::size_t i = 100; i < 170; ++i) depth[i].value.z() = -5;
  EXPECT_EQ(finding(data).count, 69u);
}

TEST(NavigationChecks, ReportsGapsWithoutDroppingSamples) {
  NavigationData data = healthy();
  auto& samples = data.imu->samples;
  samples.erase(samples.begin() + 1001, samples.begin() + 1100);
  EXPECT_EQ(finding(data).text(),
            "imu: no samples between 10 and 11 s, which is longer than max_gap; the chain of keyframes is split there");
  EXPECT_EQ(samples.size(), 5902u);
  data.imu->max_gap = 1.5;
  EXPECT_TRUE(check(data).empty());
  data = healthy();
  for (int gap = 0; gap < 10; ++gap) {
    auto& s = data.imu->samples;
    const auto at = std::find_if(s.begin(), s.end(), [&](const ImuSample& x) { return x.t > 5 * gap + 3; });
    s.erase(at, at + 80);
  }
  EXPECT_THAT(finding(data).text(), ::testing::StartsWith("imu: 10 gaps longer than max_gap between 3 and 48.81 s"));
}

TEST(NavigationChecks, ReportsSensorsWithPartialCoverage) {
  NavigationData data = healthy();
  auto& gps = sensor(data, EgoSensorType::gps).measurements;
  gps.erase(gps.begin() + 30, gps.end());
  EXPECT_EQ(finding(data).text(), "gps: ends at 29 s, but the recording ends at 60 s");
  gps.erase(gps.begin(), gps.begin() + 25);
  EXPECT_EQ(check(data).front().text(), "gps: starts at 25 s, but the recording starts at 0 s");
  gps.clear();
  EXPECT_EQ(finding(data).text(), "gps: no measurements");
  data = healthy();
  auto& dvl = sensor(data, EgoSensorType::dvl).measurements;
  dvl.erase(dvl.begin() + 101, dvl.begin() + 200);
  EXPECT_EQ(finding(data).text(), "dvl: no measurements between 20 and 40 s");
  data = healthy();
  data.imu->samples.resize(3000);
  EXPECT_EQ(finding(data).text(), "imu: ends at 29.99 s, but the recording ends at 60 s");
}

TEST(NavigationChecks, RejectsSpecificForceInOtherUnits) {
  const auto rejection = [](double factor, const Vector<3>& more = Vector<3>::Zero()) {
    NavigationData data = healthy();
    for (ImuSample& sample : data.imu->samples) sample.specific_force = factor * sample.specific_force + more;
    return error_of_check(data);
  };
  EXPECT_THAT(rejection(1 / 9.80665), HasSubstr("in g, multiply them by 9.80665"));
  EXPECT_THAT(rejection(1000 / 9.80665), HasSubstr("in mg, multiply them by 0.00980665"));
  EXPECT_THAT(rejection(1000), HasSubstr("in mm/s^2, divide them by 1000"));
  EXPECT_THAT(rejection(1, {0, 0, -9.8}), HasSubstr("samples must include gravity"));
  EXPECT_THAT(rejection(3),
              ::testing::MatchesRegex("imu: the median specific force is 29.[0-9]+ m/s\\^2, but gravity alone is 9.8; "
                                      "give samples in m/s\\^2"));
}

TEST(NavigationChecks, RejectsGravityOfWrongSign) {
  NavigationData data = healthy();
  for (ImuSample& sample : data.imu->samples) sample.specific_force *= -1;
  EXPECT_THAT(error_of_check(data), HasSubstr("the specific force points down according to heading"));
  // A compass without roll and pitch cannot detect the wrong sign.
  sensor(data, EgoSensorType::heading).sigma.head<2>().setConstant(3);
  EXPECT_THAT(finding(data).text(), HasSubstr("imu: the specific force points down between 0 and 2 s"));
  data.imu->mount = SE3(SO3::Exp({std::numbers::pi, 0, 0}), Vector<3>::Zero());
  for (ImuSample& sample : data.imu->samples)
    sample.angular_rate = Vector<3>(1, -1, -1).cwiseProduct(sample.angular_rate);
  EXPECT_TRUE(check(data).empty()) << "mounted upside down";
  // An IMU frame whose x axis points up.
  data = healthy();
  data.sensors.clear();
  for (ImuSample& sample : data.imu->samples)
    sample.specific_force = Vector<3>(sample.specific_force.z(), 0, -2 + sample.specific_force.x());
  for (const NavigationFinding& other : check(data)) EXPECT_NE(other.kind, Kind::upside_down);
}

TEST(NavigationChecks, RejectsAngularRateInDegrees) {
  NavigationData data = healthy();
  for (ImuSample& sample : data.imu->samples) sample.angular_rate *= 180 / std::numbers::pi;
  EXPECT_THAT(error_of_check(data),
              ::testing::MatchesRegex("imu: [0-9]+ % of the angular rates exceed 8 rad/s; if angular rates are in "
                                      "degrees per second, convert them to rad/s"));
  // The rates are plausible, but contradict the heading sensor.
  data = healthy();
  const double slower = 0.3;
  for (ImuSample& sample : data.imu->samples) sample.angular_rate *= slower * 180 / std::numbers::pi;
  for (EgoMeasurement& m : sensor(data, EgoSensorType::heading).measurements)
    m.rotation = SO3::Exp(slower * m.rotation.Log());
  EXPECT_THAT(error_of_check(data),
              ::testing::MatchesRegex("imu: yaw changes from the angular rate are 5[0-9.]+ times those from heading; "
                                      "if angular rates are in degrees per second, convert them to rad/s"));
}

/// Returns data without a heading sensor, of a vehicle that rolls by ±0.1 rad.
NavigationData rolling() {
  NavigationData data = healthy();
  std::erase_if(data.sensors, [](const EgoSensor& s) { return s.type == EgoSensorType::heading; });
  for (ImuSample& sample : data.imu->samples) {
    sample.specific_force += 9.8 * Vector<3>(0, std::sin(0.1 * std::sin(sample.t)), 0);
    sample.angular_rate.x() += 0.1 * std::cos(sample.t);
  }
  return data;
}

TEST(NavigationChecks, VerifiesAngularRateAgainstGravity) {
  NavigationData data = rolling();
  EXPECT_TRUE(check(data).empty());
  for (ImuSample& sample : data.imu->samples) sample.angular_rate.x() += 0.3;  // a bias has no effect
  EXPECT_TRUE(check(data).empty());
  data = rolling();
  for (ImuSample& sample : data.imu->samples) sample.angular_rate *= 0.6 * 180 / std::numbers::pi;
  for (ImuSample& sample : data.imu->samples) sample.specific_force.y() *= 0.6;
  EXPECT_THAT(error_of_check(data),
              ::testing::MatchesRegex("imu: tilt changes from the angular rate are 5[0-9.]+ times those from the "
                                      "specific force; if angular rates are in degrees per second, convert them to "
                                      "rad/s"));
  data = rolling();
  for (ImuSample& sample : data.imu->samples) sample.angular_rate *= -1;
  EXPECT_THAT(error_of_check(data), EndsWith("times those from the specific force; change the sign of one of the two"));
}

TEST(NavigationChecks, RejectsAngularRateOfWrongSign) {
  NavigationData data = healthy();
  for (ImuSample& sample : data.imu->samples) sample.angular_rate *= -1;
  EXPECT_THAT(error_of_check(data), EndsWith("check the sign of the angular rate, the frame and the orientations"));
}

TEST(NavigationChecks, RejectsImplausibleMagnitudes) {
  const auto rejection = [](EgoSensorType type, double factor) {
    NavigationData data = healthy();
    for (EgoMeasurement& m : sensor(data, type).measurements) m.value *= factor;
    return error_of_check(data);
  };
  EXPECT_THAT(rejection(EgoSensorType::dvl, 1000), HasSubstr("dvl: the speed over ground is 15"));
  EXPECT_THAT(rejection(EgoSensorType::dvl, 1000), EndsWith("convert it to m/s"));
  EXPECT_THAT(rejection(EgoSensorType::dvl, 100), EndsWith("convert it to m/s"));
  EXPECT_THAT(rejection(EgoSensorType::depth, 1e4), EndsWith("in mm or is a pressure, convert it to m"));
  EXPECT_THAT(rejection(EgoSensorType::gps, 1e6), EndsWith("from an origin near the vehicle"));
  NavigationData data = healthy();
  for (EgoMeasurement& m : sensor(data, EgoSensorType::depth).measurements) m.value *= -1;
  EXPECT_THAT(finding(data).text(), HasSubstr("depth: most heights are above the world's origin"));
}

TEST(NavigationChecks, RejectsImuWithOneSample) {
  NavigationData data = healthy();
  for (ImuSample& sample : data.imu->samples) sample.t = 1;
  EXPECT_EQ(error_of_check(data), "imu: at least two samples are required");
}

TEST(NavigationChecks, FindsVibrationFarAboveGivenNoise) {
  NavigationData data;
  ImuSensor& imu = data.imu.emplace();
  imu.name = "imu";
  imu.noise.accelerometer = 0.02;
  imu.noise.gyroscope = 0.001;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const auto noise = [&](double density) -> Vector<3> {
    return Vector<3>{normal(random), normal(random), normal(random)} * (density * 10);
  };
  const auto record = [&](double accelerometer, double gyroscope) {
    imu.samples.clear();
    for (int i = 0; i < 4000; ++i)
      imu.samples.push_back({0.01 * i, Vector<3>(0, 0, 9.8) + noise(accelerometer), noise(gyroscope)});
    return check(data);
  };
  EXPECT_THAT(record(0.02, 0.001), ::testing::IsEmpty());
  EXPECT_THAT(record(0.1, 0.005), ::testing::IsEmpty()) << "five times the given noise is below the limit";
  const auto findings = record(0.4, 0.001);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].kind, Kind::vibration);
  EXPECT_NEAR(findings[0].accelerometer, 0.4, 0.02);
  EXPECT_NEAR(findings[0].gyroscope, 0.001, 5e-5);
  EXPECT_THAT(findings[0].text(), HasSubstr("far above the given noise"));
}

}  // namespace
}  // namespace tandem
