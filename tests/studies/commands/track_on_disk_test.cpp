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

/// A process `track --stdin` with the settings of docking_a, which reads lines from a pipe until it is killed.
class TrackProcess {
 public:
  TrackProcess(const ScratchFolder& scratch, std::vector<std::string> options) : folder_(scratch.path()) {
    scratch.write("scenario.yaml", read_file(docking() / "scenario.yaml"));
    mkfifo((folder_ / "pipe").c_str(), 0600);  // exists already for a second process
    pipe_ =
        open((folder_ / "pipe").c_str(), O_RDWR | O_CLOEXEC);  // open for reading too, so that the input does not end
    const int errors = open((folder_ / "errors").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    options.insert(options.begin(), {"track", folder_.string(), "--stdin", "--json-lines"});
    child_ = start_tandem(options, folder_ / "printed", errors, folder_ / "pipe");
    close(errors);
  }
  ~TrackProcess() {
    kill_now();
    if (pipe_ >= 0) close(pipe_);
  }
  TrackProcess(const TrackProcess&) = delete;

  void send(const std::string& lines) const {
    for (std::size_t at = 0; at < lines.size();) {
      const ssize_t n = ::write(pipe_, lines.data() + at, lines.size() - at);
      ASSERT_GT(n, 0);
      at += std::size_t(n);
    }
  }
  void kill_now() {
    if (child_ < 0) return;
    kill(child_, SIGKILL);
    EXPECT_EQ(exit_status(std::exchange(child_, -1)), -1) << "the process ended before";
  }
  /// Ends the input, waits for the process, and returns its exit status.
  int end() {
    close(std::exchange(pipe_, -1));
    return exit_status(std::exchange(child_, -1));
  }
  void wait_for(const std::function<bool()>& what) const {
    bool reached = what();  // evaluated once per round, since the condition may become false again
    for (int i = 0; i < 1200 && !reached; ++i, reached = what())
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_TRUE(reached) << read_file(folder_ / "errors");
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

TEST(TrackOnDisk, PartialResultsAreOnDiskWithinFiveSeconds) {
  const ScratchFolder scratch;
  const auto partial = scratch.path() / "out.partial";
  std::ptrdiff_t rows = 0;
  {
    TrackProcess live(scratch, {"--out", scratch.path() / "out"});
    live.send(docking_lines(30));
    live.wait_for([&] { return live.printed() >= 25; });
    rows = live.printed();
    const auto by = Clock::now() + std::chrono::seconds(5);
    while (Clock::now() < by && TrackProcess::lines_in(partial / "track.csv") <= rows)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    live.kill_now();
  }
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "out")) << "the output folder is complete or missing";
  EXPECT_THAT(files(partial), UnorderedElementsAre("chaser.tum", "target.tum", "track.csv"));
  const std::string track = read_file(partial / "track.csv");
  EXPECT_GE(std::count(track.begin(), track.end(), '\n'), rows + 1);
  std::istringstream lines(track);
  std::string header;
  std::getline(lines, header);
  for (std::string line; std::getline(lines, line);)
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), std::count(header.begin(), header.end(), ',')) << line;
  EXPECT_EQ(track.back(), '\n');

  // The next run keeps the partial results of a killed run, without the incomplete last line, and reports it.
  std::ofstream(partial / "track.csv", std::ios::app) << "31.0,gat";
  const Outcome next = run_tandem({"track", "docking_a", "--until", "5", "--out", scratch.path() / "out", "--quiet"});
  EXPECT_EQ(next.status, 0);
  EXPECT_THAT(next.errors, HasSubstr("were moved to " + partial.string() + "-1\n"));
  EXPECT_EQ(read_file(partial.string() + "-1/track.csv"), track);
  EXPECT_FALSE(std::filesystem::exists(partial));
  EXPECT_TRUE(std::filesystem::exists(scratch.path() / "out" / "track.csv"));
}

TEST(TrackOnDisk, RejectsSecondTrackToSameFolder) {
  const ScratchFolder scratch;
  TrackProcess live(scratch, {"--out", scratch.path() / "out"});
  live.send(docking_lines(10));
  live.wait_for([&] { return std::filesystem::exists(scratch.path() / "out.partial"); });
  const Outcome second = run_tandem({"track", "docking_a", "--until", "5", "--out", scratch.path() / "out"});
  EXPECT_EQ(second.status, 1);
  EXPECT_EQ(second.output, "");
  EXPECT_THAT(second.errors, HasSubstr("another track is writing to "));
}

TEST(TrackOnDisk, RejectsAndKeepsFolderOfUser) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out", partial = scratch.path() / "out.partial";
  const std::vector<std::string> track = {"track",   "docking_a", "--until", "5", "--quiet",
                                          "--plots", "off",       "--out",   out};
  std::filesystem::create_directory(partial);
  for (const char* file : {"notes.txt", "track.csv"}) {
    SCOPED_TRACE(file);
    scratch.write(std::string("out.partial/") + file, "text of the user");
    const Outcome run = run_tandem(track);
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(std::count(run.errors.begin(), run.errors.end(), '\n'), 1);
    EXPECT_THAT(run.errors, HasSubstr(std::string(file) + "'; move that file or change --out"));
    EXPECT_THAT(files(partial), UnorderedElementsAre(file));
    EXPECT_EQ(read_file(partial / file), "text of the user");
    EXPECT_FALSE(std::filesystem::exists(partial.string() + "-1"));
    EXPECT_FALSE(std::filesystem::exists(out));
    std::filesystem::remove(partial / file);
  }
  const Outcome empty = run_tandem(track);
  EXPECT_EQ(empty.status, 0) << empty.errors;
  EXPECT_EQ(empty.errors, "");
}

/// Returns the rows of a track.csv as text by column name.
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

/// Returns the largest difference of the target coordinates of two rows [m]. Expects the same empty cells.
double difference(const std::map<std::string, std::string>& a, const std::map<std::string, std::string>& b) {
  double most = 0;
  for (const char* axis : {"x_m", "y_m", "z_m"}) {
    EXPECT_EQ(a.at(axis).empty(), b.at(axis).empty()) << a.at("t");
    if (!a.at(axis).empty()) most = std::max(most, std::abs(std::stod(a.at(axis)) - std::stod(b.at(axis))));
  }
  return most;
}

/// The environment variable TANDEM_KILLS sets the number of kills.
TEST(TrackOnDisk, KilledProcessResumesWithSameResults) {
  const char* requested = std::getenv("TANDEM_KILLS");
  const int kills = requested ? std::stoi(requested) : kSanitized ? 2 : 4;
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out", whole = scratch.path() / "whole", snapshot = scratch.path() / "snapshot";
  const char* const until = kSanitized ? "250" : "500";  // s: more than four windows
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
  double max_difference = 0, max_later = 0, max_world = 0;  // m
  double error = 0;                                         // relative to the undisturbed run
  for (int i = 0; i < kills; ++i) {
    SCOPED_TRACE(i);
    double from = -HUGE_VAL;  // time at which the run resumed
    const int row = std::uniform_int_distribution<int>(1, int(undisturbed.size()) / 2)(random);
    const int errors = open((scratch.path() / "errors").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const pid_t child = start_tandem(arguments, scratch.path() / "printed", errors);
    close(errors);
    const auto by = Clock::now() + std::chrono::seconds(60);
    while (Clock::now() < by && TrackProcess::lines_in(scratch.path() / "printed") < row)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    kill(child, SIGKILL);
    if (exit_status(child) == -1) {  // otherwise it had finished before
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
      double& worst = std::stod(rows[k].at("t")) <= from + 60 ? max_difference : max_later;
      worst = std::max(worst, difference(rows[k], undisturbed[k]));
    }
    error = std::max(error, mean_error(out) / mean_error(whole));
    const auto there = poses(read_tum(out / "chaser.tum")), before = poses(read_tum(whole / "chaser.tum"));
    for (std::size_t k = 0; k < there.size(); ++k)
      max_world = std::max(max_world, (there[k].value.translation() - before[k].value.translation()).norm());
    std::filesystem::remove(snapshot);  // so that the next run starts from scratch
    std::filesystem::remove_all(out.string() + ".partial");
  }
  EXPECT_GT(from_a_snapshot, 0);
  EXPECT_LT(max_later, 0.1) << "difference of the relative position one window after the resumption [m]";
  EXPECT_LT(error, 1.01);
  std::printf(
      "%d kills, %d of them after a snapshot: mean error at most %.6f times that of the undisturbed run; relative "
      "position within %.2g m, one window later within %.2g m, chaser in the world within %.2g m\n",
      kills, from_a_snapshot, error, max_difference, max_later, max_world);
}

TEST(TrackOnDisk, StoppedRunResumesWithAllResults) {
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

TEST(TrackOnDisk, StreamResumesWithNewLines) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out", partial = scratch.path() / "out.partial";
  const std::vector<std::string> options = {"--out",   out,   "--plots", "off", "--snapshot", scratch.path() / "s",
                                            "--every", "0.02"};
  const std::string until_100 = docking_lines(100), until_108 = docking_lines(108), until_200 = docking_lines(200);
  std::ptrdiff_t rows = 0;
  {
    TrackProcess live(scratch, options);
    live.send(until_100);
    live.wait_for(
        [&] { return live.printed() > 90 && TrackProcess::lines_in(partial / "track.csv") > live.printed(); });
    rows = live.printed();
    live.kill_now();
  }
  std::ofstream(partial / "track.csv", std::ios::app) << "101.0,gat";
  {
    TrackProcess live(scratch, options);
    live.send(until_200.substr(until_108.size()));
    EXPECT_EQ(live.end(), 0) << read_file(scratch.path() / "errors");
  }
  const std::string errors = read_file(scratch.path() / "errors");
  ASSERT_THAT(errors, testing::ContainsRegex("resuming from .*t = "));
  const double known = std::stod(errors.substr(errors.find("t = ") + 4));  // lines after the snapshot are lost
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
    EXPECT_TRUE(row.at("new_keyframe") == "1" ? t > before : t >= before)
        << t << " s: rows must be in order and unique";
    before = t;
    if (!undisturbed.contains(row.at("t")) || (t > known && t < 168)) continue;
    ++compared;
    EXPECT_LT(difference(row, undisturbed.at(row.at("t"))), t <= known ? 1e-9 : 0.3) << "at " << t << " s";
  }
  EXPECT_GT(compared, 85);
  EXPECT_TRUE(std::filesystem::exists(scratch.path() / "s")) << "the snapshot is kept for the next run";
}

TEST(TrackOnDisk, RejectsAndKeepsFileThatIsNotASnapshot) {
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
  EXPECT_THAT(why({"--snapshot", file}), HasSubstr("s is not a snapshot of tandem track"));
  EXPECT_EQ(read_file(file), "t,x,y,z\n");
  EXPECT_THAT(why({"--snapshot", scratch.path()}), HasSubstr("--snapshot takes a file name"));
  EXPECT_THAT(why({"--snapshot", scratch.path() / "none" / "s"}), HasSubstr("cannot write to "));
  EXPECT_THAT(why({"--every", "5"}), HasSubstr("--every needs --snapshot"));
}

}  // namespace
}  // namespace tandem
