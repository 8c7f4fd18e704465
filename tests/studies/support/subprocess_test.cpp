#include <chrono>
#include <csignal>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/support/subprocess.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const std::atomic<bool> go_on{false};

SubprocessRun shell(const std::string& script, double seconds = 60, const std::atomic<bool>& stop = go_on) {
  return run_subprocess("/bin/sh", {"sh", "-c", script}, seconds, stop);
}

TEST(Subprocess, ReturnsOutputAndPeakMemory) {
  const SubprocessRun run = shell("head -c 200000 /dev/zero | tr '\\0' x");
  EXPECT_EQ(run.failure, "");
  EXPECT_EQ(run.output, std::string(200000, 'x')) << "more than the buffer of a pipe";
  const SubprocessRun large = shell("head -c 256000000 /dev/zero | tail -c 256000000 | wc -c");  // tail keeps all input
  EXPECT_THAT(large.output, HasSubstr("256000000"));
  EXPECT_GT(large.peak_memory - run.peak_memory, 150e6);
}

TEST(Subprocess, ReportsFailures) {
  EXPECT_THAT(shell("kill -SEGV $$").failure, HasSubstr("signal 11"));
  EXPECT_EQ(shell("echo half; exit 3").failure, "the process ended without a result (exit status 3)");
  EXPECT_EQ(shell("echo half; exit 3").output, "");
  EXPECT_THAT(shell("exec sleep 300", 0.1).failure, HasSubstr("time limit"));
  EXPECT_EQ(run_subprocess("/nowhere/program", {"program"}, 60, go_on).failure, "/nowhere/program cannot be run");
}

TEST(Subprocess, StopsBySigterm) {
  const std::atomic<bool> stop{true};
  const SubprocessRun killed = shell("exec sleep 300", 60, stop);
  EXPECT_TRUE(killed.stopped);
  EXPECT_EQ(killed.failure, "the process was interrupted before it had a result");
  // A process that handles SIGTERM returns its result so far.
  std::atomic<bool> later{false};
  const ScratchFolder scratch;
  const std::string ready = (scratch.path() / "ready").string();
  std::thread waiter([&] {
    while (!std::filesystem::exists(ready)) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    later = true;
  });
  const SubprocessRun handled =
      shell("trap 'echo ended; exit 0' TERM; touch '" + ready + "'; while :; do sleep 0.01; done", 60, later);
  waiter.join();
  EXPECT_EQ(handled.failure, "");
  EXPECT_EQ(handled.output, "ended\n");
  EXPECT_FALSE(handled.stopped);
}

/// A caller with threads may fork, since the child only executes the program.
TEST(Subprocess, CallerMayHaveThreads) {
  std::atomic<bool> end{false};
  std::vector<std::thread> threads;
  for (int i = 0; i < 2; ++i)
    threads.emplace_back([&] {
      while (!end) std::string(1 << 16, 'x').clear();  // takes the locks of the allocator
    });
  for (int i = 0; i < 50; ++i) EXPECT_EQ(shell("echo " + std::to_string(i), 10).output, std::to_string(i) + "\n");
  end = true;
  for (std::thread& thread : threads) thread.join();
}

TEST(Subprocess, FindsProgramsInPath) {
  EXPECT_EQ(find_program("sh").filename(), "sh");
  EXPECT_TRUE(find_program("no-such-program").empty());
}

/// A terminal sends SIGINT to the whole process group, but only the caller decides whether to stop.
TEST(Subprocess, IgnoresSigint) { EXPECT_EQ(shell("kill -INT $$; echo on").output, "on\n"); }

}  // namespace
}  // namespace tandem
