#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/scenario/scenario.hpp>

#include "shared_data.hpp"
#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::EndsWith;
using testing::HasSubstr;

class ScenarioTest : public testing::Test {
 protected:
  ScenarioTest() { write_small_scenario(folder_); }

  std::string error() {
    return error_of([&] { read_scenario(folder_.path()); });
  }
  /// Replaces text in scenario.yaml.
  void edit(const std::string& from, const std::string& to) {
    std::string text = read_file(folder_.path() / "scenario.yaml");
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    folder_.write("scenario.yaml", text.replace(at, from.size(), to));
  }
  void append(const std::string& text) {
    folder_.write("scenario.yaml", read_file(folder_.path() / "scenario.yaml") + text);
  }
  void remove(const std::string& file) { std::filesystem::remove(folder_.path() / file); }

  ScratchFolder folder_;
};

TEST_F(ScenarioTest, ReadsFolder) {
  const Scenario scenario = read_scenario(folder_.path());
  EXPECT_EQ(scenario.name, "small");
  EXPECT_EQ(scenario.description, "A straight line");
  EXPECT_EQ(scenario.source, "by hand");
  EXPECT_EQ(scenario.data.odometry.size(), 6u);
  ASSERT_EQ(scenario.data.sensors.size(), 2u);
  EXPECT_EQ(scenario.data.sensors[0].name, "usbl");
  EXPECT_EQ(scenario.data.sensors[0].type, SensorType::position);
  EXPECT_EQ(scenario.data.sensors[0].sigma, Vector<3>::Ones());
  EXPECT_EQ(scenario.data.sensors[0].measurements[1].t, 4.5);
  EXPECT_EQ(scenario.data.sensors[1].type, SensorType::pose);
  EXPECT_EQ(scenario.data.sensors[1].sigma[5], 0.04);
  EXPECT_EQ(scenario.data.noise.odometry[0], 0.01);
  EXPECT_EQ(scenario.data.noise.roll_pitch, Vector<2>(0.04, 0.04)) << "the default";
  EXPECT_TRUE(scenario.has_truth());
  EXPECT_TRUE(scenario.truth_orientation);
}

TEST_F(ScenarioTest, TruthAndUsblAreOptional) {
  for (const char* file : {"truth_chaser.tum", "truth_target.tum", "usbl.csv"}) remove(file);
  edit("name: small\n", "");
  const Scenario scenario = read_scenario(folder_.path() / "");
  EXPECT_FALSE(scenario.has_truth());
  ASSERT_EQ(scenario.data.sensors.size(), 1u);
  EXPECT_EQ(scenario.data.sensors[0].name, "optical");
  EXPECT_EQ(scenario.name, folder_.path().filename().string());
}

TEST_F(ScenarioTest, ReadsDeclaredSensors) {
  folder_.write("sonar.csv", "t,x,y,z\n1,5,0,0\n");
  append(
      "sensors:\n"
      "  sonar: {type: position, file: sonar.csv, sigma: [1, 2, 3], position: [0.1, 0.2, 0.3],\n"
      "          orientation: [0, 0, 1, 0], target_position: [1, 0, 0]}\n"
      "  camera: {type: pose, file: optical.csv, sigma: [1, 2, 3, 4, 5, 6], target_orientation: [1, 0, 0, "
      "0]}\n");
  const Scenario scenario = read_scenario(folder_.path());
  ASSERT_EQ(scenario.data.sensors.size(), 3u) << "optical.csv is read once, as declared";
  const TargetSensor& sonar = scenario.data.sensors[0];
  EXPECT_EQ(sonar.name, "sonar");
  EXPECT_EQ(sonar.sigma, Vector<3>(1, 2, 3));
  EXPECT_EQ(sonar.mount.translation(), Vector<3>(0.1, 0.2, 0.3));
  EXPECT_EQ(sonar.mount.rotation().quaternion().z(), 1.0);
  EXPECT_EQ(sonar.marker.translation(), Vector<3>(1, 0, 0));
  EXPECT_EQ(scenario.data.sensors[1].name, "camera");
  EXPECT_EQ(scenario.data.sensors[1].marker.rotation().quaternion().x(), 1.0);
}

TEST_F(ScenarioTest, AcceptsKeysOfOtherModes) {
  edit("noise:\n", "noise:\n  constant_velocity: [1, 1, 1]\n  boundary: [1, 1, 1]\n  surge: [0.5]\n  yaw_rate: 0.2\n");
  append("gravity: 9.8\nlatitude: 32.85\nlicence: none\nframe: ENU-FLU\ngroup: SE3\n");
  const Scenario scenario = read_scenario(folder_.path());
  EXPECT_EQ(scenario.data.noise.surge, 0.5);
  EXPECT_EQ(scenario.data.noise.yaw_rate, 0.2);
  edit("boundary: [1, 1, 1]", "boundary: [1, 1]");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:7: boundary needs 3 standard deviations, not 2"));
}

TEST_F(ScenarioTest, RejectsMissingFiles) {
  remove("chaser_odometry.tum");
  EXPECT_THAT(error(), EndsWith("chaser_odometry.tum is missing"));
  remove("scenario.yaml");
  EXPECT_THAT(error(), EndsWith("scenario.yaml is missing"));
}

TEST_F(ScenarioTest, RejectsMissingSensorFile) {
  append("sensors:\n  sonar: {type: position, file: sonar.csv, sigma: [1, 1, 1]}\n");
  EXPECT_THAT(error(), EndsWith("sonar.csv is missing"));
}

TEST_F(ScenarioTest, OdometryNeedsTwoPoses) {
  folder_.write("chaser_odometry.tum", "0 0 0 0 0 0 0 1\n");
  EXPECT_THAT(error(), EndsWith("chaser_odometry.tum must have at least two poses"));
}

TEST_F(ScenarioTest, RejectsMeasurementsOutsideOdometry) {
  folder_.write("usbl.csv", "t,x,y,z\n1,5,0,0\n5.2,5,0,0\n");
  EXPECT_THAT(error(), EndsWith("usbl.csv:3: time 5.2 is outside the time span of the odometry, 0 to 5 s"));
  folder_.write("usbl.csv", "t,x,y,z\n-1,5,0,0\n");
  EXPECT_THAT(error(), HasSubstr("usbl.csv:2: time -1 is outside"));
}

TEST_F(ScenarioTest, RejectsScenarioWithoutMeasurements) {
  remove("optical.csv");
  folder_.write("usbl.csv", "t,x,y,z\n");
  EXPECT_THAT(error(), HasSubstr("has no measurements"));
  remove("usbl.csv");
  EXPECT_THAT(error(), HasSubstr("has no measurements"));
}

TEST_F(ScenarioTest, RejectsUnknownKeys) {
  edit("keyframe_interval", "keyframe_intervall");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:4: unknown key 'keyframe_intervall'; did you mean keyframe_interval?"));
  edit("keyframe_intervall", "colour");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:4: unknown key 'colour'"));
}

TEST_F(ScenarioTest, RejectsUnknownNoise) {
  edit("constant_twist", "constant_twst");
  EXPECT_THAT(error(),
              EndsWith("scenario.yaml:10: unknown key 'constant_twst' in noise; did you mean constant_twist?"));
}

TEST_F(ScenarioTest, RejectsMissingNoise) {
  edit("  odometry: [0.01, 0.01, 0.01, 0.001, 0.001, 0.001]\n", "");
  EXPECT_THAT(error(), HasSubstr(": noise lacks the key odometry"));
}

TEST_F(ScenarioTest, RequiresNoiseOfUndeclaredSensor) {
  edit("  usbl: [1.0, 1.0, 1.0]\n", "");
  EXPECT_THAT(error(), HasSubstr(": noise lacks the key usbl"));
  remove("usbl.csv");
  read_scenario(folder_.path());
}

TEST_F(ScenarioTest, RejectsInvalidStandardDeviations) {
  edit("usbl: [1.0, 1.0, 1.0]", "usbl: [1.0, 0.0, 1.0]");
  EXPECT_THAT(error(),
              EndsWith("scenario.yaml:8: usbl has the standard deviation 0; it must be above zero and finite"));
  edit("[1.0, 0.0, 1.0]", "[1.0, -2, 1.0]");
  EXPECT_THAT(error(), HasSubstr("scenario.yaml:8: usbl has the standard deviation -2;"));
  edit("[1.0, -2, 1.0]", "[1.0, .inf, 1.0]");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:8: usbl is '.inf', not a finite number"));
  edit("[1.0, .inf, 1.0]", "[1.0, inf, 1.0]");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:8: usbl is 'inf', not a finite number"));
  edit("[1.0, inf, 1.0]", "[1.0, [2], 1.0]");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:8: usbl must be a number"));
  edit("[1.0, [2], 1.0]", "[1.0, 1.0]");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:8: usbl needs 3 standard deviations, not 2"));
}

TEST_F(ScenarioTest, RejectsInvalidValues) {
  edit("keyframe_interval: 1.0", "keyframe_interval: soon");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:4: keyframe_interval is 'soon', not a finite number"));
  edit("keyframe_interval: soon", "keyframe_interval: 0");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:4: keyframe_interval must be above 0.001 s"));
  edit("keyframe_interval: 0", "truth_orientation: maybe");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:4: truth_orientation must be true or false, not 'maybe'"));
}

TEST_F(ScenarioTest, RejectsMalformedYaml) {
  edit("noise:", "noise: [");
  EXPECT_THAT(error(), testing::ContainsRegex("scenario.yaml:[0-9]+: not valid yaml: "));
  folder_.write("scenario.yaml", "- a\n- b\n");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:1: the file must consist of KEY: VALUE entries"));
  folder_.write("scenario.yaml", "");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:1: the file must consist of KEY: VALUE entries"));
}

TEST_F(ScenarioTest, RejectsRepeatedKeys) {
  append("name: again\n");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:11: key 'name' is given twice"));
}

TEST_F(ScenarioTest, RejectsUnknownFrameAndGroup) {
  append("group: SE4\n");
  EXPECT_THAT(error(), HasSubstr("scenario.yaml:11: unknown group 'SE4'; did you mean SE"));
  edit("group: SE4", "frame: NED-FRT");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:11: unknown frame 'NED-FRT'; did you mean NED-FRD?"));
}

TEST_F(ScenarioTest, RejectsInvalidSensors) {
  append("sensors:\n  usbl: {type: positon, file: usbl.csv, sigma: [1, 1, 1]}\n");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:12: unknown sensor type 'positon'; did you mean position?"));
  edit("type: positon", "type: position, target_orientation: [0, 0, 0, 1]");
  EXPECT_THAT(error(), HasSubstr("scenario.yaml:12: unknown key 'target_orientation' in sensor usbl"));
  edit("target_orientation: [0, 0, 0, 1]", "orientation: [0, 0, 0, 2]");
  EXPECT_THAT(error(), HasSubstr("scenario.yaml:12: quaternion 0 0 0 2 has norm 2"));
  edit("orientation: [0, 0, 0, 2]", "position: [0, 0]");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:12: position needs 3 numbers, not 2"));
  edit("position: [0, 0], file: usbl.csv", "file: optical.csv");
  EXPECT_THAT(error(), HasSubstr("optical.csv:1: the first line must be the header t,x,y,z"));
  edit("type: position, file: optical.csv", "type: position");
  EXPECT_THAT(error(), EndsWith("scenario.yaml:12: sensor usbl lacks the key file"));
}

TEST_F(ScenarioTest, RejectsDeclaredSensorWithNameOfAnotherFile) {
  folder_.write("sonar.csv", "t,x,y,z\n1,5,0,0\n");
  append("sensors:\n  usbl: {type: position, file: sonar.csv, sigma: [1, 1, 1]}\n");
  EXPECT_THAT(error(),
              EndsWith("scenario.yaml:12: sensor usbl must read usbl.csv, since that file exists; set its file, "
                       "or rename it"));
}

TEST(RecordedScenarios, CanBeRead) {
  TANDEM_NEEDS_SHARED(19);
  int tracking = 0, navigation = 0;
  for (const auto& entry : std::filesystem::directory_iterator(shared_path("data"))) {
    const Scenario scenario = read_scenario(entry.path());
    EXPECT_EQ(scenario.name, entry.path().filename().string());
    EXPECT_EQ(scenario.data.odometry.empty(), scenario.navigation.has_value()) << scenario.name;
    EXPECT_EQ(scenario.data.sensors.empty(), scenario.navigation.has_value()) << scenario.name;
    scenario.navigation ? ++navigation : ++tracking;
  }
  EXPECT_GE(tracking, 14);
  EXPECT_GE(navigation, 5);
}

}  // namespace
}  // namespace tandem
