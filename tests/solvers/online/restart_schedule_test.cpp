#include <vector>

#include <gtest/gtest.h>

#include <tandem/solvers/online/restart_schedule.hpp>

namespace tandem::detail {
namespace {

TEST(RestartSchedule, DoublesTheIntervalWhileTheWindowIsComplete) {
  RestartSchedule schedule;
  std::vector<double> restarts;
  for (int t = 0; t <= 100; ++t)
    if (schedule.due(1000 + t, t, t < 50, 0.0)) restarts.push_back(t);
  EXPECT_EQ(restarts, (std::vector<double>{5, 10, 20, 40}));
}

TEST(RestartSchedule, RestartsOnASurpriseAtMostEveryFiveSeconds) {
  RestartSchedule schedule;
  std::vector<double> restarts;
  for (int t = 0; t <= 20; ++t)
    if (schedule.due(t, 60, false, t < 3 ? 0.5 : 1.0)) restarts.push_back(t);
  EXPECT_EQ(restarts, (std::vector<double>{3, 9, 15}));
}

}  // namespace
}  // namespace tandem::detail
