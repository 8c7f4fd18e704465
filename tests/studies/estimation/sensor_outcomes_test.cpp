#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/estimation/sensor_outcomes.hpp>

#include "problem/tracking/simulated_tracking.hpp"

namespace tandem {
namespace {

using testing::Simulation;

/// A noise-free scenario in which each sensor has a delay of 0.3 s.
Scenario scenario() {
  Scenario s;
  s.data = Simulation{}.data();
  for (TargetSensor& sensor : s.data.sensors) {
    sensor.delay = 0.3;
    std::erase_if(sensor.measurements, [](const Measurement& m) { return m.t + 0.3 > 20; });
    for (Measurement& m : sensor.measurements) m.t += 0.3;
  }
  for (double t = 0; t <= 20; t += 0.5) {
    s.truth_chaser.push_back({t, Simulation::chaser(t)});
    s.truth_target.push_back({t, Simulation::target(t)});
  }
  return s;
}

std::vector<std::string> parts(const MeasurementOutcome& m) {
  std::vector<std::string> names;
  for (const PartWeight& part : m.parts) names.emplace_back(part.part);
  return names;
}

TEST(SensorOutcomes, CompareRawMeasurementsAtTheirValidTime) {
  Scenario s = scenario();
  s.data.sensors[0].measurements[2].position += Vector<3>(0, 3, 4);
  s.data.sensors[0].measurements[4].held_out = true;
  const TrackingProblem tracking = make_tracking_problem(s.data);
  const auto measurements = measurement_outcomes(s, tracking);
  const auto sensors = sensor_outcomes(s, {}, tracking, measurements);
  ASSERT_EQ(sensors.size(), 2u);
  const int n = static_cast<int>(s.data.sensors[0].measurements.size());
  EXPECT_EQ(sensors[0].name, "usbl");
  EXPECT_EQ(sensors[0].used, n - 1);
  EXPECT_EQ(sensors[0].held_out, 1);
  EXPECT_EQ(sensors[0].delay, 0.3);
  EXPECT_FALSE(sensors[0].robust);
  EXPECT_NEAR(sensors[0].raw_position->mean, 5.0 / n, 1e-9);
  EXPECT_NEAR(sensors[1].raw_position->mean, 0, 1e-9);
  EXPECT_NEAR(*measurements[2].raw_position, 5, 1e-9);
  EXPECT_EQ(measurements[2].t, s.data.sensors[0].measurements[2].t) << "the stamp";
  EXPECT_TRUE(measurements[4].held_out);
  EXPECT_THAT(parts(measurements[4]), ::testing::ElementsAre());
  EXPECT_THAT(parts(measurements[2]), ::testing::ElementsAre("all"));
  EXPECT_FALSE(measurements[2].down_weighted()) << "no loss";
}

/// One pose measurement is rotated. At the true trajectories, only its orientation must be down-weighted.
void check_turned_pose(const TrackingOptions& options, const std::vector<std::string>& names) {
  Scenario s = scenario();
  SO3& turned = s.data.sensors[1].measurements[1].rotation;
  turned = turned * SO3::Exp({0, 0, 3.0});
  TrackingProblem tracking = make_tracking_problem(s.data, options);
  for (std::size_t i = 0; i < tracking.keyframes.size(); ++i) {
    const double t = tracking.keyframes[i].t;
    tracking.problem.set_value(testing::pose(tracking.chaser[i]), Simulation::chaser(t));
    tracking.problem.set_value(testing::pose(tracking.target[i]), Simulation::target(t));
  }
  const auto measurements = measurement_outcomes(s, tracking);
  const auto sensors = sensor_outcomes(s, options, tracking, measurements);
  EXPECT_TRUE(sensors[0].robust && sensors[1].robust);
  EXPECT_EQ(sensors[0].down_weighted, 0);
  EXPECT_EQ(sensors[1].down_weighted, 1);
  const MeasurementOutcome& outcome = measurements[s.data.sensors[0].measurements.size() + 1];
  EXPECT_EQ(parts(outcome), names);
  EXPECT_TRUE(outcome.down_weighted());
  for (const PartWeight& part : outcome.parts) {
    const bool correct = part.part == "position";
    EXPECT_NEAR(part.weight, correct ? 1 : 0, correct ? 1e-6 : 0.01) << part.part;
  }
}

TEST(SensorOutcomes, HaveSeparateWeightsOfPoseParts) {
  TrackingOptions options;
  options.loss = Cauchy(2.0);
  options.position_share = 0.1;
  check_turned_pose(options, {"all", "position"});
  options.position_share = 0;
  options.orientation_loss = Cauchy(1.0);
  check_turned_pose(options, {"position", "orientation"});
}

}  // namespace
}  // namespace tandem
