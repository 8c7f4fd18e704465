#include <chrono>
#include <csignal>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/support/isolated.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const std::atomic<bool> go_on{false};

IsolatedRun shell(const std::string& script, double seconds = 60, const std::atomic<bool>& stop = go_on) {
  return run_isolated("/bin/sh", {"sh", "-c", script}, seconds, stop);
}

TEST(Isolated, GivesTheOutputAndItsMemory) {
  const IsolatedRun run = shell("head -c 200000 /dev/zero | tr '\\0' x");
  EXPECT_EQ(run.failure, "");
  EXPECT_EQ(run.output, std::string(200000, 'x')) << "more than a pipe holds";
  const IsolatedRun large = shell("head -c 256000000 /dev/zero | tail -c 256000000 | wc -c");  // tail keeps it all
  EXPECT_THAT(large.output, HasSubstr("256000000"));
  EXPECT_GT(large.peak_memory - run.peak_memory, 150e6);
}

TEST(Isolated, SurvivesWhatHappensInIt) {
  EXPECT_THAT(shell("kill -SEGV $$").failure, HasSubstr("signal 11"));
  EXPECT_EQ(shell("echo half; exit 3").failure, "its process ended without a result (exit status 3)");
  EXPECT_EQ(shell("echo half; exit 3").output, "");
  EXPECT_THAT(shell("exec sleep 300", 0.1).failure, HasSubstr("time limit"));
  EXPECT_EQ(run_isolated("/nowhere/program", {"program"}, 60, go_on).failure, "/nowhere/program cannot be run");
}

TEST(Isolated, IsToldToStopByTermination) {
  const std::atomic<bool> stop{true};
  const IsolatedRun killed = shell("exec sleep 300", 60, stop);
  EXPECT_TRUE(killed.stopped);
  EXPECT_EQ(killed.failure, "it was stopped before it had begun");
  // One that heeds it gives what it has.
  std::atomic<bool> later{false};
  const ScratchFolder scratch;
  const std::string ready = (scratch.path() / "ready").string();
  std::thread waits([&] {
    while (!std::filesystem::exists(ready)) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    later = true;
  });
  const IsolatedRun heeds =
      shell("trap 'echo ended; exit 0' TERM; touch '" + ready + "'; while :; do sleep 0.01; done", 60, later);
  waits.join();
  EXPECT_EQ(heeds.failure, "");
  EXPECT_EQ(heeds.output, "ended\n");
  EXPECT_FALSE(heeds.stopped);
}

/// A caller with threads may fork: the child does nothing but become the program.
TEST(Isolated, TheCallerMayHaveThreads) {
  std::atomic<bool> end{false};
  std::vector<std::thread> threads;
  for (int i = 0; i < 2; ++i)
    threads.emplace_back([&] {
      while (!end) std::string(1 << 16, 'x').clear();  // the allocator's locks are taken again and again
    });
  for (int i = 0; i < 50; ++i) EXPECT_EQ(shell("echo " + std::to_string(i), 10).output, std::to_string(i) + "\n");
  end = true;
  for (std::thread& thread : threads) thread.join();
}

/// An interrupt from the terminal reaches the whole group: the caller alone says what becomes of it.
TEST(Isolated, DoesNotHearTheTerminalsInterrupt) { EXPECT_EQ(shell("kill -INT $$; echo on").output, "on\n"); }

}  // namespace
}  // namespace tandem
