#include <gtest/gtest.h>

#include <tandem/studies/navigation/likely_own_causes.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>

namespace tandem {
namespace {

/// Returns the best cause that is found after a change of all measurements of one type.
template <class Change>
std::string best_cause(EgoSensorType type, Change change) {
  static const SimulatedDive dive = simulate_dive({.grade = Grade::tactical, .minutes = 1.5});
  NavigationData data = dive.data;
  for (EgoSensor& sensor : data.sensors)
    if (sensor.type == type)
      for (EgoMeasurement& m : sensor.measurements) change(m);
  NavigationOptions options;
  options.covariance = false;
  const std::vector<LikelyCause> causes = likely_own_causes(data, options, navigate(data, options), Frame());
  return causes.empty() ? "" : causes.front().sensor + ": " + causes.front().text;
}

TEST(LikelyOwnCauses, NoneWithoutAMisfit) {
  EXPECT_EQ(best_cause(EgoSensorType::depth, [](EgoMeasurement&) {}), "");
}

TEST(LikelyOwnCauses, NameTheSignOfDepths) {
  EXPECT_EQ(best_cause(EgoSensorType::depth, [](EgoMeasurement& m) { m.value = -m.value; }),
            "depth: depths have the opposite sign");
}

TEST(LongLikelyOwnCauses, NameTheZeroOfHeadings) {
  EXPECT_EQ(best_cause(EgoSensorType::heading,
                       [](EgoMeasurement& m) {
                         m.rotation = SO3::Exp({0, 0, 1.5707963267948966}) * m.rotation;
                       }),
            "heading: headings are 90° too large");
}

TEST(LongLikelyOwnCauses, NameSwappedAxes) {
  EXPECT_EQ(best_cause(EgoSensorType::dvl, [](EgoMeasurement& m) { std::swap(m.value.x(), m.value.y()); }),
            "dvl: x and y are swapped");
}

/// A drift of 0.5 m/s has no name, but without the sensor, the others agree.
TEST(LongLikelyOwnCauses, NameASensorThatDrifts) {
  EXPECT_EQ(best_cause(EgoSensorType::gps, [](EgoMeasurement& m) { m.value.x() += 0.5 * m.t; }),
            std::string("gps: ") + kContradicts);
}

}  // namespace
}  // namespace tandem
