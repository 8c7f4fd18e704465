#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/stop.hpp>

namespace tandem {
namespace {

struct Limits {
  const std::atomic<bool>* stop = nullptr;
  double time_limit = HUGE_VAL;
};

std::string stop_message(const Stop& stop) {
  try {
    stop.check("work");
  } catch (const Stopped& stopped) {
    return stopped.what();
  }
  return "";
}

TEST(Stop, IsNotReachedByDefault) {
  EXPECT_FALSE(Stop().reached());
  EXPECT_FALSE(Stop(Limits{}).reached());
  Limits limits;
  Stop().limit(limits);
  EXPECT_EQ(limits.time_limit, HUGE_VAL);
}

TEST(Stop, MessageNamesTheCause) {
  std::atomic<bool> flag = false;
  const Stop by_flag(Limits{.stop = &flag}), by_time(nullptr, 0);
  EXPECT_EQ(stop_message(by_flag), "");
  flag = true;
  EXPECT_EQ(stop_message(by_flag), "work: interrupted");
  EXPECT_EQ(stop_message(by_time), "work: the time limit was reached");
}

TEST(Stop, GraceExtendsOnlyTheTimeLimit) {
  const std::atomic<bool> flag = true;
  EXPECT_FALSE(Stop(nullptr, 0).with_grace().reached());
  EXPECT_TRUE(Stop(nullptr, -1).with_grace().reached());
  EXPECT_TRUE(Stop(&flag).with_grace().reached());
}

TEST(Stop, LimitPassesOnTheRemainingTime) {
  const std::atomic<bool> flag = false;
  Limits limits;
  Stop(&flag, 3600).limit(limits);
  EXPECT_EQ(limits.stop, &flag);
  EXPECT_GT(limits.time_limit, 1800);
  EXPECT_LE(limits.time_limit, 3600);
  Stop(&flag, -1).limit(limits);
  EXPECT_EQ(limits.time_limit, 0);
}

}  // namespace
}  // namespace tandem
