#include <algorithm>
#include <cmath>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/navigation/navigate.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>

namespace tandem {
namespace {

using ::testing::HasSubstr;

EgoSensor& sensor_of(NavigationData& data, EgoSensorType type) {
  for (EgoSensor& sensor : data.sensors)
    if (sensor.type == type) return sensor;
  throw Error("the dive has no such sensor");
}

struct Case {
  std::string name, sensor;
  std::function<void(NavigationData&)> change;
};

/// One wrong value, or a burst of them, hardly moves a state, and the findings name the sensor.
TEST(GrossErrors, AreNamedAndDoNotMoveTheStates) {
  const SimulatedDive dive = simulate_dive({.grade = Grade::tactical, .minutes = 2});
  NavigationOptions options;
  options.covariance = false;
  const Navigation clean = navigate(dive.data, options);
  std::vector<Case> cases;
  for (const double wrong : {100.0, 1e3, 1e5}) {
    cases.push_back(
        {"accelerometer", "imu", [=](NavigationData& d) { d.imu->samples[6000].specific_force.x() = wrong; }});
    cases.push_back({"gyroscope", "imu", [=](NavigationData& d) { d.imu->samples[6000].angular_rate.z() = wrong; }});
  }
  const auto burst = [&cases](const std::string& name, EgoSensorType type, std::size_t first, std::size_t n,
                              const Vector<3>& value) {
    cases.push_back({name, "", [=](NavigationData& d) {
                       EgoSensor& sensor = sensor_of(d, type);
                       for (std::size_t i = first; i < first + n; ++i) sensor.measurements[i].value = value;
                     }});
    cases.back().sensor = std::string(tandem::name(type));
  };
  burst("DVL without bottom lock", EgoSensorType::dvl, 200, 1, Vector<3>::Constant(-32.768));
  burst("DVL 3 m/s off", EgoSensorType::dvl, 200, 1, {4, 0, 0});
  burst("DVL zeros", EgoSensorType::dvl, 200, 30, Vector<3>::Zero());
  burst("depth in air", EgoSensorType::depth, 400, 1, Vector<3>::Zero());
  burst("depth 300 m off", EgoSensorType::depth, 400, 1, {0, 0, -300});
  burst("GPS far away", EgoSensorType::gps, 5, 1, {-4e6, 7e6, 0});
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    NavigationData data = dive.data;
    c.change(data);
    const Navigation found = navigate(data, options);
    EXPECT_TRUE(found.summary.converged());
    std::string findings;
    for (const NavigationFinding& finding : found.findings) findings += finding.text() + "\n";
    EXPECT_THAT(findings, HasSubstr(c.sensor + ": "));
    double apart = 0;
    for (std::size_t k = 0; k < std::min(found.states.size(), clean.states.size()); ++k)
      apart =
          std::max(apart, (found.states[k].value.pose.translation() - clean.states[k].value.pose.translation()).norm());
    EXPECT_LT(apart, 0.3) << findings;
  }
}

/// A constant error of the accelerometer from the middle on. The other sensors agree without the IMU.
TEST(GrossErrors, AnImuThatContradictsAllOthersIsLeftOut) {
  SimulatedDive dive = simulate_dive({.grade = Grade::tactical, .minutes = 2});
  for (ImuSample& sample : dive.data.imu->samples)
    if (sample.t > 60) sample.specific_force.x() += 8;
  NavigationOptions options;
  options.covariance = false;
  const Navigation found = navigate(dive.data, options);
  EXPECT_TRUE(found.summary.converged());
  EXPECT_TRUE(std::any_of(found.findings.begin(), found.findings.end(), [](const NavigationFinding& finding) {
    return finding.sensor == "imu" && finding.kind == NavigationFinding::Kind::rejected;
  }));
  for (const Stamped<EgoState>& state : found.states)
    for (const Stamped<SE23>& truth : dive.truth)
      if (std::abs(truth.t - state.t) < 1e-6) {
        EXPECT_LT((state.value.pose.translation() - truth.value.translation()).norm(), 2) << state.t;
      }
}

/// Returns the largest distance between the states of two solutions [m].
double largest_distance(const Navigation& a, const Navigation& b) {
  double largest = 0;
  for (const Stamped<EgoState>& x : a.states)
    for (const Stamped<EgoState>& y : b.states)
      if (std::abs(x.t - y.t) < 1e-6)
        largest = std::max(largest, (x.value.pose.translation() - y.value.pose.translation()).norm());
  return largest;
}

bool rejects(const Navigation& found, const std::string& sensor) {
  return std::any_of(found.findings.begin(), found.findings.end(), [&](const NavigationFinding& finding) {
    return finding.sensor == sensor && finding.kind == NavigationFinding::Kind::rejected;
  });
}

/// A DVL that stays wrong contradicts the IMU, and without the IMU it agrees with itself. It must not win: the states
/// are those without its wrong measurements.
TEST(GrossErrors, ADvlThatStaysWrongDoesNotReplaceTheImu) {
  const SimulatedDive dive = simulate_dive({.grade = Grade::tactical, .minutes = 2, .dvl_scale = false});
  NavigationOptions options;
  options.covariance = false;
  struct Fault {
    std::string name;
    double end;
    std::function<void(Vector<3>&, double)> change;
  };
  const std::vector<Fault> faults = {
      {"ramp", HUGE_VAL, [](Vector<3>& v, double since) { v.x() += 0.5 * since; }},
      {"step of 30 s", 90, [](Vector<3>& v, double) { v.y() += 8; }},
  };
  for (const Fault& fault : faults) {
    SCOPED_TRACE(fault.name);
    NavigationData faulty = dive.data, without = dive.data;
    const auto wrong = [&](const EgoMeasurement& m) { return m.t > 60 && m.t < fault.end; };
    for (EgoMeasurement& m : sensor_of(faulty, EgoSensorType::dvl).measurements)
      if (wrong(m)) fault.change(m.value, m.t - 60);
    std::erase_if(sensor_of(without, EgoSensorType::dvl).measurements, wrong);
    const Navigation found = navigate(faulty, options), expected = navigate(without, options);
    EXPECT_TRUE(found.summary.converged());
    EXPECT_TRUE(rejects(found, "dvl"));
    EXPECT_FALSE(rejects(found, "imu"));
    EXPECT_LT(largest_distance(found, expected), 1);
  }
}

/// Estimates start from the first measurements, which nothing before them can contradict. The states are those without
/// the wrong ones.
TEST(GrossErrors, WrongFirstMeasurementsAreNamedAndDoNotMoveTheStates) {
  const SimulatedDive dive = simulate_dive({.grade = Grade::tactical, .minutes = 1});
  NavigationOptions options;
  options.covariance = false;
  const auto wrong = [&](EgoSensorType type, std::size_t n, const Vector<3>& by) {
    SCOPED_TRACE(std::string(name(type)));
    NavigationData data = dive.data;
    EgoSensor& sensor = sensor_of(data, type);
    for (std::size_t i = 0; i < n; ++i) {
      sensor.measurements[i].value += by;
      if (type == EgoSensorType::heading)
        sensor.measurements[i].rotation = SO3::Exp(by) * sensor.measurements[i].rotation;
    }
    NavigationData without = dive.data;
    std::vector<EgoMeasurement>& right = sensor_of(without, type).measurements;
    right.erase(right.begin(), right.begin() + std::ptrdiff_t(n));
    const Navigation found = navigate(data, options), expected = navigate(without, options);
    EXPECT_TRUE(found.summary.converged());
    EXPECT_TRUE(rejects(found, std::string(name(type))));
    EXPECT_FALSE(rejects(found, "imu"));
    EXPECT_LT(largest_distance(found, expected), 0.01);
  };
  wrong(EgoSensorType::dvl, 1, {4, 0, 0});
  wrong(EgoSensorType::dvl, 10, {0, 6, 0});
  wrong(EgoSensorType::gps, 3, {0, 50, 0});
  wrong(EgoSensorType::depth, 20, {0, 0, -30});
  wrong(EgoSensorType::heading, 1, {0, 0, 2});
}

TEST(GrossErrors, AreNotFoundInOrdinaryNoise) {
  const SimulatedDive dive = simulate_dive({.grade = Grade::tactical, .minutes = 2, .seed = 5});
  NavigationOptions options;
  options.covariance = false;
  for (const NavigationFinding& finding : navigate(dive.data, options).findings)
    EXPECT_EQ(finding.kind, NavigationFinding::Kind::silent) << finding.text();
}

}  // namespace
}  // namespace tandem
