#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/scenario/scenario.hpp>

#include "studies/scratch.hpp"

/// Entries of target sensors in `sensors:`, and their files.
namespace tandem {
namespace {

using testing::EndsWith;
using testing::HasSubstr;

class ScenarioSensors : public testing::Test {
 protected:
  ScenarioSensors() { write_small_scenario(folder_); }

  /// Makes the small scenario planar.
  void make_planar() {
    folder_.write("scenario.yaml",
                  "name: small\ngroup: SE2\nkeyframe_interval: 1.0\nnoise:\n  prior: [0.001, 0.001, 0.001]\n"
                  "  odometry: [0.01, 0.01, 0.001]\n  constant_twist: [0.1, 0.1, 0.02]\n"
                  "  constant_velocity: [0.1, 0.1]\n  usbl: [1.0, 1.0]\n\n");
    folder_.write("usbl.csv", "t,x,y\n1,5,0\n");
    std::filesystem::remove(folder_.path() / "optical.csv");
  }
  /// Adds a sensor "sonar" with the text of its entry, which is line 12, and of its file.
  void add(const std::string& entry, const std::string& rows) {
    if (base_.empty()) base_ = read_file(folder_.path() / "scenario.yaml");
    folder_.write("scenario.yaml", base_ + "sensors:\n  sonar: {file: sonar.csv, " + entry + "}\n");
    folder_.write("sonar.csv", rows);
  }
  TargetSensor sonar() { return read_scenario(folder_.path()).data.sensors.front(); }
  std::string error(const std::string& entry, const std::string& rows) {
    add(entry, rows);
    return error_of([&] { read_scenario(folder_.path()); });
  }
  void expect_error_at(const std::string& place, const std::string& entry, const std::string& rows,
                       const std::string& reason) {
    const std::string message = error(entry, rows);
    EXPECT_THAT(message, HasSubstr(place));
    EXPECT_THAT(message, HasSubstr(reason));
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }

  ScratchFolder folder_;
  std::string base_;
};

TEST_F(ScenarioSensors, ReadsRangeBearing) {
  add("type: range_bearing, sigma: [0.1, 0.02, 0.03]", "t,range,azimuth,elevation\n1,5,0.2,-0.1\n2,6,-6.2,1.5\n");
  const TargetSensor sensor = sonar();
  EXPECT_EQ(sensor.name, "sonar");
  EXPECT_EQ(sensor.type, SensorType::range_bearing);
  EXPECT_EQ(sensor.sigma, Vector<3>(0.1, 0.02, 0.03));
  ASSERT_EQ(sensor.measurements.size(), 2u);
  EXPECT_EQ(sensor.measurements[0].t, 1.0);
  EXPECT_EQ(sensor.measurements[0].range, 5.0);
  EXPECT_EQ(sensor.measurements[0].azimuth, 0.2);
  EXPECT_EQ(sensor.measurements[0].elevation, -0.1);
  EXPECT_FALSE(sensor.measurements[0].held_out);
  EXPECT_EQ(sensor.delay, 0.0);
  EXPECT_FALSE(sensor.loss || sensor.orientation_loss);
}

TEST_F(ScenarioSensors, ReadsBearingRangeAndSphericalUsbl) {
  add("type: bearing, sigma: [0.02, 0.03]", "t,azimuth,elevation\n1,0.2,-0.1\n");
  EXPECT_EQ(sonar().measurements[0].azimuth, 0.2);
  EXPECT_EQ(sonar().measurements[0].elevation, -0.1);
  add("type: range, sigma: 0.2", "t,range\n1,5\n");
  EXPECT_EQ(sonar().measurements[0].range, 5.0);
  EXPECT_EQ(sonar().sigma.size(), 1);
  add("type: usbl_spherical, sigma: [0.1, 0.02, 0.03]", "t,range,azimuth,elevation\n1,5,0.2,-1.57\n");
  EXPECT_EQ(sonar().type, SensorType::usbl_spherical);
  EXPECT_EQ(sonar().measurements[0].elevation, -1.57);
}

TEST_F(ScenarioSensors, ReadsPositionAndPose) {
  add("type: position, sigma: [1, 2, 3]", "t,x,y,z\n1,5,6,7\n");
  EXPECT_EQ(sonar().measurements[0].position, Vector<3>(5, 6, 7));
  add("type: pose, sigma: [1, 2, 3, 4, 5, 6]", "t,x,y,z,qx,qy,qz,qw\n1,5,6,7,0,0,1,0\n");
  EXPECT_EQ(sonar().measurements[0].position, Vector<3>(5, 6, 7));
  EXPECT_EQ(sonar().measurements[0].rotation.quaternion().z(), 1.0);
}

TEST_F(ScenarioSensors, ReadsPlanarSensors) {
  make_planar();
  add("type: range_bearing, sigma: [0.1, 0.02]", "t,range,bearing\n1,5,0.2\n");
  EXPECT_EQ(sonar().measurements[0].range, 5.0);
  EXPECT_EQ(sonar().measurements[0].azimuth, 0.2);
  EXPECT_EQ(sonar().measurements[0].elevation, 0.0);
  add("type: bearing, sigma: 0.02", "t,bearing\n1,0.2\n");
  EXPECT_EQ(sonar().measurements[0].azimuth, 0.2);
  add("type: range, sigma: 0.02", "t,range\n1,5\n");
  EXPECT_EQ(sonar().measurements[0].range, 5.0);
  add("type: position, sigma: [1, 2]", "t,x,y\n1,5,6\n");
  EXPECT_EQ(sonar().measurements[0].position, Vector<3>(5, 6, 0));
  add("type: pose, sigma: [1, 2, 3]", "t,x,y,yaw\n1,5,6,0.3\n");
  EXPECT_EQ(sonar().measurements[0].position, Vector<3>(5, 6, 0));
  EXPECT_LE((sonar().measurements[0].rotation.Log() - Vector<3>(0, 0, 0.3)).norm(), 1e-15);
}

TEST_F(ScenarioSensors, ProjectsOdometryOntoPlane) {
  make_planar();
  folder_.write("chaser_odometry.tum", "0 0 0 7 0 0 0 1\n5 5 0 7 0.0998334166468282 0 0 0.9950041652780258\n");
  add("type: range, sigma: 0.02", "t,range\n1,5\n");
  for (const auto& [t, pose] : read_scenario(folder_.path()).data.odometry) {
    EXPECT_EQ(pose.translation().z(), 0.0);
    EXPECT_EQ(pose.rotation().matrix()(2, 2), 1.0);
  }
}

TEST_F(ScenarioSensors, ReadsDelayExtrinsicsAndLosses) {
  add("type: pose, sigma: [1, 2, 3, 4, 5, 6], delay: 0.3, loss: 'cauchy:2', orientation_loss: tukey,\n"
      "          position: [1, 2, 3], orientation: [0, 0, 1, 0], target_position: [4, 5, 6],\n"
      "          target_orientation: [1, 0, 0, 0]",
      "t,x,y,z,qx,qy,qz,qw\n1,5,6,7,0,0,1,0\n");
  const TargetSensor sensor = sonar();
  EXPECT_EQ(sensor.delay, 0.3);
  EXPECT_DOUBLE_EQ(sensor.valid_at(sensor.measurements[0]), 0.7);
  EXPECT_EQ(sensor.loss->kind, Loss::Kind::cauchy);
  EXPECT_EQ(sensor.loss->scale, 2.0);
  EXPECT_EQ(sensor.orientation_loss->kind, Loss::Kind::tukey);
  EXPECT_EQ(sensor.mount.translation(), Vector<3>(1, 2, 3));
  EXPECT_EQ(sensor.mount.rotation().quaternion().z(), 1.0);
  EXPECT_EQ(sensor.marker.translation(), Vector<3>(4, 5, 6));
  EXPECT_EQ(sensor.marker.rotation().quaternion().x(), 1.0);
}

TEST_F(ScenarioSensors, ReadsSystematicErrors) {
  const std::string rows = "t,range,azimuth,elevation\n1,5,0,0\n";
  add("type: range_bearing, sigma: [1, 2, 3], error: {sigma: [0.1, 0.2, 0.3], time: 20}", rows);
  EXPECT_EQ(sonar().error->bias_sigma, Vector<3>(0.1, 0.2, 0.3));
  EXPECT_EQ(sonar().error->correlation_time, 20);
  add("type: range_bearing, sigma: [1, 2, 3], error: {sigma: [0.1, 0.2, 0.3]}", rows);
  EXPECT_EQ(sonar().error->correlation_time, HUGE_VAL) << "constant";
  add("type: range_bearing, sigma: [1, 2, 3], error: {scale: 0.01, misalignment: 0.02, delay: 0.3}", rows);
  EXPECT_FALSE(sonar().error->has_bias());
  EXPECT_EQ(sonar().error->scale_sigma, 0.01);
  EXPECT_EQ(sonar().error->misalignment_sigma, 0.02);
  EXPECT_EQ(sonar().error->delay_sigma, 0.3);
  for (const auto& [error, why] : {std::pair{"{sigma: [0.1]}", "needs 3 standard deviations"},
                                   {"{sigma: [0.1, 0.2, 0.3], time: 0}", "time must be above zero"},
                                   {"{sigma: [0.1, 0.2, 0.3], tau: 3}", "tau"},
                                   {"{scale: -1}", "above zero"},
                                   {"{scale: 0.1, time: 20}", "time is the correlation time of a bias"},
                                   {"{}", "error is empty"}}) {
    add(std::string("type: range_bearing, sigma: [1, 2, 3], error: ") + error, rows);
    EXPECT_THAT([&] { sonar(); }, testing::ThrowsMessage<Error>(HasSubstr(why)));
  }
}

TEST_F(ScenarioSensors, BearingTimesMayRepeatButPositionTimesMayNot) {
  add("type: bearing, sigma: [0.02, 0.03]", "t,azimuth,elevation\n1,0.2,-0.1\n1,0.3,-0.1\n");
  EXPECT_EQ(sonar().measurements.size(), 2u);
  expect_error_at("sonar.csv:3: ", "type: position, sigma: [1, 1, 1]", "t,x,y,z\n1,5,6,7\n1,5,6,8\n",
                  "time 1 repeats that of line 2");
}

constexpr const char* kRangeBearing = "type: range_bearing, sigma: [0.1, 0.02, 0.03]";
constexpr const char* kSpherical = "type: usbl_spherical, sigma: [0.1, 0.02, 0.03]";
const std::string kDirections = "t,range,azimuth,elevation\n1,5,0,0\n";

TEST_F(ScenarioSensors, RejectsAnglesOutOfRange) {
  for (const char* pole : {"1.5707963267948966", "-1.5707963267948966", "1.5707962"})
    expect_error_at("sonar.csv:3: ", kSpherical, kDirections + "2,5,0.1," + pole + "\n",
                    "is vertical, where the azimuth is undefined");
  for (const char* entry : {kSpherical, kRangeBearing})
    expect_error_at("sonar.csv:3: ", entry, kDirections + "2,5,0.1,-1.6\n", "is outside [-pi/2, pi/2]");
  expect_error_at("sonar.csv:3: ", kRangeBearing, kDirections + "2,5,6.3,0\n", "radians");
  expect_error_at("sonar.csv:3: ", kRangeBearing, kDirections + "2,5,0.1,45\n", "radians");
  expect_error_at("sonar.csv:2: ", "type: bearing, sigma: [0.1, 0.1]", "t,azimuth,elevation\n2,-170,0\n",
                  "azimuth -170");
  make_planar();
  base_.clear();
  expect_error_at("sonar.csv:2: ", "type: bearing, sigma: 0.1", "t,bearing\n2,-170\n", "bearing -170");
}

TEST_F(ScenarioSensors, AcceptsVerticalDirection) {
  add(kRangeBearing, "t,range,azimuth,elevation\n1,5,0,1.5707963267948966\n");
  EXPECT_EQ(sonar().measurements.size(), 1u);
}

TEST_F(ScenarioSensors, DiscardsRowsWithoutAValue) {
  add("type: range, sigma: 1, missing: [-1, 77]",
      "t,range\n1,20\n1.1,0\n1.2,nan\n1.3,\n1.4,-1\n1.5,77\n1.6,9999\n1.7,-32768\n1.8,21\n");
  const Scenario scenario = read_scenario(folder_.path());
  ASSERT_EQ(scenario.findings.size(), 1u);
  EXPECT_EQ(scenario.findings[0].count, 7u);
  EXPECT_EQ(sonar().measurements.size(), 2u);
}

TEST_F(ScenarioSensors, RejectsRangesThatAreNotPositive) {
  for (const char* range : {"-0.5", "-2"}) {
    expect_error_at("sonar.csv:2: ", "type: range, sigma: 1", std::string("t,range\n1,") + range + "\n",
                    std::string("range ") + range + " m; a range must be above zero");
    expect_error_at("sonar.csv:2: ", kSpherical, std::string("t,range,azimuth,elevation\n1,") + range + ",0,0\n",
                    "above zero");
  }
}

TEST_F(ScenarioSensors, RejectsInvalidEntries) {
  const std::string ranges = "t,range\n1,5\n";
  const auto expect_rejected = [&](const std::string& entry, const std::string& reason) {
    expect_error_at("scenario.yaml:12: ", entry, ranges, reason);
  };
  expect_rejected("type: rang, sigma: 1", "unknown sensor type 'rang'; did you mean range?");
  expect_rejected("type: headin, sigma: 1", "unknown sensor type 'headin'; did you mean heading?");
  expect_rejected("sigma: 1", "sensor sonar lacks the key type");
  expect_rejected("type: range", "sensor sonar lacks the key sigma");
  expect_rejected("type: range, sigma: [1, 2]", "sigma needs 1 standard deviation, not 2");
  expect_rejected("type: range, sigma: 0", "sigma has the standard deviation 0");
  expect_rejected("type: range, sigma: 1, delay: -0.1", "delay -0.1 s is negative");
  expect_rejected("type: range, sigma: 1, delay: late", "delay is 'late', not a finite number");
  expect_rejected("type: range, sigma: 1, dealy: 0.1", "unknown key 'dealy' in sensor sonar; did you mean delay?");
  expect_rejected("type: range, sigma: 1, loss: caucy", "'caucy'; did you mean cauchy?");
  expect_rejected("type: range, sigma: 1, loss: 'cauchy:0'", "the scale must be positive and finite, not 0");
  expect_rejected("type: range, sigma: 1, orientation_loss: cauchy", "unknown key 'orientation_loss'");
  expect_error_at("sonar.csv:1: ", "type: range, sigma: 1", "t,r\n1,5\n", "must be the header t,range, not 't,r'");
}

TEST_F(ScenarioSensors, RejectsIncompleteExtrinsics) {
  const std::string ranges = "t,range\n1,5\n";
  for (const char* key : {"position", "target_position"}) {
    const std::string k = key;
    for (const char* nothing : {" ", " ~", " null"})
      expect_error_at("scenario.yaml:12: ", "type: range, sigma: 1, " + k + ":" + nothing, ranges,
                      k + " needs 3 numbers, but is empty");
    expect_error_at("scenario.yaml:12: ", "type: range, sigma: 1, " + k + ": []", ranges,
                    k + " needs 3 numbers, not 0");
    expect_error_at("scenario.yaml:12: ", "type: range, sigma: 1, " + k + ": [1, 2]", ranges,
                    k + " needs 3 numbers, not 2");
    expect_error_at("scenario.yaml:12: ", "type: range, sigma: 1, " + k + ": [1, 2, ~]", ranges, k);
  }
  expect_error_at("scenario.yaml:12: ", "type: range, sigma: 1, orientation: ", ranges,
                  "orientation needs 4 numbers, but is empty");
  expect_error_at("scenario.yaml:12: ", "type: range, sigma: 1, orientation: [0, 0, 0, 0.5]", ranges, "quaternion");
}

TEST_F(ScenarioSensors, RejectsPlanarSphericalUsbl) {
  make_planar();
  expect_error_at("scenario.yaml:12: ", kSpherical, kDirections,
                  "usbl_spherical is not supported with group SE2; use range_bearing");
}

TEST_F(ScenarioSensors, PlanarFilesNeedPlanarColumns) {
  make_planar();
  expect_error_at("sonar.csv:1: ", "type: range_bearing, sigma: [0.1, 0.1]", kDirections,
                  "must be the header t,range,bearing, not 't,range,azimuth,elevation'");
  expect_error_at("scenario.yaml:12: ", "type: range_bearing, sigma: [0.1, 0.1, 0.1]", kDirections,
                  "sigma needs 2 standard deviations, not 3");
}

TEST_F(ScenarioSensors, TrajectoryMayRepeatPoseButNotContradictIt) {
  const std::string three = "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n5 5 0 0 0 0 0 1\n";
  folder_.write("chaser_odometry.tum", three);
  folder_.write("truth_target.tum", three);
  EXPECT_EQ(read_scenario(folder_.path()).data.odometry.size(), 3u);
  EXPECT_EQ(read_scenario(folder_.path()).truth_target.size(), 3u);
  folder_.write("chaser_odometry.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n1 1.1 0 0 0 0 0 1\n5 5 0 0 0 0 0 1\n");
  EXPECT_THAT(error_of([&] { read_scenario(folder_.path()); }),
              EndsWith("chaser_odometry.tum:3: time 1 repeats that of line 2 with another pose"));
}

}  // namespace
}  // namespace tandem
