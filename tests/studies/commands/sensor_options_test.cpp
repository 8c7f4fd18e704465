#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/commands/sensor_options.hpp>

#include "run_here.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

Scenario scenario_with(bool own) {
  Scenario scenario;
  scenario.data.sensors.push_back({.name = "usbl", .sigma = Vector<3>::Zero()});
  scenario.data.sensors.push_back({.name = "camera", .type = SensorType::pose, .sigma = Vector<6>::Ones()});
  scenario.data.sensors[0].measurements.resize(5);
  scenario.files.target = {"usbl.csv", "camera.csv"};
  if (!own) return scenario;
  NavigationData& data = scenario.navigation.emplace();
  data.imu.emplace();
  data.sensors.push_back({.name = "dvl", .type = EgoSensorType::dvl, .sigma = Vector<3>::Ones()});
  data.sensors.push_back({.name = "gps", .type = EgoSensorType::gps, .sigma = Vector<3>::Ones()});
  scenario.files.ego = {"dvl.csv", "gps.csv"};
  scenario.files.imu = "imu.csv";
  return scenario;
}

/// A scenario after sensor options were applied, the options, and the error message.
struct Applied {
  Scenario scenario;
  SensorOptions options;
  std::string error;
};
Applied apply_words(const std::vector<std::string>& words, bool own, bool target = true, bool ned = false) {
  Applied result{scenario_with(own), {}, {}};
  if (ned) result.scenario.frame = Frame::ned_frd();
  result.error = run_here(
                     [&](CommandOptions& option) {
                       add_sensors(option, result.options);
                       add_hold_out(option, result.options);
                       return [&] {
                         apply(result.options, {target, own}, result.scenario);
                         return 0;
                       };
                     },
                     words)
                     .errors;
  return result;
}

TEST(SensorOptions, SetsNoise) {
  const Applied a = apply_words({"--noise", "usbl=1, 2,3", "--noise", "surge=0.5", "--noise", "odometry=1,2,3,4,5,6",
                                 "--noise", "dvl=4,5,6", "--noise", "imu=1,2,3,4"},
                                true);
  EXPECT_EQ(a.error, "");
  EXPECT_EQ(a.scenario.data.sensors[0].sigma, Vector<3>(1, 2, 3));
  EXPECT_EQ(a.scenario.data.noise.surge, 0.5);
  EXPECT_EQ(a.scenario.data.noise.odometry[5], 6.0);
  EXPECT_EQ(a.scenario.navigation->sensors[0].sigma, Vector<3>(4, 5, 6));
  const ImuNoise& imu = a.scenario.navigation->imu->noise;
  EXPECT_EQ(imu.accelerometer, 1);
  EXPECT_EQ(imu.gyroscope, 2);
  EXPECT_EQ(imu.accelerometer_bias_walk, 3);
  EXPECT_EQ(imu.gyroscope_bias_walk, 4);
}

TEST(SensorOptions, NoiseIsAlongAxesOfFiles) {
  const Applied a = apply_words({"--noise", "gps=1,2,3", "--noise", "boundary=1,2,3"}, true, true, true);
  EXPECT_EQ(a.scenario.navigation->sensors[1].sigma, Vector<3>(2, 1, 3)) << "north and east are swapped";
  EXPECT_EQ(a.scenario.data.noise.boundary, Vector<3>(2, 1, 3));
}

TEST(SensorOptions, SetsLosses) {
  const Applied a = apply_words({"--loss", "huber:3", "--loss", "orientation=tukey", "--loss", "camera=cauchy:2",
                                 "--loss", "camera.orientation=huber:4", "--loss", "dvl=cauchy:5"},
                                true);
  EXPECT_EQ(a.error, "");
  EXPECT_EQ(a.options.loss()->scale, 3);
  EXPECT_EQ(a.options.orientation_loss()->kind, Loss::Kind::tukey);
  EXPECT_EQ(a.scenario.data.sensors[1].loss->scale, 2);
  EXPECT_EQ(a.scenario.data.sensors[1].orientation_loss->scale, 4);
  EXPECT_EQ(a.scenario.navigation->sensors[0].loss->scale, 5);
  EXPECT_FALSE(a.scenario.data.sensors[0].loss);
}

TEST(SensorOptions, SetsDelaysAndRemovesSensors) {
  const Applied a = apply_words(
      {"--delay", "dvl=0.1", "--delay", "camera=0.2", "--without", "usbl", "--without", "gps", "--without", "imu"},
      true);
  EXPECT_EQ(a.error, "");
  EXPECT_EQ(a.scenario.navigation->sensors[0].delay, 0.1);
  ASSERT_EQ(a.scenario.data.sensors.size(), 1u);
  EXPECT_EQ(a.scenario.data.sensors[0].name, "camera");
  EXPECT_EQ(a.scenario.data.sensors[0].delay, 0.2);
  EXPECT_THAT(a.scenario.files.target, testing::ElementsAre("camera.csv"));
  EXPECT_THAT(a.scenario.files.ego, testing::ElementsAre("dvl.csv"));
  EXPECT_FALSE(a.scenario.navigation->imu || a.scenario.files.imu);
}

TEST(SensorOptions, AcceptsNegativeDelayOfImu) {
  const Applied plain = apply_words({}, true), a = apply_words({"--delay", "imu=-0.005"}, true);
  EXPECT_EQ(a.error, "");
  const ImuSensor &before = *plain.scenario.navigation->imu, &imu = *a.scenario.navigation->imu;
  EXPECT_EQ(imu.delay, -0.005);
  ASSERT_EQ(imu.samples.size(), before.samples.size());
  for (std::size_t i = 0; i < imu.samples.size(); ++i) EXPECT_EQ(imu.samples[i].t, before.samples[i].t + 0.005);
}

TEST(SensorOptions, SetsSystematicErrors) {
  const Applied a = apply_words({"--error", "dvl.scale=0.01", "--error", "dvl=0.1,0.2,0.3:20", "--error",
                                 "usbl.delay=0.2", "--error", "usbl.misalignment=0.03"},
                                true);
  EXPECT_EQ(a.error, "");
  const SystematicError& dvl = *a.scenario.navigation->sensors[0].error;
  EXPECT_EQ(dvl.bias_sigma, Vector<3>(0.1, 0.2, 0.3));
  EXPECT_EQ(dvl.correlation_time, 20);
  EXPECT_EQ(dvl.scale_sigma, 0.01);
  const SystematicError& usbl = *a.scenario.data.sensors[0].error;
  EXPECT_FALSE(usbl.has_bias());
  EXPECT_EQ(usbl.delay_sigma, 0.2);
  EXPECT_EQ(usbl.misalignment_sigma, 0.03);
  const auto error = [](const char* value) { return apply_words({"--error", value}, true).error; };
  EXPECT_THAT(error("usbl.scale=0.1,0.2"), HasSubstr("give one positive standard deviation"));
  EXPECT_THAT(error("usbl.scale=0.1:20"), HasSubstr("usbl.scale is constant"));
  EXPECT_THAT(error("usbl.scale=0"), HasSubstr("positive"));
  EXPECT_THAT(error("usb.scale=0.1"), HasSubstr("--error: unknown sensor 'usb'"));
  EXPECT_THAT(error("usbl.size=0.1"),
              HasSubstr("unknown constant usbl.size; a sensor has usbl.scale, .misalignment and .delay"));
  EXPECT_THAT(error("imu.scale=0.1"), HasSubstr("set its delay by --delay imu=SECONDS"));
}

TEST(SensorOptions, HoldsOutEveryNthMeasurement) {
  const auto held_out = [](const std::string& value) {
    std::vector<bool> marks;
    const Applied a = apply_words({"--hold-out", value}, false);
    EXPECT_EQ(a.error, "");
    for (const Measurement& m : a.scenario.data.sensors[0].measurements) marks.push_back(m.held_out);
    return marks;
  };
  EXPECT_THAT(held_out("2"), testing::ElementsAre(false, true, false, true, false));
  EXPECT_THAT(held_out("usbl=3"), testing::ElementsAre(false, false, true, false, false));
  EXPECT_THAT(held_out("camera=2"), testing::Each(false));
}

TEST(SensorOptions, RejectsInvalidValues) {
  const auto error = [](const std::string& option, const std::string& value, bool own = false, bool target = true) {
    return apply_words({option, value}, own, target).error;
  };
  EXPECT_EQ(error("--noise", "usbl"), "tandem: --noise takes KEY=VALUE, not 'usbl'\n");
  EXPECT_EQ(error("--noise", "usbl=1,x,3"), "tandem: --noise usbl: 'x' is not a number\n");
  EXPECT_EQ(error("--noise", "usbl=1,2"), "tandem: --noise usbl needs 3 standard deviations, not 2\n");
  EXPECT_EQ(error("--noise", "usbl=1,2,0"),
            "tandem: --noise usbl has the standard deviation 0; it must be above zero and finite\n");
  EXPECT_EQ(error("--noise", "usbl=1,2,nan"),
            "tandem: --noise usbl has the standard deviation nan; it must be above zero and finite\n");
  EXPECT_THAT(error("--noise", "odometri=1"),
              StartsWith("tandem: --noise: unknown noise 'odometri'; did you mean odometry? (available: "));
  EXPECT_THAT(error("--noise", "optical=1,1,1,1,1,1"), StartsWith("tandem: --noise: unknown noise 'optical'"))
      << "the data have no such sensor";
  EXPECT_THAT(error("--noise", "dvl=1,1,1"), StartsWith("tandem: --noise: unknown noise 'dvl'")) << "not in use";
  EXPECT_THAT(error("--noise", "usbl=1,1,1", true, false), StartsWith("tandem: --noise: unknown noise 'usbl'"));
  EXPECT_THAT(error("--loss", "usbl.orientation=huber"), HasSubstr("usbl measures no orientation"));
  EXPECT_THAT(error("--loss", "imu=huber", true), HasSubstr("--without imu"));
  EXPECT_THAT(error("--loss", "dlv=huber", true),
              HasSubstr("did you mean dvl? (available: usbl, camera, imu, dvl and gps)"));
  EXPECT_THAT(error("--loss", "orientation=huber", true, false), HasSubstr("--loss: unknown sensor 'orientation'"));
  EXPECT_THAT(error("--delay", "imu=soon", true), HasSubstr("--delay"));
  EXPECT_THAT(error("--delay", "gps=-1", true), HasSubstr("--delay gps takes a non-negative number"));
  EXPECT_THAT(error("--delay", "usbl=-1", true), HasSubstr("only an imu may have a negative delay"));
  EXPECT_THAT(error("--without", "camra"), HasSubstr("--without: unknown sensor 'camra'; did you mean camera?"));
  EXPECT_THAT(error("--hold-out", "1"), HasSubstr("--hold-out takes 2 or more"));
  EXPECT_THAT(error("--hold-out", "camra=2"), HasSubstr("did you mean camera?"));
}

}  // namespace
}  // namespace tandem
