#include <vector>

#include <gtest/gtest.h>

#include <tandem/solvers/online/event_queue.hpp>

namespace tandem::detail {
namespace {

OnlineEvent of_target(std::size_t sensor) { return {sensor, Measurement{}}; }
OnlineEvent of_chaser(std::size_t sensor) { return {sensor, EgoMeasurement{}}; }

TEST(EventQueue, SortsByTimeWithTheTargetFirst) {
  EventQueue queue(60);
  EXPECT_FALSE(queue.next());
  queue.push(3.0, of_chaser(1));
  queue.push(2.0, of_chaser(2));
  queue.push(2.0005, of_target(3));
  queue.push(2.0, of_chaser(4));
  queue.push(2.5, of_target(5));
  std::vector<std::size_t> order;
  while (const auto next = queue.next()) {
    const auto [t, event] = queue.take();
    EXPECT_EQ(t, next->t);
    EXPECT_EQ(event.of_target(), next->of_target);
    order.push_back(event.sensor);
  }
  EXPECT_EQ(order, (std::vector<std::size_t>{3, 2, 4, 5, 1}));
  queue.push(1.0, of_chaser(0));
  queue.push(2.0, of_chaser(1));
  queue.drop_before(1.5);
  EXPECT_EQ(queue.next()->t, 2.0);
}

TEST(EventQueue, AcceptsAStampFarAheadOnlyIfConfirmed) {
  EventQueue queue(60);
  EXPECT_FALSE(queue.why_invalid_stamp("usbl", 1e9, false)) << "the first stamp sets the clock";
  queue.advance(100);
  EXPECT_TRUE(queue.why_invalid_stamp("usbl", NAN, false));
  EXPECT_FALSE(queue.why_invalid_stamp("usbl", 160, true));
  EXPECT_EQ(queue.why_invalid_stamp("usbl", 500, true),
            "usbl: time stamp 500.000000 s is 400.000000 s ahead of all other streams");
  EXPECT_TRUE(queue.why_invalid_stamp("usbl", 800, true));
  EXPECT_FALSE(queue.why_invalid_stamp("usbl", 810, true));
  EXPECT_TRUE(queue.why_invalid_stamp("usbl", 810, true)) << "each jump needs its own confirmation";
}

}  // namespace
}  // namespace tandem::detail
