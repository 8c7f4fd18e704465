#include <algorithm>
#include <chrono>
#include <csignal>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "docking_lines.hpp"
#include "run_tandem.hpp"

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
    mkfifo((folder_ / "pipe").c_str(), 0600);
    pipe_ = open((folder_ / "pipe").c_str(), O_RDWR);  // never ends
    const int errors = open((folder_ / "errors").c_str(), O_WRONLY | O_CREAT, 0600);
    options.insert(options.begin(), {"track", folder_.string(), "--stdin", "--json-lines"});
    child_ = start_tandem(options, folder_ / "printed", errors, folder_ / "pipe");
    close(errors);
  }
  ~LiveTrack() {
    kill_now();
    close(pipe_);
  }
  LiveTrack(const LiveTrack&) = delete;

  void tell(const std::string& lines) const {
    EXPECT_EQ(::write(pipe_, lines.data(), lines.size()), ssize_t(lines.size()));
  }
  void kill_now() {
    if (child_ < 0) return;
    kill(child_, SIGKILL);
    EXPECT_EQ(exit_status(std::exchange(child_, -1)), -1) << "it was not there any more";
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
    for (int i = 0; i < 600 && live.printed() < 25; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(50));
    rows = live.printed();
    ASSERT_GE(rows, 25);
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
  for (int i = 0; i < 600 && !std::filesystem::exists(scratch.path() / "out.partial"); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const Outcome second = run_tandem({"track", "docking_a", "--until", "5", "--out", scratch.path() / "out"});
  EXPECT_EQ(second.status, 1);
  EXPECT_EQ(second.output, "");
  EXPECT_THAT(second.errors, HasSubstr("another track is writing to "));
}

}  // namespace
}  // namespace tandem
