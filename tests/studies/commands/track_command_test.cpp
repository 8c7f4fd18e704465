#include <algorithm>
#include <csignal>
#include <map>
#include <sstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/scenario/table.hpp>

#include "docking_lines.hpp"
#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::StartsWith;
using testing::UnorderedElementsAre;
using Json = nlohmann::json;

TEST(TrackCommand, IsListedAndHasHelp) {
  EXPECT_THAT(run_tandem({"--help"}).output, ContainsRegex("track +Track chaser and target online, line by line"));
  const Outcome help = run_tandem({"track", "--help-all"});
  EXPECT_EQ(help.status, 0);
  for (const char* text : {"SCENARIO", "--mode", "--horizons", "--window", "--window-keyframes", "--max-iterations",
                           "--realtime", "--stdin", "--predict", "--until", "--alignment", "--dvl-scale", "--without",
                           "--delay", "--out", "starboard", "Exit status"})
    EXPECT_THAT(help.output, HasSubstr(text));
}

TEST(LongTrackCommand, ReportsSystematicErrors) {
  const std::vector<std::string> words{"track",   "docking_a",       "--until", "150",
                                       "--error", "usbl.scale=0.02", "--error", "usbl=1,1,1:60"};
  EXPECT_THAT(run_tandem(words).output, ContainsRegex("Systematic errors.*\n  usbl.scale -?0\\.[0-9]+ ± 0\\.0"));
  std::vector<std::string> as_json = words;
  as_json.push_back("--json");
  const Json errors = Json::parse(run_tandem(as_json).output)["systematic_errors"];
  ASSERT_EQ(errors.size(), 4u) << errors;
  EXPECT_EQ(errors["usbl.scale"]["given_sigma"], 0.02);
  for (const char* row : {"usbl.bias.1", "usbl.bias.2", "usbl.bias.3"}) {
    EXPECT_GT(errors[row]["sigma"], 0.0);
    EXPECT_LT(errors[row]["sigma"], 1.0) << "reduced by the fixes";
  }
  EXPECT_THAT(run_tandem({"track", "docking_a", "--until", "250", "--error", "optical.delay=0.5"}).output,
              AllOf(ContainsRegex("optical.delay .*: identifiable\n"),
                    HasSubstr("estimate with the same --error computes it")));
}

TEST(TrackCommand, FolderAndStandardInputGiveSameTrack) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "folder", live = scratch.path() / "live";
  const Outcome run = run_tandem({"track", "docking_a", "--until", "250", "--out", out});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(run.errors, "");
  EXPECT_THAT(run.output, StartsWith("  time [s] range [m] bearing [°] elev. [°] speed [m/s] heading [°]"));
  EXPECT_THAT(run.output, ContainsRegex("\n +200\\.[0-9]+ +[0-9]+\\.[0-9]+ +-?[0-9]+\\.[0-9] "));
  EXPECT_THAT(
      run.output,
      HasSubstr("docking_a, newest state by motion hypotheses, window by constant-twist, mode B, window 60 s\n"));
  EXPECT_THAT(run.output, ContainsRegex("wall clock +[0-9.]+ +[0-9.]+ +[0-9.]+\n"));
  EXPECT_THAT(run.output, ContainsRegex("\npose +[0-9]+ +0\\.[0-9]+ ± 0\\.[0-9]+ "));
  EXPECT_THAT(run.output, HasSubstr("10 s ahead"));
  EXPECT_THAT(files(out), UnorderedElementsAre("chaser.tum", "target.tum", "track.csv", "errors.csv", "summary.json",
                                               "run.yaml", "chaser_truth.tum", "target_truth.tum", "trajectories.svg",
                                               "errors.svg", "error_norms.svg"));
  EXPECT_THAT(read_file(out / "track.csv"), StartsWith("t,type,new_keyframe,keyframes,update_ms,"));
  EXPECT_GT(poses(read_tum(out / "chaser.tum")).size(), 250u);
  const std::string target = read_file(out / "target.tum");
  EXPECT_GT(std::count(target.begin(), target.end(), '\n'), 250);

  // A folder with settings only; two lines of the data are invalid.
  scratch.write("scenario.yaml", read_file(docking() / "scenario.yaml"));
  const auto input = scratch.write("lines", "usbl,0,1\n" + docking_lines(250) + "usbl,3,1,2,3\n");
  const Outcome piped = run_tandem({"track", scratch.path(), "--stdin", "--out", live, "--json"}, input);
  ASSERT_EQ(piped.status, 0) << piped.errors;
  EXPECT_THAT(piped.errors, HasSubstr("standard input:1: expected 4 columns (t,x,y,z), found 2; the line is rejected"));
  EXPECT_EQ(piped.output, read_file(live / "summary.json"));
  EXPECT_EQ(read_file(out / "target.tum"), read_file(live / "target.tum"));
  EXPECT_EQ(read_file(out / "chaser.tum"), read_file(live / "chaser.tum"));
  const Json summary = Json::parse(piped.output), with_truth = Json::parse(read_file(out / "summary.json"));
  EXPECT_EQ(summary["updates"], with_truth["updates"]);
  EXPECT_FALSE(summary.contains("errors")) << "the folder has no truth";
  EXPECT_EQ(summary["rejected_lines"], Json::parse(R"([{"sensor": "usbl", "why": "malformed", "lines": 1},
                            {"sensor": "usbl", "why": "time jumps away from all other streams", "lines": 1}])"));
  for (const char* key : {"lines", "data_seconds", "keyframes", "update_wall_ms", "update_processor_ms", "memory_mb"})
    EXPECT_TRUE(summary.contains(key)) << key;
  for (const char* type : {"position", "pose", "none", "all"}) EXPECT_GT(with_truth["errors"][type]["n"], 0) << type;
  EXPECT_LT(with_truth["errors"]["pose"]["position_mean_m"], with_truth["errors"]["pose"]["raw_position_mean_m"]);
  EXPECT_LT(with_truth["errors"]["position"]["position_mean_m"],
            with_truth["errors"]["position"]["raw_position_mean_m"]);
  EXPECT_EQ(with_truth["predictions"][1]["seconds_ahead"], 10);
}

TEST(TrackCommand, WarnsOfSensorOnAnotherClock) {
  const ScratchFolder scratch;
  write_small_scenario(scratch);
  const Outcome good = run_tandem({"track", scratch.path()});
  EXPECT_THAT(good.errors, testing::Not(HasSubstr("do not overlap")));
  scratch.write("usbl.csv", "t,x,y,z\r\n86401,5,0,0\r\n86404.5,5,0,0\r\n");
  const Outcome run = run_tandem({"track", scratch.path()});
  EXPECT_EQ(run.status, good.status) << run.errors;
  EXPECT_THAT(run.errors,
              ContainsRegex("usbl: its stamps \\(86401.000 to 86404.500\\) do not overlap those of odometry "
                            "\\(0.000 to [0-9.]+\\); check that both use the same clock"));
  EXPECT_THAT(run_tandem({"track", scratch.path(), "--quiet"}).errors, testing::Not(HasSubstr("do not overlap")));
}

TEST(LongTrackCommand, AppliesTrackingOptions) {
  const auto errors = [](const std::vector<std::string>& options) {
    std::vector<std::string> arguments = {"track", "docking_a", "--until", "170", "--newest", "window", "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Outcome run = run_tandem(arguments);
    EXPECT_EQ(run.status, 0) << testing::PrintToString(options) << ": " << run.errors;
    return Json::parse(run.output).at("errors");
  };
  const auto mean = [](const Json& found, const char* type) -> double { return found[type]["position_mean_m"]; };
  const Json by_default = errors({});
  for (const std::vector<std::string>& options :
       std::vector<std::vector<std::string>>{{"--mode", "B"},
                                             {"--robust"},
                                             {"--model", "white-noise-acceleration"},
                                             {"--surge", "0,2.5", "--yaw-rate", "0.3"},
                                             {"--window-keyframes", "20", "--max-iterations", "2"},
                                             {"--horizons", "1,2"},
                                             {"--delay", "optical=0.01"},
                                             {"--predict", "1", "--window", "10", "--non-holonomic", "soft"}}) {
    SCOPED_TRACE(testing::PrintToString(options));
    const Json found = errors(options);
    EXPECT_NE(mean(found, "all"), mean(by_default, "all")) << "the option has no effect";
    EXPECT_LT(mean(found, "pose"), 1.05 * mean(by_default, "pose"));
    EXPECT_LT(mean(found, "pose"), found["pose"]["raw_position_mean_m"]);
  }
  EXPECT_EQ(run_tandem({"track", "docking_a", "--until", "5", "--quiet"}).output, "");
}

TEST(TrackCommand, UsesHypothesesUnlessModelIsGiven) {
  const auto run = [](std::vector<std::string> options) {
    options.insert(options.begin(), {"track", "docking_a", "--until", "170", "--json"});
    const Outcome outcome = run_tandem(options);
    EXPECT_EQ(outcome.status, 0) << outcome.errors;
    return Json::parse(outcome.output);
  };
  const Json newest = run({}), window = run({"--mode", "A"});
  EXPECT_THAT(newest.at("model"), HasSubstr("motion hypotheses"));
  EXPECT_THAT(window.at("model"), testing::Not(HasSubstr("motion hypotheses")));
  EXPECT_LT(newest["errors"]["position"]["orientation_mean_deg"], window["errors"]["position"]["orientation_mean_deg"]);
  EXPECT_LT(newest["predictions"][1]["position_mean_m"], window["predictions"][1]["position_mean_m"]);
  for (const Json& summary : {newest, window})
    for (const Json& prediction : summary["predictions"]) {
      EXPECT_GT(prediction["position_nees_mean"], 0.5) << prediction;
      EXPECT_LT(prediction["position_nees_mean"], 9) << prediction;
    }
  EXPECT_TRUE(newest["errors"]["pose"].contains("position_nees_mean"));
}

TEST(TrackCommand, TracksChaserByOwnSensors) {
  const ScratchFolder scratch;
  ASSERT_EQ(run_tandem({"simulate", "dive", "--out", scratch.path(), "--minutes", "1"}).status, 0);
  const Outcome run = run_tandem({"track", scratch.path(), "--dvl-scale", "--alignment", "20", "--json"});
  ASSERT_EQ(run.status, 0) << run.errors;
  const Json summary = Json::parse(run.output);
  EXPECT_LT(summary["chaser"]["position_mean_m"], 3.0);
  EXPECT_TRUE(summary["predictions"].empty());
  EXPECT_THAT(run_tandem({"track", scratch.path(), "--until", "30"}).output, HasSubstr("x [m]"));
  const Outcome newest = run_tandem({"track", scratch.path(), "--newest", "hypotheses"});
  EXPECT_EQ(newest.status, 1);
  EXPECT_THAT(newest.errors, HasSubstr("does not support --newest hypotheses"));
  const Outcome mode = run_tandem({"track", scratch.path(), "--mode", "B"});
  EXPECT_EQ(mode.status, 1);
  EXPECT_THAT(mode.errors, HasSubstr("--mode needs a target"));
  const Outcome without = run_tandem({"track", scratch.path(), "--without", "dvl", "--dvl-scale"});
  EXPECT_EQ(without.status, 1);
  EXPECT_THAT(without.errors, HasSubstr("--dvl-scale needs a dvl"));
}

class TrackInterrupt : public testing::TestWithParam<int> {};

TEST_P(TrackInterrupt, EndsWithSummary) {
  const int signal = GetParam();
  const ScratchFolder scratch;
  const int error_fd = open((scratch.path() / "errors").c_str(), O_WRONLY | O_CREAT, 0600);
  const pid_t child = start_tandem({"track", "docking_a", "--realtime"}, scratch.path() / "output", error_fd);
  for (int i = 0; i < 100 && read_file(scratch.path() / "output").find("\n      2.") == std::string::npos; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  kill(child, signal);
  EXPECT_EQ(exit_status(child), 0);
  close(error_fd);
  EXPECT_THAT(read_file(scratch.path() / "output"), HasSubstr("window 60 s: interrupted\n"));
}
INSTANTIATE_TEST_SUITE_P(Signals, TrackInterrupt, testing::Values(SIGINT, SIGTERM));

/// Inserts `more` after the line end at or behind byte `at`.
std::string with(std::string lines, std::size_t at, const std::string& more) {
  return lines.insert(lines.find('\n', at) + 1, more);
}

TEST(TrackCommand, RejectsAndCountsAbsurdFixes) {
  const std::string lines = docking_lines(60);
  const Outcome good = track_lines(lines, {"--json"});
  const Outcome bad =
      track_lines(with(lines, lines.size() / 2, "usbl,29.95,3000,0,0\nusbl,29.96,1e308,0,0\n"), {"--json"});
  ASSERT_EQ(bad.status, 0) << bad.errors;
  const Json summary = Json::parse(bad.output);
  EXPECT_EQ(summary["sensors"][0]["rejected"], 1);
  EXPECT_EQ(summary["sensors"][0]["used"], Json::parse(good.output)["sensors"][0]["used"]);
  EXPECT_EQ(summary["resets"], 0);
  EXPECT_THAT(bad.output, HasSubstr("rejected by the gate"));
  EXPECT_THAT(bad.output, HasSubstr("implausible value"));
  const Outcome off = track_lines(with(lines, lines.size() / 2, "usbl,29.95,3000,0,0\n"), {"--json", "--gate", "off"});
  EXPECT_EQ(Json::parse(off.output)["sensors"][0]["rejected"], 0);
}

TEST(TrackCommand, ReportsSinceWhenTrackIsUnreliable) {
  std::string lines = docking_lines(100);
  std::string wrong;
  for (std::istringstream in(lines); std::getline(in, lines);) {
    const bool fix = lines.starts_with("usbl,") && std::stod(lines.substr(5)) > 40;
    // All wrong fixes are 10 km away, but --gate-reset does not allow a reset.
    wrong += fix ? "usbl," + lines.substr(5, lines.find(',', 5) - 5) + ",10000,0,0\n" : lines + "\n";
  }
  const Outcome run = track_lines(wrong, {"--quiet", "--gate-reset", "100/100", "--bad-after", "20"});
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.errors, ContainsRegex("the track is unreliable since t = 4[0-9]\\.[0-9] s"));
}

/// Returns the lines of docking_a until 100 s, without fixes after 40 s.
std::string lines_without_fixes_after_40_s() {
  std::istringstream lines(docking_lines(100));
  std::string kept;
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("odometry,") || std::stod(line.substr(line.find(',') + 1)) <= 40) kept += line + "\n";
  return kept;
}

TEST(TrackCommand, ReportsLostAndInvalidTarget) {
  const std::string feed = lines_without_fixes_after_40_s();
  const Outcome run = track_lines(feed, {"--json-lines", "--lost-after", "12", "--invalid-after", "25"});
  ASSERT_EQ(run.status, 0) << run.errors;
  std::istringstream lines(run.output);
  std::map<std::string, int> seen;
  for (std::string line; std::getline(lines, line);) {
    const Json update = Json::parse(line);
    if (update["schema"] == "tandem.track/1" || update["t"] < 45) continue;
    const double age = update["sensors"]["usbl"]["age_s"], optical = update["sensors"]["optical"].value("age_s", 1e9);
    const std::string target = update["outputs"]["target"];
    // The clock of all lines may be up to a second behind the newest keyframe.
    if (const double of_target = std::min(age, optical); of_target < 11)
      EXPECT_EQ(target, "aided") << line;
    else if (of_target > 12 && of_target < 24)
      EXPECT_EQ(target, "lost") << line;
    else if (of_target > 25)
      EXPECT_EQ(target, "invalid") << line;
    EXPECT_EQ(update["outputs"]["chaser"], "aided") << line;
    ++seen[target];
  }
  EXPECT_GT(seen["lost"], 5);
  EXPECT_GT(seen["invalid"], 5);
  const ScratchFolder scratch;
  const Outcome table = track_lines(feed, {"--out", scratch.path() / "out", "--plots", "off"});
  ASSERT_EQ(table.status, 0) << table.errors;
  EXPECT_THAT(table.output, ContainsRegex("  target lost, no fix for 2[0-9] s\n"));
  EXPECT_THAT(table.output, ContainsRegex("  target invalid, no fix for 4[0-9] s\n"));
  const std::string rows = read_file(scratch.path() / "out" / "track.csv");
  for (const char* state : {",aided,aided,", ",aided,lost,", ",aided,invalid,"}) EXPECT_THAT(rows, HasSubstr(state));
}

/// A standard deviation that belongs to another linearisation can exceed that of the fix.
TEST(LongTrackCommand, NoRowIsLessCertainThanItsFixAlone) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  const Outcome run = run_tandem({"track", "docking_a", "--newest", "window", "--out", out, "--plots", "off"});
  ASSERT_EQ(run.status, 0) << run.errors;
  std::istringstream rows(read_file(out / "track.csv"));
  std::vector<std::string> names;
  int poses = 0;
  for (std::string row; std::getline(rows, row);) {
    std::vector<std::string> cells;
    std::istringstream line(row);
    for (std::string cell; std::getline(line, cell, ',');) cells.push_back(cell);
    if (names.empty()) {
      names = cells;
      continue;
    }
    if (cells[1] != "pose") continue;
    ++poses;
    for (std::size_t i = 0; i < names.size(); ++i)
      if (names[i] == "sigma_x_m" || names[i] == "sigma_y_m" || names[i] == "sigma_z_m")
        EXPECT_LE(std::stod(cells[i]), 0.137 * (1 + 1e-9)) << cells[0];
  }
  EXPECT_GT(poses, 600);
}

TEST(TrackCommand, LimitsWarningsAboutInvalidLines) {
  std::string garbage;
  for (int i = 0; i < 20'000; ++i) garbage += "sonar,1,2,3\n";
  const Outcome run = track_lines(docking_lines(20) + garbage, {"--quiet"});
  EXPECT_EQ(run.status, 0);
  EXPECT_LT(std::count(run.errors.begin(), run.errors.end(), '\n'), 20);
  EXPECT_THAT(run.errors, HasSubstr("10000 rejected lines so far"));
}

TEST(TrackCommand, HasStatus2IfNothingIsTracked) {
  const ScratchFolder scratch;
  write_small_scenario(scratch);
  const auto input = scratch.write("lines", "odometry,0,0,0,0,0,0,0,1\n");
  const Outcome run = run_tandem({"track", scratch.path(), "--stdin"}, input);
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.errors, HasSubstr("nothing was tracked: no measurement gives the position of the target"));
}

TEST(TrackCommand, RejectsInvalidUsage) {
  const ScratchFolder scratch;
  const auto rejection = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"track", "--out", (scratch.path() / "out").string()});
    const Outcome run = run_tandem(arguments);
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.output, "");
    EXPECT_THAT(run.errors, ContainsRegex("^tandem: [^\n]+\n$"));
    EXPECT_TRUE(files(scratch.path()).empty());
    return run.errors;
  };
  EXPECT_THAT(rejection({"docking_a", "--soften", "--limits", "soft", "--surge", "0,2"}),
              HasSubstr("--soften needs a hard constraint"));
  EXPECT_THAT(rejection({"docking_a", "--rate", "2"}), HasSubstr("--rate needs --json-lines"));
  EXPECT_THAT(rejection({"docking_a", "--covariance", "joint"}), HasSubstr("--covariance needs --json-lines"));
  EXPECT_THAT(rejection({"docking_a", "--model", "steady-course"}), HasSubstr("steady-course"));
  EXPECT_THAT(rejection({"docking_a", "--window", "0"}), HasSubstr("--window takes a positive number, not '0'"));
  EXPECT_THAT(rejection({"docking_a", "--window-keyframes", "2"}), HasSubstr("--window-keyframes takes 3 or more"));
  EXPECT_THAT(rejection({"docking_a", "--predict", "5,x"}), HasSubstr("--predict"));
  EXPECT_THAT(rejection({"docking_a", "--predict", "5,1e300"}), HasSubstr("1e+300 s is too far ahead"));
  EXPECT_THAT(rejection({"docking_a", "--gate", "-1"}), HasSubstr("--gate takes a non-negative number"));
  EXPECT_THAT(rejection({"docking_a", "--gate-reset", "5/4"}), HasSubstr("--gate-reset takes M/N"));
  EXPECT_THAT(rejection({"docking_a", "--lost-after", "0"}),
              HasSubstr("--lost-after takes a positive number, not '0'"));
  EXPECT_THAT(rejection({"docking_a", "--invalid-after", "x"}), HasSubstr("--invalid-after"));
  EXPECT_THAT(rejection({"docking_a", "--lost-after", "60"}), HasSubstr("--invalid-after"));
  EXPECT_THAT(rejection({"docking_a", "--stamps", "h"}), HasSubstr("--stamps takes auto, s, ms, us or ns"));
  EXPECT_THAT(rejection({"docking_a", "--json", "--json-lines"}),
              HasSubstr("--json-lines and --json exclude each other"));
  EXPECT_THAT(rejection({"docking_a", "--alignment", "5"}),
              HasSubstr("--alignment needs a chaser that moves by its own sensors"));
  EXPECT_THAT(rejection({"docking_a", "--dvl-scale"}),
              HasSubstr("--dvl-scale needs a chaser that moves by its own sensors, but docking_a has odometry"));
  EXPECT_THAT(rejection({"docking_a", "--stdin", "--realtime"}),
              HasSubstr("--realtime and --stdin exclude each other"));
  EXPECT_THAT(rejection({"docking_a", "--max-keyframes", "3"}), HasSubstr("unknown option '--max-keyframes'"));
  EXPECT_THAT(rejection({"docking_a", "--noise", "dvl=1,1,1"}), HasSubstr("--noise: unknown noise 'dvl'"));
  EXPECT_THAT(rejection({"dockin_a"}), HasSubstr("docking_a"));
}

}  // namespace
}  // namespace tandem
