#include <nlohmann/json.hpp>

#include "needs_program.hpp"
#include "run_tandem.hpp"

/// Tables, files and plots show the sensors of a scenario by name, and keyframes by the measurement at them.
namespace tandem {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

/// A chaser that moves at 1 m/s along x. The target stays 5 m ahead; a lidar and a radar measure its position, and a
/// camera its direction.
class SensorNames : public testing::Test {
 protected:
  SensorNames() {
    write_small_scenario(scratch_);
    std::filesystem::remove(scratch_.path() / "usbl.csv");
    std::filesystem::remove(scratch_.path() / "optical.csv");
    std::string yaml = read_file(scratch_.path() / "scenario.yaml");
    for (const char* entry : {"  usbl: [1.0, 1.0, 1.0]\n", "  optical: [0.1, 0.1, 0.1, 0.04, 0.04, 0.04]\n"})
      yaml.erase(yaml.find(entry), std::string(entry).size());
    scratch_.write("scenario.yaml", yaml +
                                        "  constant_velocity: [0.1, 0.1, 0.1]\nsensors:\n"
                                        "  lidar: {type: position, file: lidar.csv, sigma: [0.2, 0.2, 0.2]}\n"
                                        "  radar: {type: position, file: radar.csv, sigma: [0.5, 0.5, 0.5]}\n"
                                        "  camera: {type: bearing, file: camera.csv, sigma: [0.01, 0.01]}\n");
    scratch_.write("lidar.csv", "t,x,y,z\n1,5,0,0\n2,5,0,0\n3,5,0,0\n");
    scratch_.write("radar.csv", "t,x,y,z\n2,5,0,0\n3.5,5,0,0\n");
    scratch_.write("camera.csv", "t,azimuth,elevation\n2,0,0\n4.5,0,0\n");
  }
  std::string run() const { return scratch_.path().string(); }
  std::string out() const { return (scratch_.path() / "out").string(); }
  std::string result(const std::string& file) const { return read_file(scratch_.path() / "out" / file); }

 private:
  ScratchFolder scratch_;
};

TEST_F(SensorNames, AreInTablesAndFilesOfAnEstimate) {
  const Outcome outcome =
      run_tandem({"estimate", run(), "--model", "constant-velocity", "--plots", "off", "--out", out()});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(outcome.output,
              AllOf(ContainsRegex("\nposition +4 "), ContainsRegex("\npartial +1 "), ContainsRegex("\nnone +2 "),
                    ContainsRegex("\nall +7 "), Not(HasSubstr("\npose "))));
  EXPECT_THAT(outcome.output, AllOf(ContainsRegex("\nlidar +position +3 "), ContainsRegex("\nradar +position +2 "),
                                    ContainsRegex("\ncamera +bearing +2 ")));
  EXPECT_THAT(result("errors.csv"),
              AllOf(HasSubstr("\n0,none,"), HasSubstr("\n2,position,"), HasSubstr("\n4.5,partial,")));
  std::string rows;
  std::istringstream fixes(result("target_fixes.csv"));
  for (std::string line; std::getline(fixes, line);) {
    std::size_t end = line.find(',');
    for (int i = 0; i < 2; ++i) end = line.find(',', end + 1);
    rows += line.substr(0, end) + "\n";
  }
  EXPECT_EQ(rows,
            "t,sensor,type\n1,lidar,position\n2,lidar,position\n2,radar,position\n3,lidar,position\n"
            "3.5,radar,position\n");
  const nlohmann::json summary = nlohmann::json::parse(result("summary.json"));
  EXPECT_EQ(summary["errors"]["position"]["n"], 4);
  EXPECT_EQ(summary["errors"]["partial"]["n"], 1);
  EXPECT_TRUE(summary["sensors"].contains("lidar") && summary["sensors"].contains("radar"));
}

TEST_F(SensorNames, AreInTablesAndFilesOfATrack) {
  const Outcome outcome = run_tandem({"track", run(), "--mode", "B", "--plots", "off", "--out", out()});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(outcome.output, AllOf(ContainsRegex("\nlidar +3 "), ContainsRegex("\nradar +2 "),
                                    ContainsRegex("\ncamera +2 "), ContainsRegex("\npartial +1 ")));
  EXPECT_THAT(result("track.csv"), AllOf(HasSubstr("lidar_sigmas"), HasSubstr("radar_sigmas"),
                                         HasSubstr("\n2,position,"), HasSubstr("\n4.5,partial,")));
  EXPECT_EQ(nlohmann::json::parse(result("summary.json"))["errors"]["partial"]["n"], 1);
}

TEST_F(SensorNames, AreInLegendsOfPlots) {
  TANDEM_NEEDS_GNUPLOT("plots of an estimate");
  ASSERT_EQ(run_tandem({"estimate", run(), "--model", "constant-velocity", "--out", out()}).status, 0);
  EXPECT_THAT(result("trajectories.svg"), AllOf(HasSubstr("lidar fix"), HasSubstr("radar fix")));
  EXPECT_THAT(result("error_norms.svg"),
              AllOf(HasSubstr(">position<"), HasSubstr(">partial<"), HasSubstr(">none<"), Not(HasSubstr(">pose<"))));
}

TEST_F(SensorNames, AreInTheReportPage) {
  ASSERT_EQ(run_tandem({"estimate", run(), "--model", "constant-velocity", "--plots", "off", "--out", out()}).status,
            0);
  const Outcome outcome = run_tandem({"report", out()});
  if (outcome.errors.find("a report needs plotly.js") != std::string::npos) GTEST_SKIP() << outcome.errors;
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(result("report.html"), AllOf(HasSubstr("\"lidar\""), HasSubstr("\"radar\""), HasSubstr("\"partial\"")));
}

}  // namespace
}  // namespace tandem
