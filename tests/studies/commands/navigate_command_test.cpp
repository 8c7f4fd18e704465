#include <algorithm>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/scenario/table.hpp>
#include <tandem/studies/simulation/simulate_dive_files.hpp>

#include "run_tandem.hpp"
#include "shared_data.hpp"

/// `tandem navigate` with the real executable, on a simulated dive of one minute and on real recordings.
namespace tandem {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::Each;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;
using Json = nlohmann::json;

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> result;
  for (std::size_t at = 0, end; (end = text.find('\n', at)) != std::string::npos; at = end + 1)
    result.push_back(text.substr(at, end - at));
  return result;
}

class Navigate : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ScratchFolder;
    DiveOptions options;
    options.grade = Grade::tactical;
    options.minutes = 1;
    std::filesystem::create_directory(dive());
    write_dive(simulate_dive(options), options, dive());
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::filesystem::path dive() { return folder_->path() / "dive"; }
  static Outcome run(std::vector<std::string> options) {
    options.insert(options.begin(), {"navigate", dive().string()});
    return run_tandem(options);
  }
  /// Returns the summary of a run that must converge.
  static Json navigate(std::vector<std::string> options) {
    options.push_back("--json");
    const Outcome outcome = run(options);
    EXPECT_EQ(outcome.status, 0) << outcome.errors;
    return Json::parse(outcome.output, nullptr, false);
  }
  static std::string rejection_of(std::vector<std::string> options) {
    options.insert(options.begin(), {"navigate", dive().string()});
    return rejection(options);
  }

 private:
  static inline ScratchFolder* folder_ = nullptr;
};

TEST_F(Navigate, HelpListsOptions) {
  const Outcome help = run_tandem({"navigate", "--help-all"});
  EXPECT_EQ(help.status, 0);
  for (const char* option :
       {"--without", "--dvl-scale", "--preintegrated-dvl", "--no-earth-rotation", "--loss", "--noise", "--delay",
        "--fit-delay", "--keyframe-interval", "--after", "--alignment", "--max-iterations", "--time-limit", "--out",
        "--plots", "--json", "--quiet", "Exit status"})
    EXPECT_THAT(help.output, HasSubstr(option));
}

TEST_F(Navigate, PrintsReport) {
  const Outcome outcome = run({"--after", "20", "--dvl-scale"});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_EQ(outcome.errors, "");
  EXPECT_THAT(outcome.output, ContainsRegex("dive_tactical_1: 6[0-2] keyframes, [0-9]+ residual blocks; "
                                            "[56][0-9]\\.[0-9] s of data in [0-9.]+ s \\([0-9]+ times real time\\)\n"));
  EXPECT_THAT(outcome.output, HasSubstr("gauss-newton: converged"));
  EXPECT_THAT(outcome.output, ContainsRegex("imu +imu +600[01] +100\\.0 +600[01] +0 +0\n"));
  EXPECT_THAT(outcome.output, ContainsRegex("dvl +dvl +300 +5\\.0 +[0-9]+ +[0-9]+ +0\n"));
  EXPECT_THAT(outcome.output, ContainsRegex("\nall +6[0-2] +[0-9.]+ "));
  EXPECT_THAT(outcome.output, ContainsRegex("\nafter 20 s +4[0-2] +[0-9.]+ "));
  EXPECT_THAT(outcome.output, ContainsRegex("\nat the end +1 +[0-9.]+ "));
  EXPECT_THAT(outcome.output, ContainsRegex("Distance travelled: [0-9.]+ m"));
  EXPECT_THAT(outcome.output, ContainsRegex("Gyroscope bias at the end \\[°/h\\]: .* ± .*\n"));
  EXPECT_THAT(outcome.output, ContainsRegex("Estimated DVL scale \\(reading / velocity\\): (1\\.0|0\\.9)[0-9]+\n"));
}

TEST_F(Navigate, WritesFiles) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  const Outcome outcome = run({"--json", "--after", "20", "--out", out.string()});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(files(out),
              UnorderedElementsAre("chaser.tum", "chaser_full.csv", "errors.csv", "weights.csv", "fit_residuals.csv",
                                   "summary.json", "chaser_fixes.csv", "gps_outages.csv", "chaser_truth.tum",
                                   "navigation.svg", "navigation_errors.svg", "run.yaml"));
  EXPECT_EQ(outcome.output, read_file(out / "summary.json"));
  const Json summary = Json::parse(outcome.output);
  for (const char* key : {"scenario", "status", "cost", "keyframes", "residual_blocks", "seconds", "times_real_time",
                          "sensors", "findings", "splits", "errors", "distance_m", "gps_outages", "bias_at_the_end"})
    EXPECT_TRUE(summary.contains(key)) << key;
  EXPECT_EQ(summary["status"], "converged");
  const std::size_t keyframes = summary["keyframes"];
  for (const char* rows : {"all", "after_20s"})
    for (const char* key : {"position_mean_m", "position_rms_m", "position_max_m", "horizontal_mean_m",
                            "orientation_mean_deg", "orientation_max_deg", "velocity_rms_m_s", "yaw_rms_deg",
                            "pose_nees", "position_nees", "orientation_within_3_sigma_percent"})
      EXPECT_TRUE(summary["errors"][rows].contains(key)) << rows << ": " << key;
  EXPECT_LT(summary["errors"]["after_20s"]["n"], summary["errors"]["all"]["n"]);
  EXPECT_TRUE(summary["error_at_the_end"].contains("horizontal_percent_of_distance"));
  // Bounds that the sensors allow: GPS with 0.5 m, heading with 0.1°.
  EXPECT_LT(summary["errors"]["all"]["position_max_m"], 3.0);
  EXPECT_LT(summary["errors"]["after_20s"]["orientation_max_deg"], 0.5);
  EXPECT_LT(summary["errors"]["after_20s"]["velocity_rms_m_s"], 0.05);

  EXPECT_EQ(poses(read_tum(out / "chaser.tum")).size(), keyframes);
  const auto full = lines(read_file(out / "chaser_full.csv")), errors = lines(read_file(out / "errors.csv"));
  EXPECT_EQ(full.size(), keyframes + 1);
  EXPECT_EQ(errors.size(), keyframes + 1);
  const auto commas = [](const std::string& line) { return std::count(line.begin(), line.end(), ','); };
  for (const std::string& line : full) {
    ASSERT_EQ(commas(line), 16 + 36 + 9);
    ASSERT_EQ(line.find(",,"), std::string::npos) << "no cell is empty: " << line;
  }
  for (const std::string& line : errors) ASSERT_EQ(commas(line), commas(errors[0]));
  EXPECT_THAT(errors[0], HasSubstr("t,position_error_m,horizontal_error_m,orientation_error_deg,velocity_error_m_s,"));
  EXPECT_EQ(read_file(out / "weights.csv"), "sensor,t,weight\n");
  for (const char* plot : {"navigation.svg", "navigation_errors.svg"})
    EXPECT_THAT(read_file(out / plot), HasSubstr("</svg>"));
}

using LongNavigate = Navigate;
TEST_F(LongNavigate, AlignsTruthWithoutGlobalSensor) {
  // Convergence takes about 1,000 iterations, the default limit; whether it suffices depends on rounding.
  const Json without = navigate({"--without", "gps", "--without", "heading", "--max-iterations", "2000"});
  EXPECT_FALSE(without["sensors"].contains("gps"));
  EXPECT_FALSE(without["sensors"].contains("heading"));
  EXPECT_TRUE(without.contains("truth_aligned"));
  EXPECT_THAT(without["gps_outages"], IsEmpty());
}

TEST_F(Navigate, AppliesOptions) {
  const Json plain = navigate({});
  const std::size_t seldom = navigate({"--keyframe-interval", "2"})["keyframes"], often = plain["keyframes"];
  EXPECT_NEAR(2.0 * double(seldom), double(often), 3);
  EXPECT_NE(navigate({"--noise", "dvl=0.5,0.5,0.5"})["cost"], plain["cost"]);
  EXPECT_NE(navigate({"--no-earth-rotation"})["cost"], plain["cost"]);
  EXPECT_TRUE(navigate({"--dvl-scale"}).contains("dvl_scale"));
  EXPECT_LT(navigate({"--preintegrated-dvl"})["residual_blocks"], plain["residual_blocks"]);
  const Json robust = navigate({"--loss", "dvl=cauchy:0.1"});
  EXPECT_GT(robust["sensors"]["dvl"]["down_weighted"], 0);
  EXPECT_EQ(robust["sensors"]["depth"]["down_weighted"], 0);
  EXPECT_EQ(plain["sensors"]["dvl"]["down_weighted"], 0) << "no loss by default";
}

TEST_F(LongNavigate, EstimatesDelay) {
  const ScratchFolder scratch;
  const auto late = scratch.path() / "late";
  std::filesystem::copy(dive(), late);
  const Table dvl = read_csv(dive() / "dvl.csv", "t,vx,vy,vz", TimeOrder::increasing);
  std::ofstream file(late / "dvl.csv");
  file.precision(17);
  file << "t,vx,vy,vz\n";
  for (std::size_t i = 0; i < dvl.rows(); ++i)
    file << dvl.t(i) + 0.12 << ',' << dvl.row(i)[1] << ',' << dvl.row(i)[2] << ',' << dvl.row(i)[3] << '\n';
  file.close();
  const Outcome outcome = run_tandem({"navigate", late.string(), "--fit-delay", "dvl", "--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const Json fitted = Json::parse(outcome.output)["fitted_delays"]["dvl"];
  EXPECT_NEAR(fitted["seconds"], 0.12, 0.011);
  EXPECT_LT(fitted["cost"], fitted["cost_as_given"]);
  const Outcome given = run_tandem({"navigate", late.string(), "--delay", "dvl=0.12", "--json"});
  EXPECT_LT(Json::parse(given.output)["cost"], fitted["cost_as_given"]);
}

/// A negative delay in scenario.yaml or by --delay corrects early stamps of an imu: the result is that with correct
/// stamps.
TEST_F(Navigate, CorrectsEarlyImuStamps) {
  const ScratchFolder scratch;
  const auto early = scratch.path() / "early";
  std::filesystem::copy(dive(), early);
  const Table imu = read_csv(dive() / "imu.csv", "t,fx,fy,fz,wx,wy,wz", TimeOrder::increasing);
  std::ofstream file(early / "imu.csv");
  file.precision(17);
  file << "t,fx,fy,fz,wx,wy,wz\n";
  for (std::size_t i = 0; i < imu.rows(); ++i) {
    file << imu.t(i) - 0.03;
    for (int c = 1; c < 7; ++c) file << ',' << imu.row(i)[c];
    file << '\n';
  }
  file.close();
  const auto cost = [](const std::vector<std::string>& words) {
    const Outcome outcome = run_tandem(words);
    EXPECT_EQ(outcome.status, 0) << outcome.errors;
    return Json::parse(outcome.output)["cost"].get<double>();
  };
  const double right = cost({"navigate", dive().string(), "--json"});
  EXPECT_GT(cost({"navigate", early.string(), "--json"}), right + 1);
  EXPECT_NEAR(cost({"navigate", early.string(), "--json", "--delay", "imu=-0.03"}), right, 1e-4 * right);
  std::string yaml = read_file(early / "scenario.yaml");
  const std::size_t entry = yaml.find("type: imu,");
  ASSERT_NE(entry, std::string::npos) << yaml;
  std::ofstream(early / "scenario.yaml") << yaml.insert(entry, "delay: -0.03, ");
  EXPECT_NEAR(cost({"navigate", early.string(), "--json"}), right, 1e-4 * right);
}

TEST_F(Navigate, StopsAtMaxIterations) {
  const ScratchFolder scratch;
  const Outcome outcome = run({"--max-iterations", "1", "--plots", "off", "--out", scratch.path().string()});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.output, HasSubstr("NOT CONVERGED"));
  EXPECT_THAT(outcome.errors, ContainsRegex("^tandem: gauss-newton did not converge \\(max-iterations\\): [^\n]+\n$"));
  EXPECT_EQ(Json::parse(read_file(scratch.path() / "summary.json"))["status"], "max-iterations");
  const Outcome quiet = run({"--quiet"});
  EXPECT_EQ(quiet.status, 0);
  EXPECT_EQ(quiet.output + quiet.errors, "");
}

TEST_F(Navigate, RejectsInvalidOptions) {
  EXPECT_THAT(rejection_of({"--without", "dlv"}), AllOf(HasSubstr("--without"), HasSubstr("did you mean dvl?")));
  EXPECT_THAT(rejection_of({"--without", "camera"}), HasSubstr("(available: imu, dvl, depth, heading and gps)"));
  EXPECT_THAT(rejection_of({"--noise", "dept=1"}), HasSubstr("did you mean depth?"));
  EXPECT_THAT(rejection_of({"--noise", "dvl=0.1"}), HasSubstr("--noise dvl needs 3 standard deviations, not 1"));
  EXPECT_THAT(rejection_of({"--noise", "imu=0.1,0.1"}), HasSubstr("--noise imu needs 4"));
  EXPECT_THAT(rejection_of({"--noise", "depth=-1"}), HasSubstr("must be above zero"));
  EXPECT_THAT(rejection_of({"--noise", "depth"}), HasSubstr("--noise takes KEY=VALUE"));
  EXPECT_THAT(rejection_of({"--loss", "gsp=cauchy"}), HasSubstr("did you mean gps?"));
  EXPECT_THAT(rejection_of({"--loss", "gps=cauhcy"}), HasSubstr("did you mean cauchy?"));
  EXPECT_THAT(rejection_of({"--loss", "imu=cauchy"}), HasSubstr("--without imu"));
  EXPECT_THAT(rejection_of({"--delay", "gsp=0.1"}), HasSubstr("did you mean gps?"));
  EXPECT_THAT(rejection_of({"--delay", "gps=-0.1"}), HasSubstr("--delay"));
  EXPECT_THAT(rejection_of({"--delay", "imu=1e6"}), AllOf(HasSubstr("s (the imu) and"), HasSubstr("on another clock")));
  EXPECT_THAT(rejection_of({"--fit-delay", "dvl", "--fit-delay", "dvl"}), HasSubstr("--fit-delay dvl is given twice"));
  EXPECT_THAT(rejection_of({"--fit-delay", "dvl", "--error", "dvl.delay=0.3"}),
              HasSubstr("the delay is already estimated"));
  EXPECT_THAT(rejection_of({"--fit-delay", "dlv"}), HasSubstr("did you mean dvl?"));
  EXPECT_THAT(rejection_of({"--keyframe-interval", "0"}), HasSubstr("--keyframe-interval"));
  EXPECT_THAT(rejection_of({"--keyframe-interval", "soon"}), HasSubstr("--keyframe-interval"));
  EXPECT_THAT(rejection_of({"--after", "-1"}), HasSubstr("--after takes a non-negative number"));
  EXPECT_THAT(rejection_of({"--max-iterations", "0"}), HasSubstr("--max-iterations takes a positive integer"));
  EXPECT_THAT(rejection_of({"--plots", "gif"}), HasSubstr("--plots takes svg, png, pdf or off"));
  EXPECT_THAT(rejection_of({"--dvl-scale", "--without", "dvl"}), HasSubstr("--dvl-scale needs a dvl"));
  EXPECT_THAT(rejection_of({"--dvl-scale", "--preintegrated-dvl"}), HasSubstr("--preintegrated-dvl"));
  EXPECT_THAT(rejection_of({"--preintegrated-dvl", "--without", "imu"}), HasSubstr("--preintegrated-dvl needs"));
  EXPECT_THAT(rejection_of({"--vibration", "--without", "imu"}), HasSubstr("--vibration needs an imu"));
  EXPECT_THAT(rejection_of({"--dvl-scal"}), HasSubstr("did you mean --dvl-scale?"));
  EXPECT_THAT(rejection_of({"--without", "imu", "--without", "heading"}), HasSubstr("needs a source of motion"));
}

TEST_F(Navigate, SuggestsOtherCommand) {
  EXPECT_THAT(rejection({"navigate", "docking_a"}),
              AllOf(HasSubstr("imu, dvl, depth, gps or heading"), HasSubstr("tandem estimate")));
  EXPECT_THAT(rejection({"estimate", dive().string()}), HasSubstr("use tandem navigate"));
  EXPECT_THAT(rejection({"navigate", "nowhere"}), HasSubstr("no folder 'nowhere'"));
}

/// Navigates a real recording, which must converge, and returns the summary.
Json navigate_real(const std::string& scenario, const std::vector<std::string>& options) {
  std::vector<std::string> arguments{"navigate", shared_path("data/" + scenario).string(), "--json"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  const Outcome outcome = run_tandem(arguments);
  EXPECT_EQ(outcome.status, 0) << scenario << ": " << outcome.errors;
  const Json summary = Json::parse(outcome.output, nullptr, false);
  EXPECT_EQ(summary.value("status", ""), "converged") << scenario;
  return summary;
}

TEST(RecordedNavigation, UnderwaterVehicleByDvl) {
  TANDEM_NEEDS_SHARED(3);
  const Json summary = navigate_real("auv_akit_01", {"--after", "60"});
  EXPECT_LE(summary["error_at_the_end"]["horizontal_percent_of_distance"], 0.5);
  EXPECT_LE(summary["errors"]["after_60s"]["orientation_max_deg"], 0.5);
  EXPECT_EQ(summary["gps_outages"].size(), 1u) << "starts after 20 s";
}

/// The rows of imu.csv are means over the 10 ms after their stamp, so the stamps are 5 ms early. The rolling motion
/// makes the delay observable.
TEST(RecordedNavigation, EstimatesEarlyImuStamps) {
  TANDEM_NEEDS_SHARED(3);
  const Json summary =
      navigate_real("auv_akit_01", {"--fit-delay", "imu", "--error", "dvl=0.01,0.01,0.01:100", "--error",
                                    "depth=0.3:100", "--error", "heading=0.01,0.01,0.01:100"});
  const Json fitted = summary["fitted_delays"]["imu"];
  EXPECT_NEAR(fitted["seconds"], -0.005, 0.003);
  EXPECT_NEAR(fitted["sigma"], 0.005, 0.002) << "weakly observable";
  EXPECT_LE(summary["errors"]["all"]["pose_nees"], 15);
}

TEST(RecordedNavigation, FlyingVehicleByFixes) {
  TANDEM_NEEDS_SHARED(2);
  const Json summary = navigate_real("mav_euroc_mh01", {"--after", "20"});
  EXPECT_LE(summary["errors"]["after_20s"]["position_mean_m"], 0.10);
  EXPECT_THAT(summary["gps_outages"], IsEmpty());
}

/// The fixes are 0.135 s late relative to IMU and truth (with this delay they fit the truth to 5 mm). The IMU vibrates
/// with the rotors, so its noise exceeds that of the data sheet. With this delay and noise, the heading is accurate
/// too.
TEST(RecordedNavigation, FlyingVehicleWithDelayAndVibrationNoise) {
  TANDEM_NEEDS_SHARED(3);
  const ScratchFolder scratch;
  for (const auto& entry : std::filesystem::directory_iterator(shared_path("data/mav_euroc_mh01")))
    std::filesystem::create_symlink(std::filesystem::absolute(entry.path()), scratch.path() / entry.path().filename());
  std::string yaml = read_file(scratch.path() / "scenario.yaml");
  const std::size_t at = yaml.find("type: gps,");
  ASSERT_NE(at, std::string::npos);
  std::filesystem::remove(scratch.path() / "scenario.yaml");
  scratch.write("scenario.yaml", yaml.insert(at, "delay: 0.135, "));
  const Outcome outcome = run_tandem({"navigate", scratch.path().string(), "--allow-outside", "--json", "--after", "20",
                                      "--noise", "imu=2e-2,1e-3,3e-3,2e-5"});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const Json errors = Json::parse(outcome.output)["errors"]["after_20s"];
  EXPECT_LE(errors["position_mean_m"], 0.10);
  EXPECT_LE(errors["orientation_max_deg"], 1.0);
  EXPECT_THAT(errors["orientation_within_3_sigma_percent"], Each(testing::Ge(95.0)));
}

/// Estimates the delay and takes the IMU noise from the samples; only the prior of the delay is given.
TEST(RecordedNavigation, FlyingVehicleWithEstimatedDelayAndNoise) {
  TANDEM_NEEDS_SHARED(2);
  const Json summary = navigate_real("mav_euroc_mh01", {"--after", "20", "--vibration", "--error", "gps.delay=0.3"});
  for (const char* of : {"all", "after_20s"}) {
    EXPECT_LE(summary["errors"][of]["position_mean_m"], 0.02) << of;
    EXPECT_LE(summary["errors"][of]["orientation_mean_deg"], 0.4) << of;
  }
}

}  // namespace
}  // namespace tandem
