#include <cmath>

#include <gtest/gtest.h>

#include <tandem/problem/navigation/wrong_first_lines.hpp>

namespace tandem {
namespace {

/// A depth sensor at 1 Hz whose height is a function of the line.
template <class F>
EgoSensor depth_sensor(F height) {
  EgoSensor sensor{.name = "depth", .type = EgoSensorType::depth};
  sensor.sigma = Eigen::VectorXd::Constant(1, 0.05);
  for (int i = 0; i < 120; ++i) sensor.measurements.push_back({double(i), {0, 0, height(i)}});
  return sensor;
}

TEST(WrongFirstLines, EndAtAJump) {
  for (const int n : {1, 2, 10, 30})
    EXPECT_EQ(wrong_first_lines(depth_sensor([n](int i) { return 0.03 * std::sin(i) + (i < n ? 5 : 0); })),
              std::size_t(n));
}

TEST(WrongFirstLines, AreNotFoundInMotion) {
  EXPECT_EQ(wrong_first_lines(depth_sensor([](int i) { return -0.5 * i; })), 0u);                        // steady
  EXPECT_EQ(wrong_first_lines(depth_sensor([](int i) { return i < 20 ? 0.0 : -0.5 * (i - 20); })), 0u);  // starts
  EXPECT_EQ(wrong_first_lines(depth_sensor([](int i) { return -2.0 * std::min(i, 20); })), 0u);          // stops
  EXPECT_EQ(wrong_first_lines(depth_sensor([](int i) { return i == 60 ? 40.0 : 0.0; })), 0u);            // later
}

/// After a gap, a sensor may be anywhere.
TEST(WrongFirstLines, AreNotFoundAcrossAGap) {
  EgoSensor sensor = depth_sensor([](int i) { return i < 10 ? 0.0 : -40.0; });
  for (std::size_t i = 10; i < sensor.measurements.size(); ++i) sensor.measurements[i].t += 100;
  EXPECT_EQ(wrong_first_lines(sensor), 0u);
}

TEST(WrongFirstLines, AreNotFoundInFewLines) {
  EgoSensor sensor = depth_sensor([](int i) { return i < 1 ? 9.0 : 0.0; });
  sensor.measurements.resize(4);
  EXPECT_EQ(wrong_first_lines(sensor), 0u);
}

}  // namespace
}  // namespace tandem
