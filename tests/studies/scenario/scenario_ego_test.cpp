#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/navigation/navigation_checks.hpp>
#include <tandem/studies/scenario/scenario.hpp>

#include "shared_data.hpp"
#include "studies/scratch.hpp"

/// Entries of the chaser's own sensors in `sensors:`, and their files.
namespace tandem {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;

constexpr const char* kImu =
    "type: imu, file: imu.csv, accelerometer: 1.0e-3, gyroscope: 1.0e-4, accelerometer_bias_walk: 1.0e-5, "
    "gyroscope_bias_walk: 1.0e-6";
const std::string kSamples = "t,fx,fy,fz,wx,wy,wz\n0,0.1,0.2,9.8,0.01,0.02,0.03\n0.01,0.3,0.4,9.9,0.04,0.05,0.06\n";

class ScenarioEgo : public testing::Test {
 protected:
  /// Writes a scenario with own sensors only. `head` is line 1, the first entry is line 3.
  void write(const std::vector<std::pair<std::string, std::string>>& entries, const std::string& head = "name: dive") {
    std::string yaml = head + "\nsensors:\n";
    for (const auto& [name, entry] : entries) yaml += "  " + name + ": {" + entry + "}\n";
    folder_.write("scenario.yaml", yaml);
  }
  NavigationData read() { return read_scenario(folder_.path()).navigation.value(); }
  /// Reads a scenario with one sensor called "own".
  NavigationData read(const std::string& entry, const std::string& rows, const std::string& head = "name: dive") {
    write({{"own", entry}}, head);
    folder_.write("imu.csv", rows);
    folder_.write("own.csv", rows);
    return read();
  }
  std::string error(const std::string& entry, const std::string& rows, const std::string& head = "name: dive") {
    return error_of([&] { read(entry, rows, head); });
  }

  ScratchFolder folder_;
};

TEST_F(ScenarioEgo, ReadsImu) {
  const NavigationData data = read(std::string(kImu) + ", position: [1, 2, 3], orientation: [0, 0, 1, 0]", kSamples);
  ASSERT_TRUE(data.imu);
  const ImuSensor& imu = *data.imu;
  EXPECT_EQ(imu.name, "own");
  EXPECT_EQ(imu.noise.accelerometer, 1e-3);
  EXPECT_EQ(imu.noise.gyroscope, 1e-4);
  EXPECT_EQ(imu.noise.accelerometer_bias_walk, 1e-5);
  EXPECT_EQ(imu.noise.gyroscope_bias_walk, 1e-6);
  EXPECT_EQ(imu.noise.integration, 0.0);
  EXPECT_EQ(imu.initial_accelerometer_bias, ImuSensor().initial_accelerometer_bias);
  EXPECT_EQ(imu.mount.translation(), Vector<3>(1, 2, 3));
  EXPECT_EQ(imu.mount.rotation().quaternion().z(), 1.0);
  ASSERT_EQ(imu.samples.size(), 2u);
  EXPECT_EQ(imu.samples[1].t, 0.01);
  EXPECT_EQ(imu.samples[1].specific_force, Vector<3>(0.3, 0.4, 9.9));
  EXPECT_EQ(imu.samples[1].angular_rate, Vector<3>(0.04, 0.05, 0.06));
  EXPECT_TRUE(data.sensors.empty());
}

TEST_F(ScenarioEgo, ReadsAllKeysOfImu) {
  const ImuSensor imu = *read(std::string(kImu) +
                                  ", integration: 0.1, initial_accelerometer_bias: 0.2, initial_gyroscope_bias: 0.3, "
                                  "max_gap: 0.4, max_specific_force: 50, max_angular_rate: 6, delay: -0.005",
                              kSamples)
                             .imu;
  EXPECT_EQ(imu.noise.integration, 0.1);
  EXPECT_EQ(imu.initial_accelerometer_bias, 0.2);
  EXPECT_EQ(imu.initial_gyroscope_bias, 0.3);
  EXPECT_EQ(imu.max_gap, 0.4);
  EXPECT_EQ(imu.max_specific_force, 50.0);
  EXPECT_EQ(imu.max_angular_rate, 6.0);
  EXPECT_EQ(imu.delay, -0.005);
  EXPECT_EQ(imu.samples[1].t, 0.01 + 0.005);
}

TEST_F(ScenarioEgo, ReadsOtherSensors) {
  folder_.write("a.csv", "t,vx,vy,vz\n1,2,3,4\n");
  folder_.write("b.csv", "t,z\n1,-5\n2,-6\n");
  folder_.write("c.csv", "t,x,y,z\n1,2,3,4\n");
  folder_.write("d.csv", "t,qx,qy,qz,qw\n1,0,0,1,0\n");
  write({{"log", "type: dvl, file: a.csv, sigma: [1, 2, 3], delay: 0.2, loss: 'cauchy:2'"},
         {"pressure", "type: depth, file: b.csv, sigma: 0.5, position: [1, 2, 3]"},
         {"gnss", "type: gps, file: c.csv, sigma: [1, 2, 3], position: [4, 5, 6]"},
         {"compass", "type: heading, file: d.csv, sigma: [1, 2, 3], orientation: [1, 0, 0, 0]"}},
        "keyframe_interval: 0.5");
  const NavigationData data = read();
  EXPECT_FALSE(data.imu);
  EXPECT_EQ(data.keyframe_interval, 0.5);
  ASSERT_EQ(data.sensors.size(), 4u);
  const EgoSensor &dvl = data.sensors[0], &depth = data.sensors[1], &gps = data.sensors[2], &heading = data.sensors[3];
  EXPECT_EQ(dvl.name, "log");
  EXPECT_EQ(dvl.type, EgoSensorType::dvl);
  EXPECT_EQ(dvl.sigma, Vector<3>(1, 2, 3));
  EXPECT_EQ(dvl.delay, 0.2);
  EXPECT_EQ(dvl.loss->scale, 2.0);
  EXPECT_EQ(dvl.measurements[0].value, Vector<3>(2, 3, 4));
  EXPECT_EQ(depth.type, EgoSensorType::depth);
  EXPECT_EQ(depth.sigma.size(), 1);
  EXPECT_EQ(depth.mount.translation(), Vector<3>(1, 2, 3));
  EXPECT_EQ(depth.measurements[1].t, 2.0);
  EXPECT_EQ(depth.measurements[1].value.z(), -6.0);
  EXPECT_FALSE(depth.loss);
  EXPECT_EQ(gps.type, EgoSensorType::gps);
  EXPECT_EQ(gps.mount.translation(), Vector<3>(4, 5, 6));
  EXPECT_EQ(gps.measurements[0].value, Vector<3>(2, 3, 4));
  EXPECT_EQ(heading.type, EgoSensorType::heading);
  EXPECT_EQ(heading.mount.rotation().quaternion().x(), 1.0);
  EXPECT_EQ(heading.measurements[0].rotation.quaternion().z(), 1.0);
}

TEST_F(ScenarioEgo, ConvertsNedFrd) {
  folder_.write("imu.csv", "t,fx,fy,fz,wx,wy,wz\n0,1,2,-9.8,0.1,0.2,0.3\n1,1,2,-9.8,0.1,0.2,0.3\n");
  folder_.write("a.csv", "t,vx,vy,vz\n1,2,3,4\n");
  folder_.write("b.csv", "t,z\n1,5\n");
  folder_.write("c.csv", "t,x,y,z\n1,2,3,4\n");
  folder_.write("d.csv", "t,qx,qy,qz,qw\n1,0,0,0,1\n");
  write({{"imu", std::string(kImu) + ", position: [1, 2, 3]"},
         {"dvl", "type: dvl, file: a.csv, sigma: [1, 2, 3]"},
         {"depth", "type: depth, file: b.csv, sigma: 0.5, position: [1, 2, 3]"},
         {"gps", "type: gps, file: c.csv, sigma: [1, 2, 3]"},
         {"heading", "type: heading, file: d.csv, sigma: [1, 2, 3]"}},
        "frame: NED-FRD");
  const NavigationData data = read();
  EXPECT_EQ(data.imu->mount.translation(), Vector<3>(1, -2, -3));
  EXPECT_EQ(data.imu->samples[0].specific_force, Vector<3>(1, -2, 9.8)) << "at rest it points up";
  EXPECT_EQ(data.imu->samples[0].angular_rate, Vector<3>(0.1, -0.2, -0.3));
  EXPECT_EQ(data.sensors[0].measurements[0].value, Vector<3>(2, -3, -4));
  EXPECT_EQ(data.sensors[0].sigma, Vector<3>(1, 2, 3)) << "forward, sideways, up";
  EXPECT_EQ(data.sensors[1].measurements[0].value.z(), -5.0);
  EXPECT_EQ(data.sensors[1].mount.translation(), Vector<3>(1, -2, -3));
  EXPECT_EQ(data.sensors[2].measurements[0].value, Vector<3>(3, 2, -4));
  EXPECT_EQ(data.sensors[2].sigma, Vector<3>(2, 1, 3)) << "east, north, up";
  EXPECT_LE((data.sensors[3].measurements[0].rotation.Log() - Vector<3>(0, 0, 0.5 * std::numbers::pi)).norm(), 1e-12)
      << "north is a quarter turn from east";
}

/// The conversion of a mounting orientation is consistent with that of the sensor's readings.
TEST_F(ScenarioEgo, ConvertsMountConsistently) {
  const SO3 mount(SO3::Quaternion(0.1, 0.5, -0.5, 0.7));
  const Vector<3> in_frd = mount.act(Vector<3>(1, 2, -9.8));
  const NavigationData data = read(std::string(kImu) + ", orientation: [0.5, -0.5, 0.7, 0.1]",
                                   "t,fx,fy,fz,wx,wy,wz\n0,1,2,-9.8,0,0,0\n1,1,2,-9.8,0,0,0\n", "frame: NED-FRD");
  const Vector<3> in_flu = data.imu->mount.rotation().act(data.imu->samples[0].specific_force);
  EXPECT_LE((in_flu - Vector<3>(in_frd.x(), -in_frd.y(), -in_frd.z())).norm(), 1e-12);
}

TEST_F(ScenarioEgo, ReadsGravityAndLatitude) {
  const auto earth = [&](const std::string& head) { return read(kImu, kSamples, head).earth; };
  EXPECT_EQ(earth("name: dive").gravity, Vector<3>(0, 0, -9.80665));
  EXPECT_EQ(earth("name: dive").rate, Vector<3>(0, 0, 0));
  EXPECT_EQ(earth("gravity: 9.81").gravity, Vector<3>(0, 0, -9.81));
  EXPECT_EQ(earth("gravity: 9.81").rate, Vector<3>(0, 0, 0));
  // Reference: NIMA TR8350.2, 9.7803253359 at the equator and 9.8321849378 at the poles. At 45°, GRS 80 gives
  // 9.806199203; its constants are 1.4e-6 larger.
  EXPECT_NEAR(earth("latitude: 0").gravity.z(), -9.7803253359, 1e-10);
  EXPECT_NEAR(earth("latitude: -90").gravity.z(), -9.8321849378, 1e-9);
  EXPECT_NEAR(earth("latitude: 45").gravity.z(), -9.80619777, 1e-8);
  const Earth north = earth("latitude: 30\ngravity: 9.8"), south = earth("latitude: -30");
  EXPECT_EQ(north.gravity, Vector<3>(0, 0, -9.8));
  EXPECT_LE((north.rate - Earth::kRate * Vector<3>(0, std::sqrt(0.75), 0.5)).norm(), 1e-18);
  EXPECT_LE((south.rate - Earth::kRate * Vector<3>(0, std::sqrt(0.75), -0.5)).norm(), 1e-18);
}

TEST_F(ScenarioEgo, RejectsInvalidGravityAndLatitude) {
  const auto rejection = [&](const std::string& head) { return error(kImu, kSamples, head); };
  EXPECT_THAT(rejection("latitude: 90.5"), EndsWith("scenario.yaml:1: latitude 90.5 is outside [-90, 90] degrees"));
  EXPECT_THAT(rejection("latitude: .nan"), HasSubstr("scenario.yaml:1: latitude is '.nan', not a finite number"));
  EXPECT_THAT(rejection("gravity: -9.81"), EndsWith("gravity -9.81 is negative; give its magnitude in m/s^2"));
  for (const char* value : {"1", "0", "9.69", "9.91", "9806.65"})
    EXPECT_THAT(rejection(std::string("gravity: ") + value),
                EndsWith(std::string("gravity ") + value + " m/s^2 is outside [9.7, 9.9] m/s^2, the range on Earth"));
}

TEST_F(ScenarioEgo, AcceptsTimesInAnyOrder) {
  const std::string rows = "t,z\n3,-5\n1,-6\n1,-7\n";
  const NavigationData data = read("type: depth, file: own.csv, sigma: 0.5", rows);
  std::vector<double> times;
  for (const EgoMeasurement& m : data.sensors[0].measurements) times.push_back(m.t);
  EXPECT_THAT(times, ElementsAre(3, 1, 1));
}

TEST_F(ScenarioEgo, RejectsInvalidEntries) {
  const auto rejection = [&](const std::string& entry) {
    const std::string message = error(entry, "t,z\n1,2\n");
    EXPECT_THAT(message, HasSubstr("scenario.yaml:3: "));
    EXPECT_EQ(message.find('\n'), std::string::npos);
    return message;
  };
  EXPECT_THAT(rejection("type: dept, file: own.csv"), HasSubstr("unknown sensor type 'dept'; did you mean depth?"));
  EXPECT_THAT(rejection("type: dvl, file: own.csv, sigma: [1, 1, 1], position: [0, 0, 1]"),
              HasSubstr("a dvl has no position, since its frame is the body frame"));
  EXPECT_THAT(rejection("type: dvl, file: own.csv, sigma: [1, 1, 1], orientation: [0, 0, 0, 1]"),
              HasSubstr("a dvl has no orientation"));
  EXPECT_THAT(rejection("type: dvl, file: own.csv, sigma: 1"), HasSubstr("sigma needs 3 standard deviations, not 1"));
  EXPECT_THAT(rejection("type: depth, file: own.csv, sigma: -1"), HasSubstr("sigma has the standard deviation -1"));
  EXPECT_THAT(rejection("type: depth, file: own.csv"), HasSubstr("sensor own lacks the key sigma"));
  EXPECT_THAT(rejection("type: depth, sigma: 1"), HasSubstr("sensor own lacks the key file"));
  EXPECT_THAT(rejection("type: depth, file: own.csv, sigma: 1, dealy: 1"),
              HasSubstr("unknown key 'dealy' in sensor own"));
  EXPECT_THAT(rejection("type: depth, file: own.csv, sigma: 1, delay: -1"),
              HasSubstr("delay -1 s is negative; only an imu may have a negative delay"));
  EXPECT_THAT(rejection("type: depth, file: own.csv, sigma: 1, loss: caucy"), HasSubstr("did you mean cauchy?"));
  EXPECT_THAT(rejection("type: depth, file: own.csv, sigma: 1, orientation: [0, 0, 0, 1]"), HasSubstr("'orientation'"));
  EXPECT_THAT(rejection("type: heading, file: own.csv, sigma: [1, 1, 1], position: [0, 0, 1]"),
              HasSubstr("'position'"));
  EXPECT_THAT(rejection("type: gps, file: own.csv, sigma: [1, 1, 1], position: [0, 1]"),
              HasSubstr("position needs 3 numbers, not 2"));
  EXPECT_THAT(rejection("type: heading, file: own.csv, sigma: [1, 1, 1], orientation: [0, 0, 0, 2]"),
              HasSubstr("quaternion 0 0 0 2 has norm 2"));
}

TEST_F(ScenarioEgo, RejectsInvalidImuEntries) {
  const auto rejection = [&](std::string entry, const std::string& key, const std::string& with) {
    const std::size_t at = entry.find(key);
    entry.replace(at, entry.find(',', at) - at, with);
    return error(entry, kSamples);
  };
  const std::string imu = kImu;
  for (const std::string key : {"accelerometer", "gyroscope", "accelerometer_bias_walk", "gyroscope_bias_walk"}) {
    EXPECT_THAT(rejection(imu, key + ":", "max_gap: 1"), HasSubstr("scenario.yaml:3: sensor own lacks the key " + key));
    for (const std::string value : {"0", "-1"})
      EXPECT_THAT(rejection(imu, key + ":", key + ": " + value),
                  EndsWith("scenario.yaml:3: " + key + " is " + value + "; it must be above zero"));
  }
  for (const std::string key : {"initial_accelerometer_bias", "initial_gyroscope_bias", "max_gap", "max_specific_force",
                                "max_angular_rate", "integration"})
    EXPECT_THAT(error(imu + ", " + key + ": -1", kSamples),
                EndsWith("scenario.yaml:3: " + key + " is -1; it must be above zero"));
  EXPECT_THAT(error(imu + ", sigma: 1", kSamples), HasSubstr("unknown key 'sigma' in sensor own"));
  EXPECT_THAT(error(imu + ", max_gep: 1", kSamples), HasSubstr("did you mean max_gap?"));
}

TEST_F(ScenarioEgo, RejectsInvalidFiles) {
  EXPECT_THAT(error(kImu, "t,fx,fy,fz,wx,wy,wz\n0,0,0,9.8,0,0,0\n"),
              EndsWith("imu.csv must have at least two samples"));
  EXPECT_THAT(error(kImu, "t,wx,wy,wz,fx,fy,fz\n0,0,0,0,0,0,9.8\n"),
              HasSubstr("imu.csv:1: the first line must be the header t,fx,fy,fz,wx,wy,wz, not"));
  EXPECT_THAT(error(kImu, kSamples + "0.02,0,0,inf,0,0,0\n"), EndsWith("imu.csv:4: fz is inf; numbers must be finite"));
  EXPECT_THAT(error(kImu, kSamples + "0.02,0,0,9.8,0,0\n"), HasSubstr("imu.csv:4: expected 7 columns"));
  EXPECT_THAT(error("type: heading, file: own.csv, sigma: [1, 1, 1]", "t,qx,qy,qz,qw\n1,0,0,0,1\n2,0,0,0,0.5\n"),
              HasSubstr("own.csv:3: quaternion 0 0 0 0.5 has norm 0.5"));
  EXPECT_THAT(error("type: depth, file: none.csv, sigma: 1", "t,z\n"), EndsWith("none.csv is missing"));
  EXPECT_THAT(error("type: depth, file: own.csv, sigma: 1", "t,z\n1,2,3\n"),
              HasSubstr("own.csv:2: expected 2 columns"));
}

TEST_F(ScenarioEgo, SupportsOneImuAndNoPlane) {
  folder_.write("imu.csv", kSamples);
  write({{"first", kImu}, {"second", kImu}});
  EXPECT_THAT(error_of([&] { read(); }),
              EndsWith("scenario.yaml:4: only one imu is supported; remove sensor first or second"));
  write({{"first", kImu}}, "group: SE2");
  EXPECT_THAT(error_of([&] { read(); }),
              EndsWith("scenario.yaml:3: sensor type imu is not supported with group SE2; use group SE3"));
}

TEST_F(ScenarioEgo, TargetSensorsNeedNoOdometry) {
  write_small_scenario(folder_);
  const std::string yaml = read_file(folder_.path() / "scenario.yaml");
  folder_.write("depth.csv", "t,z\n0,-5\n4.4,-5\n");
  folder_.write("scenario.yaml", yaml + "sensors:\n  depth: {type: depth, file: depth.csv, sigma: 1}\n");
  EXPECT_EQ(read_scenario(folder_.path()).data.odometry.size(), 6u) << "odometry is read if it exists";
  std::filesystem::remove(folder_.path() / "chaser_odometry.tum");
  EXPECT_THAT(error_of([&] { read_scenario(folder_.path()); }),
              EndsWith("usbl.csv:3: time 4.5 is outside the time span of the chaser's own sensors, 0 to 4.4 s"));
  folder_.write("depth.csv", "t,z\n0,-5\n4.5,-5\n");
  const Scenario scenario = read_scenario(folder_.path());
  EXPECT_TRUE(scenario.data.odometry.empty());
  EXPECT_EQ(scenario.data.sensors.size(), 2u);
  EXPECT_EQ(scenario.navigation->sensors.size(), 1u);
  EXPECT_EQ(scenario.truth_chaser.size(), 6u);
}

TEST_F(ScenarioEgo, RequiresNoiseOnlyForExistingSensors) {
  write_small_scenario(folder_);
  std::filesystem::remove(folder_.path() / "chaser_odometry.tum");
  folder_.write("depth.csv", "t,z\n0,-5\n5,-5\n");
  const std::string head = "sensors:\n  depth: {type: depth, file: depth.csv, sigma: 1}\n";
  const std::string measured = "  usbl: [1, 1, 1]\n  optical: [1, 1, 1, 1, 1, 1]\n";
  folder_.write("scenario.yaml", head);
  EXPECT_THAT(error_of([&] { read_scenario(folder_.path()); }), HasSubstr("the file lacks the key noise"));
  folder_.write("scenario.yaml", head + "noise:\n" + measured);
  EXPECT_THAT(error_of([&] { read_scenario(folder_.path()); }), HasSubstr("noise lacks the key constant_twist"));
  folder_.write("scenario.yaml", head + "noise:\n  constant_twist: [1, 1, 1, 1, 1, 1]\n" + measured);
  EXPECT_EQ(read_scenario(folder_.path()).data.noise.constant_twist[0], 1.0);
  for (const char* file : {"usbl.csv", "optical.csv"}) std::filesystem::remove(folder_.path() / file);
  folder_.write("scenario.yaml", head);
  EXPECT_TRUE(read_scenario(folder_.path()).navigation) << "no noise is needed without a target";
}

TEST(RecordedScenarios, ReadsRecordingsOfOwnSensors) {
  TANDEM_NEEDS_SHARED(12);
  const Scenario auv = read_scenario(shared_path("data/auv_akit_01"));
  EXPECT_EQ(auv.navigation->imu->samples.size(), 40000u);
  EXPECT_EQ(auv.navigation->imu->samples[0].specific_force, Vector<3>(-0.0495, 0.0754, 9.7542));
  EXPECT_EQ(auv.navigation->imu->mount.translation(), Vector<3>(0.07, -0.02, 0.20));
  EXPECT_EQ(auv.navigation->sensors.size(), 4u);
  EXPECT_EQ(auv.navigation->sensors[3].sigma, Vector<3>(1, 1, 10));
  EXPECT_NEAR(auv.navigation->earth.rate.z(), Earth::kRate * std::sin(32.85 * std::numbers::pi / 180), 1e-18);
  EXPECT_FALSE(auv.has_truth());
  EXPECT_EQ(auv.truth_chaser.size(), 399u);
  const Scenario rov = read_scenario(shared_path("data/rov_blueye_grid"));
  EXPECT_FALSE(rov.truth_orientation);
  EXPECT_EQ(rov.navigation->imu->initial_gyroscope_bias, 0.1);
  const Scenario mav = read_scenario(shared_path("data/mav_euroc_mh01"));
  EXPECT_EQ(mav.navigation->keyframe_interval, 0.5);
  EXPECT_EQ(mav.navigation->imu->samples[0].specific_force, Vector<3>(8.1476917, -0.37592158, -2.4026292));
}

TEST(RecordedScenarios, ChecksReportOnlyTrueFindings) {
  TANDEM_NEEDS_SHARED(5);
  for (const char* folder : {"auv_akit_01", "auv_akit_03", "rov_blueye_auto_square", "rov_blueye_grid"}) {
    NavigationData data = read_scenario(shared_path("data") / folder).navigation.value();
    const std::size_t samples = data.imu->samples.size();
    const auto findings = check(data);
    ASSERT_EQ(findings.size(), 1u) << folder;
    EXPECT_EQ(findings[0].kind, NavigationFinding::Kind::early) << "GPS fixes at the start only";
    EXPECT_EQ(findings[0].sensor, "gps");
    EXPECT_EQ(data.imu->samples.size(), samples);
  }
  NavigationData mav = read_scenario(shared_path("data/mav_euroc_mh01")).navigation.value();
  const std::size_t samples = mav.imu->samples.size();
  const auto findings = check(mav);
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings.back().kind, NavigationFinding::Kind::vibration);
  EXPECT_GE(mav.imu->samples.size() + 5, samples) << "the shock of the landing, 25 ms long";
}

TEST_F(ScenarioEgo, ReadsLongRecording) {
  std::string rows = "t,fx,fy,fz,wx,wy,wz\n";
  for (int i = 0; i < 120'000; ++i)
    rows +=
        std::to_string(0.01 * i) + ",-0.012345,0.023456,9.801234,0.001234," + std::to_string(1e-6 * i) + ",-0.0001\n";
  folder_.write("imu.csv", rows);
  write({{"imu", kImu}});
  EXPECT_EQ(read().imu->samples.size(), 120'000u);
}

}  // namespace
}  // namespace tandem
