#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/tuning/model_settings.hpp>
#include <tandem/studies/tuning/proposed_changes.hpp>

namespace tandem {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// Two range-bearing sensors with fixes each second, or `rate` by the second one, whose fixes are `offset` seconds later.
Scenario two_sensors(double offset, double rate = 1) {
  Scenario scenario;
  scenario.data.planar = true;
  scenario.data.noise = TrackingNoise(true);
  scenario.data.noise.constant_twist.setConstant(0.1);
  for (const double shift : {0.0, offset}) {
    TargetSensor& sensor = scenario.data.sensors.emplace_back();
    sensor.name = shift == 0 ? "lidar" : "radar";
    sensor.type = SensorType::range_bearing;
    sensor.sigma = Vector<2>(1.5, 0.02);
    for (int i = 0; i < (shift == 0 ? 50 : 50 * rate); ++i) {
      Measurement m;
      m.t = shift == 0 ? i : i / rate + shift;
      sensor.measurements.push_back(m);
    }
  }
  return scenario;
}

/// Residuals of all components: alternating signs, or slow ones.
std::vector<Misfit> residuals(bool slow) {
  std::vector<Misfit> all;
  for (const char* parameter : {"lidar.range", "lidar.bearing", "radar.range", "radar.bearing"}) {
    Misfit& m = all.emplace_back();
    m.parameter = parameter;
    for (int i = 0; i < 50; ++i) m.add(i, slow ? std::sin(0.2 * i) : (i % 2 == 0 ? 0.8 : -0.8));
  }
  return all;
}

std::vector<std::string> texts(const std::vector<ModelChange>& changes) {
  std::vector<std::string> all;
  for (const ModelChange& change : changes) all.push_back(describe(change.settings));
  return all;
}

TEST(ModelSettingsWords, AreOptionsOfTheCommandLine) {
  const ModelSettings settings = {{"error lidar", "1.5,0.02:10"}, {"model", "damped-twist"}, {"robust", "true"}};
  EXPECT_THAT(words_of(settings), ElementsAre("--error=lidar=1.5,0.02:10", "--model=damped-twist", "--robust"));
  EXPECT_EQ(describe({{"error lidar", ""}}), "without --error lidar");
}

TEST(ProposedChanges, HaveDriftingBiasesOfSensorsThatCheckEachOther) {
  const auto proposed = texts(proposed_changes(two_sensors(0.1), {}, residuals(true)));
  EXPECT_THAT(proposed, Contains("--error lidar=1.5,0.02:10"));
  EXPECT_THAT(proposed, Contains("--error lidar=1.5,0.02:10 --error radar=1.5,0.02:10"));
  EXPECT_THAT(proposed, Contains("--error radar.delay=0.5"));
  EXPECT_THAT(proposed, Contains("--model damped-twist"));
  EXPECT_THAT(proposed, Contains("--horizons 1,2,4"));
  EXPECT_THAT(proposed, Not(Contains("--roll-pitch off"))) << "in the plane";
}

/// A sensor of low rate checks the slow errors of one of high rate.
TEST(ProposedChanges, HaveSystematicErrorsOfSensorsOfDifferentRates) {
  const auto proposed = texts(proposed_changes(two_sensors(0.02, 5), {}, residuals(true)));
  EXPECT_THAT(proposed, Contains("--error lidar=1.5,0.02:10"));
  EXPECT_THAT(proposed, Contains("--error radar=1.5,0.02:10"));
}

TEST(ProposedChanges, HaveNoSystematicErrorsBesideASensorWithoutMeasurements) {
  Scenario scenario = two_sensors(0.1);
  scenario.data.sensors[1].measurements.clear();
  for (const std::string& text : texts(proposed_changes(scenario, {}, residuals(true))))
    EXPECT_TRUE(text.find("--error") == text.npos && text.find("--horizons") == text.npos) << text;
}

/// Between the fixes of a sensor, the motion of the target explains what a bias would.
TEST(ProposedChanges, HaveNoSystematicErrorsOfLoneSensors) {
  for (const std::string& text : texts(proposed_changes(two_sensors(0.5), {}, residuals(true))))
    EXPECT_EQ(text.find("--error"), text.npos) << text;
}

TEST(ProposedChanges, HaveTargetsThatMoveForwardsWithSomeSway) {
  const auto proposed = texts(proposed_changes(two_sensors(0.1), {}, residuals(false)));
  EXPECT_THAT(proposed, Contains("--non-holonomic soft"));
  EXPECT_THAT(proposed, Contains("--noise non_holonomic=0.5 --non-holonomic soft"));
  EXPECT_THAT(texts(refined_changes(two_sensors(0.1), {}, {})), Not(Contains(HasSubstr("non_holonomic"))));
  TrackingOptions options;
  options.non_holonomic = Role::soft;
  EXPECT_THAT(texts(refined_changes(two_sensors(0.1), options, {})), Contains("--noise non_holonomic=0.1"));
}

TEST(ProposedChanges, LeaveTurnedPosesToRobustLosses) {
  Scenario scenario = two_sensors(0.5);
  scenario.data.sensors[0].type = SensorType::pose;
  scenario.data.sensors[0].sigma = Vector<3>(0.3, 0.3, 0.05);
  std::vector<Misfit> all = residuals(false);
  for (Misfit& m : all)
    if (m.parameter == "lidar.range") m.parameter = "lidar.x";
  TrackingOptions options;
  EXPECT_THAT(texts(proposed_changes(scenario, options, all)), Contains("--loss lidar.orientation=cauchy:2"));
  make_robust(options);
  EXPECT_THAT(texts(proposed_changes(scenario, options, all)), Not(Contains(HasSubstr("orientation"))));
}

TEST(RefinedChanges, DoubleAndHalveErrorsTimesAndNoise) {
  Scenario scenario = two_sensors(0.1);
  scenario.data.sensors[0].error = SystematicError{Vector<2>(1, 0.04), 10};
  const auto refined = texts(refined_changes(scenario, {}, {{"error lidar", "1,0.04:10"}}));
  for (const char* change : {"--error lidar=2,0.08:10", "--error lidar=0.5,0.02:10", "--error lidar=1,0.04:20",
                             "--error lidar=1,0.04:5", "--noise lidar=3,0.04", "--noise constant_twist=0.2,0.2,0.2"})
    EXPECT_THAT(refined, Contains(change));
  EXPECT_THAT(texts(refined_changes(scenario, {}, {{"error lidar", "1,0.04:40"}})),
              Not(Contains("--error lidar=1,0.04:80")))
      << "longer than the recording";
}

TEST(RefinedChanges, DoubleAndHalveTimeConstantsOfDampedModels) {
  TrackingOptions options;
  EXPECT_THAT(texts(refined_changes(two_sensors(0.1), options, {})), Not(Contains(HasSubstr("_time"))));
  options.model = MotionModel::damped_twist;
  EXPECT_THAT(texts(refined_changes(two_sensors(0.1), options, {})), Contains("--noise twist_time=120,120,120"));
  options.mode = Mode::B;
  EXPECT_THAT(texts(refined_changes(two_sensors(0.1), options, {})), Contains("--noise velocity_time=30,30"));
}

TEST(KeepsStatedNoise, CountsNoiseAndBiasTogether) {
  const Scenario stated = two_sensors(0.1);
  Scenario smaller = stated;
  smaller.data.sensors[0].sigma *= 0.5;
  EXPECT_FALSE(keeps_stated_noise(stated, smaller));
  smaller.data.sensors[0].error = SystematicError{Vector<2>(1.2, 0.016), 10};
  EXPECT_TRUE(keeps_stated_noise(stated, smaller));
  EXPECT_TRUE(keeps_stated_noise(stated, stated));
}

}  // namespace
}  // namespace tandem
