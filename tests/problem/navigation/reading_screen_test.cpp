#include <cmath>

#include <gtest/gtest.h>

#include <tandem/problem/navigation/reading_screen.hpp>

namespace tandem {
namespace {

EgoSensor sensor_of(EgoSensorType type, double sigma) {
  EgoSensor sensor{.name = std::string(name(type)), .type = type};
  sensor.sigma = Eigen::VectorXd::Constant(rows(type), sigma);
  return sensor;
}

/// 200 readings of a sensor at 5 Hz that vary, of which change(i, value) may alter any.
template <class F>
std::vector<EgoMeasurement> readings(F change) {
  std::vector<EgoMeasurement> lines;
  for (int i = 0; i < 200; ++i) {
    Vector<3> value(1 + 0.1 * std::sin(0.3 * i), 0.01 * std::cos(0.7 * i), 0.01 * std::sin(i));
    change(i, value);
    lines.push_back({0.2 * i, value});
  }
  return lines;
}

/// Returns the number of lines that a screen discards online for a reason.
std::size_t online(const EgoSensor& sensor, const std::vector<EgoMeasurement>& lines, ReadingFault why) {
  ReadingScreen screen(screen_options(sensor));
  std::size_t n = 0;
  for (const EgoMeasurement& m : lines) n += screen.judge(m.t, reading(sensor.type, m)) == why;
  return n;
}
ScreenedByFault recorded(const EgoSensor& sensor, std::vector<EgoMeasurement> lines) {
  return screen(lines, screen_options(sensor), [&](const EgoMeasurement& m) { return reading(sensor.type, m); });
}

TEST(ReadingScreen, ExactZerosFarFromTheValuesBeforeMarkMissingData) {
  const EgoSensor dvl = sensor_of(EgoSensorType::dvl, 0.01);
  const auto lines = readings([](int i, Vector<3>& v) {
    if (i >= 100 && i < 130) v.setZero();
  });
  EXPECT_EQ(online(dvl, lines, ReadingFault::zero), 30u);
  EXPECT_EQ(recorded(dvl, lines)[std::size_t(ReadingFault::zero)].count, 30u);
  EXPECT_EQ(recorded(dvl, lines)[std::size_t(ReadingFault::zero)].from, 20.0);
}

TEST(ReadingScreen, AVehicleThatStopsMayReadZero) {
  const EgoSensor dvl = sensor_of(EgoSensorType::dvl, 0.01);
  const auto lines = readings([](int i, Vector<3>& v) { v *= std::max(0.0, 1 - 0.01 * i); });
  for (const ScreenedLines& found : recorded(dvl, lines)) EXPECT_EQ(found.count, 0u);
}

TEST(ReadingScreen, AFrozenSensorIsFoundOnlineAsInARecording) {
  const EgoSensor dvl = sensor_of(EgoSensorType::dvl, 0.01);
  const auto lines = readings([](int i, Vector<3>& v) {
    if (i >= 100 && i < 180) v = {0.7, 0.1, 0};
  });
  EXPECT_EQ(recorded(dvl, lines)[std::size_t(ReadingFault::frozen)].count, 79u) << "all repetitions";
  EXPECT_EQ(online(dvl, lines, ReadingFault::frozen), 71u) << "from the tenth equal line on";
}

TEST(ReadingScreen, OneStuckAxisIsFoundOnlineAsInARecording) {
  const EgoSensor dvl = sensor_of(EgoSensorType::dvl, 0.01);
  for (int axis = 0; axis < 3; ++axis) {
    const auto lines = readings([axis](int i, Vector<3>& v) {
      if (i >= 100 && i < 180) v[axis] = 0.0123;
    });
    EXPECT_EQ(recorded(dvl, lines)[std::size_t(ReadingFault::frozen)].count, 79u) << axis;
    EXPECT_EQ(online(dvl, lines, ReadingFault::frozen), 71u) << axis;
  }
}

/// Coarse values repeat, those of a vehicle at rest too, and an axis that hardly moves.
TEST(ReadingScreen, AnAxisMayRepeatItsValue) {
  const EgoSensor dvl = sensor_of(EgoSensorType::dvl, 0.01);
  const auto rounded = [](double x, double quantum) { return quantum * std::round(x / quantum); };
  const auto coarse = readings([&](int, Vector<3>& v) {
    for (double& x : v) x = rounded(x, 0.01);
  });
  const auto at_rest = readings([&](int i, Vector<3>& v) {
    if (i >= 100 && i < 180) v = Vector<3>(0.012, 0.0002 * (i % 2), 0.002);
  });
  const auto constant = readings([](int i, Vector<3>& v) { v.z() = i < 100 ? 0.3 : 0.4; });
  const auto settling = readings([](int i, Vector<3>& v) {
    v.y() = i < 100 || i > 126 ? v.y() : 0.2 + std::round(1e6 * std::exp(100 - i)) / 1e6;
  });
  for (const auto& lines : {coarse, at_rest, constant, settling}) {
    EXPECT_EQ(recorded(dvl, lines)[std::size_t(ReadingFault::frozen)].count, 0u);
    EXPECT_EQ(online(dvl, lines, ReadingFault::frozen), 0u);
  }
}

TEST(ReadingScreen, ADepthMayRepeatForSomeSeconds) {
  const EgoSensor depth = sensor_of(EgoSensorType::depth, 0.1);
  const auto with_run = [](int n) {
    return readings([n](int i, Vector<3>& v) { v = {0, 0, i >= 100 && i < 100 + n ? -5.0 : -5 - 0.01 * i}; });
  };
  EXPECT_EQ(recorded(depth, with_run(20))[std::size_t(ReadingFault::frozen)].count, 0u);
  EXPECT_EQ(recorded(depth, with_run(60))[std::size_t(ReadingFault::frozen)].count, 59u);
}

TEST(ReadingScreen, ValuesBeyondTheRangeAndNanAreDiscarded) {
  const EgoSensor dvl = sensor_of(EgoSensorType::dvl, 0.01);
  const auto lines = readings([](int i, Vector<3>& v) {
    if (i == 50) v.setConstant(-32.768);
    if (i == 60) v.x() = 1e6;
    if (i == 70) v.y() = std::nan("");
  });
  EXPECT_EQ(online(dvl, lines, ReadingFault::out_of_range), 2u);
  EXPECT_EQ(online(dvl, lines, ReadingFault::missing), 1u);
}

}  // namespace
}  // namespace tandem
