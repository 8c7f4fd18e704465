#include <cmath>
#include <functional>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/solvers/online/heading_alignment.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>

/// Wrong values of each of the chaser's own sensors, online: no state moves by more than three standard deviations
/// without a rejection that names the sensor, and the estimate recovers.
namespace tandem::faults {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kFault = 60, kEnd = 120;  // s

struct TrackedRun {
  double largest = 0, at_end = 0;  // position errors in the fault and at the end [m]
  double falsely_aided = 0;        // longest time of `aided` beyond three standard deviations [s]
  std::string messages;
};

Vector<3> truth_at(const SimulatedDive& dive, double t) {
  const auto after = std::lower_bound(dive.truth.begin(), dive.truth.end(), t,
                                      [](const Stamped<SE23>& x, double time) { return x.t < time; });
  return (after == dive.truth.end() ? dive.truth.back() : *after).value.translation();
}

TrackedRun run(const SimulatedDive& dive, const NavigationData& data) {
  TrackedRun result;
  OnlineOptions options;
  options.lag.window = 20;
  OnlineEstimator estimator(TrackingData(), online_settings(data), options);
  std::optional<double> wrong_since;
  estimator.on_update = [&](const OnlineUpdate& update) {
    const double error = (estimator.chaser().pose.translation() - truth_at(dive, update.t)).norm();
    if (update.t >= kFault) result.largest = std::max(result.largest, error);
    result.at_end = error;
    double sigma = HUGE_VAL;
    try {
      sigma = std::sqrt(estimator.covariance().chaser.topLeftCorner<3, 3>().trace());
    } catch (const Error&) {
    }
    const bool wrong = estimator.health().chaser.state == OutputState::aided && error > 3 * sigma + 0.5;
    if (!wrong) wrong_since.reset();
    if (wrong && !wrong_since) wrong_since = update.t;
    if (wrong) result.falsely_aided = std::max(result.falsely_aided, update.t - *wrong_since);
  };
  estimator.on_reject = [&](const std::string&, const Rejection& why) { result.messages += why.text + "\n"; };
  estimator.on_reset = [&](const TrackReset& reset) { result.messages += reset.why + "\n"; };
  // In order of the stamps, as replay(), but with the reasons of all rejections.
  std::multimap<double, std::function<std::optional<Rejection>()>> lines;
  for (const ImuSample& sample : data.imu->samples) lines.emplace(sample.t, [&] { return estimator.add_imu(sample); });
  for (std::size_t s = 0; s < data.sensors.size(); ++s)
    for (const EgoMeasurement& m : data.sensors[s].measurements)
      lines.emplace(m.t, [&estimator, &m, s] { return estimator.add_ego(s, m); });
  for (const auto& [t, add] : lines)
    if (const auto why = add()) result.messages += why->text + "\n";
  estimator.finish();
  return result;
}

struct Fault {
  std::string name;
  std::function<void(Vector<3>&, const Vector<3>& before, int i)> change;  // of value i from the fault on
};

const std::vector<Fault>& faults() {
  const auto scaled = [](double factor, int n) {
    return [=](Vector<3>& v, const Vector<3>&, int i) {
      if (i < n) v.array() += factor;
    };
  };
  static const std::vector<Fault> all = {
      {"one value 1e3 off", scaled(1e3, 1)},
      {"one value 1e6 off", scaled(1e6, 1)},
      {"one value 1e9 off", scaled(1e9, 1)},
      {"30 values 300 off", scaled(300, 30)},
      {"zeros",
       [](Vector<3>& v, const Vector<3>&, int i) {
         if (i < 30) v.setZero();
       }},
      {"-32.768",
       [](Vector<3>& v, const Vector<3>&, int i) {
         if (i < 30) v.setConstant(-32.768);
       }},
      {"not a number",
       [](Vector<3>& v, const Vector<3>&, int i) {
         if (i < 30) v.setConstant(std::nan(""));
       }},
      {"frozen",
       [](Vector<3>& v, const Vector<3>& before, int i) {
         if (i < 100) v = before;
       }},
  };
  return all;
}

TEST(GrossErrorsOnline, AreNamedAndRecoveredFrom) {
  const SimulatedDive dive = simulate_dive({.grade = Grade::tactical, .minutes = kEnd / 60, .seed = 4});
  const TrackedRun clean = run(dive, dive.data);
  EXPECT_LE(clean.falsely_aided, 10);
  for (std::size_t s = 0; s <= dive.data.sensors.size(); ++s) {
    const bool imu = s == dive.data.sensors.size();
    const std::string sensor = imu ? "imu" : dive.data.sensors[s].name;
    if (sensor == "heading" || sensor == "gps") continue;  // no vector; only at the surface
    for (const Fault& fault : faults()) {
      SCOPED_TRACE(sensor + ": " + fault.name);
      NavigationData data = dive.data;
      int i = 0;
      std::optional<Vector<3>> before, rate_before;
      if (imu)
        for (ImuSample& sample : data.imu->samples) {
          if (sample.t < kFault) continue;
          if (!before) before = sample.specific_force, rate_before = sample.angular_rate;
          fault.change(sample.specific_force, *before, i);
          fault.change(sample.angular_rate, *rate_before, i++);
        }
      else
        for (EgoMeasurement& m : data.sensors[s].measurements) {
          if (m.t < kFault) continue;
          if (!before) before = m.value;
          fault.change(m.value, *before, i++);
        }
      const TrackedRun found = run(dive, data);
      EXPECT_THAT(found.messages, HasSubstr(sensor));
      EXPECT_LE(found.falsely_aided, 10) << found.messages.substr(0, 500);
      EXPECT_LE(found.at_end, 1.5 * clean.at_end + 0.3) << found.messages.substr(0, 500);
    }
  }
}

struct ImuFaultCase {
  std::string name;
  std::function<void(ImuSample&, const ImuSample& first)> change;
};

/// A constant error of one axis, and an axis that is stuck, for 15 s and to the end: without the IMU the other sensors
/// agree, so they win, and the run names the IMU. It is used again when it works again.
TEST(GrossErrorsOnline, AnImuThatContradictsAllOthersIsNotUsed) {
  const SimulatedDive dive = simulate_dive({.grade = Grade::tactical, .minutes = kEnd / 60, .seed = 4});
  const TrackedRun clean = run(dive, dive.data);
  EXPECT_THAT(clean.messages, Not(HasSubstr("imu contradicts")));
  const std::vector<ImuFaultCase> cases = {
      {"specific force x", [](ImuSample& s, const ImuSample&) { s.specific_force.x() += 8; }},
      {"specific force z", [](ImuSample& s, const ImuSample&) { s.specific_force.z() += 8; }},
      {"rate x", [](ImuSample& s, const ImuSample&) { s.angular_rate.x() += 0.3; }},
      {"rate z", [](ImuSample& s, const ImuSample&) { s.angular_rate.z() += 0.3; }},
      {"stuck", [](ImuSample& s, const ImuSample& first) { s.specific_force.z() = first.specific_force.z() + 1; }},
  };
  for (const double duration : {15.0, kEnd})
    for (const ImuFaultCase& fault : cases) {
      SCOPED_TRACE(fault.name + " for " + std::to_string(duration));
      NavigationData data = dive.data;
      std::optional<ImuSample> first;
      for (ImuSample& sample : data.imu->samples) {
        if (sample.t < kFault || sample.t > kFault + duration) continue;
        if (!first) first = sample;
        fault.change(sample, *first);
      }
      const TrackedRun found = run(dive, data);
      EXPECT_THAT(found.messages, HasSubstr("imu contradicts"));
      EXPECT_LE(found.falsely_aided, 10);
      EXPECT_LE(found.at_end, duration < kEnd ? 1.5 * clean.at_end + 0.3 : 3.0);
      if (duration < kEnd) EXPECT_THAT(found.messages, HasSubstr("imu agrees with the other sensors again"));
    }
}

/// The estimate starts from the first measurements. Those after them replace wrong ones.
TEST(GrossErrorsOnline, WrongFirstMeasurementsDoNotStay) {
  const SimulatedDive dive = simulate_dive({.grade = Grade::tactical, .minutes = 1, .seed = 4});
  const double clean = run(dive, dive.data).at_end;
  const auto wrong = [&](EgoSensorType type, std::size_t n, const Vector<3>& by) {
    SCOPED_TRACE(std::string(name(type)));
    NavigationData data = dive.data;
    for (EgoSensor& sensor : data.sensors)
      for (std::size_t i = 0; sensor.type == type && i < n; ++i) {
        EgoMeasurement& m = sensor.measurements[i];
        m.value += by;
        if (type == EgoSensorType::heading) m.rotation = SO3::Exp(by) * m.rotation;
      }
    EXPECT_LE(run(dive, data).at_end, 1.5 * clean + 0.3);
  };
  wrong(EgoSensorType::heading, 1, {0, 0, 2});
  wrong(EgoSensorType::dvl, 1, {6, 0, 0});
}

}  // namespace
}  // namespace tandem::faults
