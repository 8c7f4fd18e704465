#include <algorithm>
#include <chrono>
#include <csignal>
#include <functional>
#include <random>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include <tandem/studies/scenario/table.hpp>
#include <tandem/studies/support/csv.hpp>

#include "docking_lines.hpp"
#include "run_tandem.hpp"
#include "sanitized.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::UnorderedElementsAre;
using Clock = std::chrono::steady_clock;

/// A live track of docking_a's settings, which takes what is written to it until it is killed.
class LiveTrack {
 public:
  LiveTrack(const ScratchFolder& scratch, std::vector<std::string> options) : folder_(scratch.path()) {
    scratch.write("scenario.yaml", read_file(docking() / "scenario.yaml"));
    mkfifo((folder_ / "pipe").c_str(), 0600);                      // there already, the second time
    pipe_ = open((folder_ / "pipe").c_str(), O_RDWR | O_CLOEXEC);  // never ends
    const int errors = open((folder_ / "errors").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    options.insert(options.begin(), {"track", folder_.string(), "--stdin", "--json-lines"});
    child_ = start_tandem(options, folder_ / "printed", errors, folder_ / "pipe");
    close(errors);
  }
  ~LiveTrack() {
    kill_now();
    if (pipe_ >= 0) close(pipe_);
  }
  LiveTrack(const LiveTrack&) = delete;

  void tell(const std::string& lines) const {
    for (std::size_t at = 0; at < lines.size();) {
      const ssize_t n = ::write(pipe_, lines.data() + at, lines.size() - at);
      ASSERT_GT(n, 0);
      at += std::size_t(n);
    }
  }
  void kill_now() {
    if (child_ < 0) return;
    kill(child_, SIGKILL);
    EXPECT_EQ(exit_status(std::exchange(child_, -1)), -1) << "it was not there any more";
  }
  /// Nothing more comes: its exit status.
  int end() {
    close(std::exchange(pipe_, -1));
    return exit_status(std::exchange(child_, -1));
  }
  void wait_for(const std::function<bool()>& what) const {
    bool there = what();  // it may be over when it is asked again
    for (int i = 0; i < 1200 && !there; ++i, there = what()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_TRUE(there) << read_file(folder_ / "errors");
  }
  std::ptrdiff_t printed() const { return lines_in(folder_ / "printed"); }
  static std::ptrdiff_t lines_in(const std::filesystem::path& file) {
    if (!std::filesystem::exists(file)) return 0;
    const std::string text = read_file(file);
    return std::count(text.begin(), text.end(), '\n');
  }

 private:
  std::filesystem::path folder_;
  int pipe_;
  pid_t child_ = -1;
};

TEST(TrackOnDisk, WhatWasFoundIsThereFiveSecondsLaterThoughNothingComesAndItIsKilled) {
  const ScratchFolder scratch;
  const auto partial = scratch.path() / "out.partial";
  std::ptrdiff_t rows = 0;
  {
    LiveTrack live(scratch, {"--out", scratch.path() / "out"});
    live.tell(docking_lines(30));
    live.wait_for([&] { return live.printed() >= 25; });
    rows = live.printed();
    const auto by = Clock::now() + std::chrono::seconds(5);
    while (Clock::now() < by && LiveTrack::lines_in(partial / "track.csv") <= rows)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    live.kill_now();
  }
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "out")) << "as a whole or not at all";
  EXPECT_THAT(files(partial), UnorderedElementsAre("chaser.tum", "target.tum", "track.csv"));
  const std::string track = read_file(partial / "track.csv");
  EXPECT_GE(std::count(track.begin(), track.end(), '\n'), rows + 1);
  std::istringstream lines(track);
  std::string header;
  std::getline(lines, header);
  for (std::string line; std::getline(lines, line);)
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), std::count(header.begin(), header.end(), ',')) << line;
  EXPECT_EQ(track.back(), '\n');

  // What a killed run has left is kept, without its half line, and the next says so.
  std::ofstream(partial / "track.csv", std::ios::app) << "31.0,gat";
  const Outcome next = run_tandem({"track", "docking_a", "--until", "5", "--out", scratch.path() / "out", "--quiet"});
  EXPECT_EQ(next.status, 0);
  EXPECT_THAT(next.errors, HasSubstr("it is kept in " + partial.string() + "-1\n"));
  EXPECT_EQ(read_file(partial.string() + "-1/track.csv"), track);
  EXPECT_FALSE(std::filesystem::exists(partial));
  EXPECT_TRUE(std::filesystem::exists(scratch.path() / "out" / "track.csv"));
}

TEST(TrackOnDisk, TwoTracksDoNotWriteToOneFolder) {
  const ScratchFolder scratch;
  LiveTrack live(scratch, {"--out", scratch.path() / "out"});
  live.tell(docking_lines(10));
  live.wait_for([&] { return std::filesystem::exists(scratch.path() / "out.partial"); });
  const Outcome second = run_tandem({"track", "docking_a", "--until", "5", "--out", scratch.path() / "out"});
  EXPECT_EQ(second.status, 1);
  EXPECT_EQ(second.output, "");
  EXPECT_THAT(second.errors, HasSubstr("another track is writing to "));
}

TEST(TrackOnDisk, AFolderOfSomebodyElsesIsRefusedAndLeftAsItIs) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out", partial = scratch.path() / "out.partial";
  const std::vector<std::string> track = {"track",   "docking_a", "--until", "5", "--quiet",
                                          "--plots", "off",       "--out",   out};
  std::filesystem::create_directory(partial);
  for (const char* file : {"notes.txt", "track.csv"}) {
    SCOPED_TRACE(file);
    scratch.write(std::string("out.partial/") + file, "half a line");
    const Outcome run = run_tandem(track);
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(std::count(run.errors.begin(), run.errors.end(), '\n'), 1);
    EXPECT_THAT(run.errors, HasSubstr(std::string(file) + "' is not of one: move it or change --out"));
    EXPECT_THAT(files(partial), UnorderedElementsAre(file));
    EXPECT_EQ(read_file(partial / file), "half a line");
    EXPECT_FALSE(std::filesystem::exists(partial.string() + "-1"));
    EXPECT_FALSE(std::filesystem::exists(out));
    std::filesystem::remove(partial / file);
  }
  const Outcome empty = run_tandem(track);
  EXPECT_EQ(empty.status, 0) << empty.errors;
  EXPECT_EQ(empty.errors, "");
}

/// Rows of a track.csv, each as text by column.
std::vector<std::map<std::string, std::string>> rows_of(const std::filesystem::path& file) {
  std::istringstream text(read_file(file));
  std::string line;
  std::getline(text, line);
  const std::vector<std::string> names = csv_cells(line);
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(text, line)) {
    const std::vector<std::string> cells = csv_cells(line);
    for (std::size_t i = rows.size(), k = 0; k < names.size(); ++k) {
      rows.resize(i + 1);
      rows[i][names[k]] = cells.at(k);
    }
  }
  return rows;
}

/// How far two rows have the target from one another [m]; where both have one.
double apart(const std::map<std::string, std::string>& a, const std::map<std::string, std::string>& b) {
  double most = 0;
  for (const char* axis : {"x_m", "y_m", "z_m"}) {
    EXPECT_EQ(a.at(axis).empty(), b.at(axis).empty()) << a.at("t");
    if (!a.at(axis).empty()) most = std::max(most, std::abs(std::stod(a.at(axis)) - std::stod(b.at(axis))));
  }
  return most;
}

/// TANDEM_KILLS in the environment says how many; docs/results.md has what a hundred gave.
TEST(TrackOnDisk, KilledAtRandomMomentsItGoesOnAsThoughNothingHadBeen) {
  const char* asked = std::getenv("TANDEM_KILLS");
  const int kills = asked ? std::stoi(asked) : kSanitized ? 2 : 4;
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out", whole = scratch.path() / "whole", snapshot = scratch.path() / "snapshot";
  const char* const until = kSanitized ? "250" : "500";  // s: four windows' length
  const auto track = [until](const std::filesystem::path& to) {
    return std::vector<std::string>{"track", "docking_a",    "--until", until, "--plots",
                                    "off",   "--json-lines", "--out",   to};
  };
  ASSERT_EQ(run_tandem(track(whole)).status, 0);
  const auto undisturbed = rows_of(whole / "track.csv");
  std::vector<std::string> arguments = track(out);
  arguments.insert(arguments.end(), {"--snapshot", snapshot, "--every", "0.02"});
  std::mt19937 random(20261122);
  int from_a_snapshot = 0;
  const auto mean_error = [](const std::filesystem::path& folder) -> double {
    return nlohmann::json::parse(read_file(folder / "summary.json"))["errors"]["all"]["position_mean_m"];
  };
  double most = 0, most_later = 0, most_in_the_world = 0, error = 0;  // m, m, of the undisturbed
  for (int i = 0; i < kills; ++i) {
    SCOPED_TRACE(i);
    double from = -HUGE_VAL;  // where it went on
    const int row = std::uniform_int_distribution<int>(1, int(undisturbed.size()) / 2)(random);
    const int errors = open((scratch.path() / "errors").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const pid_t child = start_tandem(arguments, scratch.path() / "printed", errors);
    close(errors);
    const auto by = Clock::now() + std::chrono::seconds(60);
    while (Clock::now() < by && LiveTrack::lines_in(scratch.path() / "printed") < row)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    kill(child, SIGKILL);
    if (exit_status(child) == -1) {  // else it was done already
      from_a_snapshot += std::filesystem::exists(snapshot);
      const Outcome rest = run_tandem(arguments);
      ASSERT_EQ(rest.status, 0) << rest.errors;
      if (const auto at = rest.errors.find("t = "); at != std::string::npos)
        from = std::stod(rest.errors.substr(at + 4));
    }
    const auto rows = rows_of(out / "track.csv");
    ASSERT_EQ(rows.size(), undisturbed.size());
    for (std::size_t k = 0; k < rows.size(); ++k) {
      ASSERT_EQ(rows[k].at("t"), undisturbed[k].at("t"));
      double& worst = std::stod(rows[k].at("t")) <= from + 60 ? most : most_later;
      worst = std::max(worst, apart(rows[k], undisturbed[k]));
    }
    error = std::max(error, mean_error(out) / mean_error(whole));
    const auto there = poses(read_tum(out / "chaser.tum")), before = poses(read_tum(whole / "chaser.tum"));
    for (std::size_t k = 0; k < there.size(); ++k)
      most_in_the_world =
          std::max(most_in_the_world, (there[k].value.translation() - before[k].value.translation()).norm());
    std::filesystem::remove(snapshot);  // the next run may go on from there
    std::filesystem::remove_all(out.string() + ".partial");
  }
  EXPECT_GT(from_a_snapshot, 0);
  EXPECT_LT(most_later, 0.1) << "m, of the relative position, a window later";
  EXPECT_LT(error, 1.01);
  std::printf(
      "%d kills, %d of them after a snapshot: mean error at most %.6f times the undisturbed; relative position "
      "within %.2g m, a window later within %.2g m, the chaser in the world within %.2g m\n",
      kills, from_a_snapshot, error, most, most_later, most_in_the_world);
}

TEST(TrackOnDisk, ARunThatWasStoppedGoesOnWithAllItsResults) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out", whole = scratch.path() / "whole";
  const auto track = [](const std::filesystem::path& to, const char* until) {
    return std::vector<std::string>{"track", "docking_a", "--until", until, "--plots", "off", "--quiet", "--out", to};
  };
  ASSERT_EQ(run_tandem(track(whole, "160")).status, 0);
  for (const char* until : {"100", "100", "160"}) {
    std::vector<std::string> arguments = track(out, until);
    arguments.insert(arguments.end(), {"--snapshot", scratch.path() / "snapshot", "--every", "0.02"});
    const Outcome outcome = run_tandem(arguments);
    ASSERT_EQ(outcome.status, 0) << outcome.errors;
  }
  const auto expected = rows_of(whole / "track.csv"), found = rows_of(out / "track.csv");
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t k = 0; k < found.size(); ++k) EXPECT_EQ(found[k].at("t"), expected[k].at("t"));
}

TEST(TrackOnDisk, AStreamGoesOnWithWhatComesAndSoDoItsResults) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out", partial = scratch.path() / "out.partial";
  const std::vector<std::string> options = {"--out",   out,   "--plots", "off", "--snapshot", scratch.path() / "s",
                                            "--every", "0.02"};
  const std::string until_100 = docking_lines(100), until_108 = docking_lines(108), until_200 = docking_lines(200);
  std::ptrdiff_t rows = 0;
  {
    LiveTrack live(scratch, options);
    live.tell(until_100);
    live.wait_for([&] { return live.printed() > 90 && LiveTrack::lines_in(partial / "track.csv") > live.printed(); });
    rows = live.printed();
    live.kill_now();
  }
  std::ofstream(partial / "track.csv", std::ios::app) << "101.0,gat";
  {
    LiveTrack live(scratch, options);
    live.tell(until_200.substr(until_108.size()));
    EXPECT_EQ(live.end(), 0) << read_file(scratch.path() / "errors");
  }
  const std::string said = read_file(scratch.path() / "errors");
  ASSERT_THAT(said, testing::ContainsRegex("going on from .*t = "));
  const double known = std::stod(said.substr(said.find("t = ") + 4));  // what came since, and was not in it, is lost
  const auto found = rows_of(out / "track.csv");
  const Outcome all = run_tandem({"track", scratch.path(), "--stdin", "--out", scratch.path() / "whole"},
                                 scratch.write("lines", until_200));
  ASSERT_EQ(all.status, 0) << all.errors;
  std::map<std::string, std::map<std::string, std::string>> undisturbed;
  for (const auto& row : rows_of(scratch.path() / "whole" / "track.csv")) undisturbed[row.at("t")] = row;
  EXPECT_GE(std::ptrdiff_t(found.size()), rows + 80);
  double before = -1;
  int compared = 0;
  for (const auto& row : found) {
    const double t = std::stod(row.at("t"));
    EXPECT_TRUE(row.at("new_keyframe") == "1" ? t > before : t >= before) << t << " s: in order, none twice";
    before = t;
    if (!undisturbed.contains(row.at("t")) || (t > known && t < 168)) continue;
    ++compared;
    EXPECT_LT(apart(row, undisturbed.at(row.at("t"))), t <= known ? 1e-9 : 0.3) << "at " << t << " s, beyond a window";
  }
  EXPECT_GT(compared, 85);
  EXPECT_TRUE(std::filesystem::exists(scratch.path() / "s")) << "what comes next may go on from there";
}

TEST(TrackOnDisk, WhatIsNoSnapshotIsRefusedAndLeftAsItIs) {
  const ScratchFolder scratch;
  const auto file = scratch.write("s", "t,x,y,z\n");
  const auto why = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"track", "docking_a", "--until", "5"});
    const Outcome run = run_tandem(options);
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.output, "");
    EXPECT_EQ(std::count(run.errors.begin(), run.errors.end(), '\n'), 1);
    return run.errors;
  };
  EXPECT_THAT(why({"--snapshot", file}), HasSubstr("s is no snapshot of tandem track"));
  EXPECT_EQ(read_file(file), "t,x,y,z\n");
  EXPECT_THAT(why({"--snapshot", scratch.path()}), HasSubstr("--snapshot is a file's name"));
  EXPECT_THAT(why({"--snapshot", scratch.path() / "none" / "s"}), HasSubstr("nothing can be written to "));
  EXPECT_THAT(why({"--every", "5"}), HasSubstr("--every is how often a --snapshot is written: give both"));
}

}  // namespace
}  // namespace tandem
