#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <tandem/studies/online/reorder_buffer.hpp>

namespace tandem {
namespace {

TEST(ReorderBuffer, ReleasesOrderedLinesAtOnce) {
  ReorderBuffer<int> buffer;
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(buffer.add(0.1 * i, i));
    EXPECT_EQ(buffer.take(), i);
    EXPECT_FALSE(buffer.take());
  }
}

TEST(ReorderBuffer, BringsLinesIntoOrderOnceItKnowsTheirDelays) {
  std::mt19937 generator(2);
  std::uniform_real_distribution<double> delay(0, 30);
  std::multimap<double, int> arrivals;
  for (int i = 0; i < 6000; ++i) arrivals.emplace(0.1 * i + delay(generator), i);
  ReorderBuffer<int> buffer;
  std::vector<int> released;
  int too_late = 0;
  for (const auto& [t, i] : arrivals) {
    too_late += !buffer.add(0.1 * i, i);
    while (const auto next = buffer.take()) released.push_back(*next);
  }
  while (const auto next = buffer.take(true)) released.push_back(*next);
  EXPECT_TRUE(std::is_sorted(released.begin(), released.end()));
  EXPECT_EQ(released.size() + std::size_t(too_late), 6000u);
  EXPECT_LE(too_late, 60) << "only before the delays are known";
  EXPECT_TRUE(buffer.empty());
}

TEST(ReorderBuffer, StopsWaitingWhenLinesAreOrderedAgain) {
  ReorderBuffer<int> buffer;
  buffer.add(0, 0);
  buffer.add(10, 1);
  buffer.add(5, 2);
  for (int i = 0; i < 100; ++i) buffer.add(11 + i, 3 + i);
  int last = 0;
  while (const auto next = buffer.take()) last = *next;
  EXPECT_EQ(last, 102);
}

}  // namespace
}  // namespace tandem
