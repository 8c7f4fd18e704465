#include <algorithm>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/solvers/online/stream_clocks.hpp>

namespace tandem {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Verdict = StreamClocks::Verdict;

/// A motion at 10 Hz and fixes every 2 s. Keeps held lines as OnlineFeed does.
class Feed {
 public:
  Feed() : clocks_({{"odometry", false, true}, {"usbl", true, false}}) {
    clocks_.on_notice = [this](const std::string& text) { notices.push_back(text); };
  }

  void give(std::size_t stream, double stamp) {
    const Verdict verdict = clocks_.classify(stream, stamp);
    if (verdict == Verdict::wait) return waiting_.push_back({stream, stamp});
    if (verdict == Verdict::hold) held_[stream].push_back(stamp);
    if (verdict == Verdict::repeated || verdict == Verdict::invalid) ++discarded;
    for (const auto& [of, lines] : clocks_.dropped()) {
      held_[of].erase(held_[of].begin(), held_[of].begin() + std::ptrdiff_t(lines));
      dropped += lines;
    }
    time_resets += clocks_.time_was_reset();
    if (verdict == Verdict::use) used[stream].push_back(clocks_.time(stream, stamp));
    for (const std::size_t of : clocks_.released()) {
      for (const double h : held_[of]) used[of].push_back(clocks_.time(of, h));
      held_[of].clear();
    }
    drain();
  }
  /// Gives both streams from `from` to `to` [s], with stamps f(stream, t).
  template <class F>
  void run(int from, int to, F f) {
    for (int i = 10 * from; i < 10 * to; ++i) {
      give(0, f(0, 0.1 * i));
      drain();
      if (i % 20 == 0) give(1, f(1, 0.1 * i));
    }
  }
  void run(int from, int to) {
    run(from, to, [](int, double t) { return t; });
  }

  std::vector<double> used[2];
  std::vector<std::string> notices;
  std::size_t discarded = 0, dropped = 0, time_resets = 0;

 private:
  void drain() {
    if (!clocks_.is_ready()) return;
    for (const auto& [stream, stamp] : std::exchange(waiting_, {})) give(stream, stamp);
  }

  StreamClocks clocks_;
  std::vector<std::pair<std::size_t, double>> waiting_;
  std::vector<double> held_[2];
};

TEST(StreamClocks, UsesConsistentStampsUnchanged) {
  Feed feed;
  feed.run(0, 100);
  EXPECT_EQ(feed.used[0].size(), 1000u);
  EXPECT_EQ(feed.used[1].size(), 50u);
  EXPECT_EQ(feed.used[0].back(), 0.1 * 999);
  EXPECT_THAT(feed.notices, IsEmpty());
  EXPECT_EQ(feed.discarded + feed.dropped, 0u);
}

TEST(StreamClocks, DiscardsOnlyTheLinesWithWrongStamps) {
  for (const std::size_t stream : {0u, 1u})
    for (const double wrong : {4294967295.0, 350.0, 56.0, -1e3, 1e300}) {
      SCOPED_TRACE(::testing::Message() << stream << ' ' << wrong);
      Feed feed;
      feed.run(0, 50);
      feed.give(stream, wrong);
      feed.run(50, 70);
      feed.give(stream, wrong == 56.0 ? 76.0 : wrong);
      feed.run(70, 100);
      EXPECT_EQ(feed.used[0].size(), 1000u);
      EXPECT_EQ(feed.used[1].size(), 50u);
      EXPECT_EQ(feed.used[0].back(), 0.1 * 999);
      EXPECT_EQ(feed.discarded + feed.dropped, 2u);
      EXPECT_THAT(feed.notices, IsEmpty());
    }
}

TEST(StreamClocks, DiscardsStampsThatAreNotFinite) {
  Feed feed;
  feed.run(0, 10);
  feed.give(0, HUGE_VAL);
  feed.give(1, std::nan(""));
  feed.give(0, 9.9);
  EXPECT_EQ(feed.discarded, 3u) << "the last one repeats a stamp";
}

TEST(StreamClocks, TimesAStreamByArrivalAfterAClockStep) {
  for (const double step : {-3600.0, 500.0, 1.79e9}) {
    SCOPED_TRACE(step);
    Feed feed;
    feed.run(0, 50);
    feed.run(50, 70, [&](int stream, double t) { return stream == 1 ? t + step : t; });
    feed.run(70, 100);
    EXPECT_EQ(feed.used[0].size(), 1000u);
    EXPECT_EQ(feed.used[1].size(), 50u) << "held lines are not lost";
    for (std::size_t i = 0; i < feed.used[1].size(); ++i) EXPECT_NEAR(feed.used[1][i], 2.0 * double(i), 0.2);
    EXPECT_EQ(feed.used[1].back(), 98.0);
    EXPECT_THAT(feed.notices, ElementsAre(HasSubstr(step < 0 ? "usbl: clock is 3600 s behind" : " ahead"),
                                          HasSubstr("usbl: time stamps agree with the other streams again")));
  }
}

TEST(StreamClocks, TimesAllStreamsByArrivalAfterACommonClockStep) {
  for (const double step : {-3600.0, 1.79e9}) {
    SCOPED_TRACE(step);
    Feed feed;
    feed.run(0, 50);
    feed.run(50, 100, [&](int, double t) { return t + step; });
    EXPECT_EQ(feed.used[0].size(), 1000u);
    EXPECT_EQ(feed.used[1].size(), 50u);
    for (std::size_t i = 0; i < feed.used[0].size(); ++i) EXPECT_NEAR(feed.used[0][i], 0.1 * double(i), 1e-6);
    EXPECT_THAT(feed.notices, ElementsAre(HasSubstr("odometry: clock is"), HasSubstr("usbl: clock stepped by")));
  }
}

TEST(StreamClocks, TreatsACommonJumpAsAPause) {
  Feed feed;
  feed.run(0, 50);
  feed.run(650, 700);
  EXPECT_EQ(feed.used[0].size(), 1000u);
  EXPECT_EQ(feed.used[1].size(), 50u);
  EXPECT_EQ(feed.used[0].back(), 0.1 * 6999);
  EXPECT_THAT(feed.notices, ElementsAre(HasSubstr("no time stamps for 600.1 s: treated as a pause")));
}

TEST(StreamClocks, ResetsTheTimeBaseIfTheFirstLinesAreInTheFuture) {
  Feed feed;
  feed.run(0, 2, [](int, double t) { return t + 1.79e9; });
  feed.run(2, 50);
  EXPECT_EQ(feed.time_resets, 1u);
  EXPECT_EQ(feed.used[0].back(), 0.1 * 499);
  EXPECT_EQ(feed.used[1].back(), 48.0);
}

TEST(StreamClocks, ABriefStepOfAllClocksCostsOnlyItsLines) {
  for (const int seconds : {1, 2}) {
    Feed feed;
    feed.run(0, 50);
    feed.run(50, 50 + seconds, [](int, double t) { return t - 3600; });
    feed.run(50 + seconds, 100);
    EXPECT_EQ(feed.used[0].size(), 1000u - 10u * unsigned(seconds)) << seconds;
    EXPECT_EQ(feed.used[0].back(), 0.1 * 999) << seconds;
    EXPECT_GE(feed.used[1].size(), 49u) << seconds;
    EXPECT_EQ(feed.used[1].back(), 98.0) << seconds;
    EXPECT_THAT(feed.notices, IsEmpty());
  }
}

TEST(StreamClocks, BelievesLateFixesInDisorder) {
  Feed feed;
  std::multimap<double, std::pair<std::size_t, double>> arrivals;
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.1 * i;
    arrivals.emplace(t, std::pair(0, t));
    if (i % 20 == 0) arrivals.emplace(t + (i * 37) % 300 * 0.1, std::pair(1, t));
  }
  for (const auto& [arrival, line] : arrivals) feed.give(line.first, line.second);
  EXPECT_EQ(feed.used[0].size(), 2000u);
  EXPECT_EQ(feed.used[1].size(), 100u);
  std::sort(feed.used[1].begin(), feed.used[1].end());
  for (std::size_t i = 0; i < 100; ++i) EXPECT_NEAR(feed.used[1][i], 2.0 * double(i), 1e-9);
  EXPECT_THAT(feed.notices, IsEmpty());
}

TEST(StreamClocks, BelievesAMotionThatLags) {
  for (const double lag : {3.0, 10.0, 40.0}) {
    SCOPED_TRACE(lag);
    Feed feed;
    std::multimap<double, std::pair<std::size_t, double>> arrivals;
    for (int i = 0; i < 2000; ++i) {
      arrivals.emplace(0.1 * i + lag, std::pair(0, 0.1 * i));
      if (i % 50 == 0) arrivals.emplace(0.1 * i, std::pair(1, 0.1 * i));
    }
    for (const auto& [arrival, line] : arrivals) feed.give(line.first, line.second);
    EXPECT_EQ(feed.used[0].size(), 2000u);
    EXPECT_GE(feed.used[1].size(), 39u);
    for (const double t : feed.used[1]) EXPECT_NEAR(std::remainder(t, 5.0), 0, 1e-9);
    EXPECT_THAT(feed.notices, IsEmpty());
  }
}

TEST(StreamClocks, DetectsTheUnitOfTheStamps) {
  for (const auto& [one, name] : {std::pair{1e-3, "milliseconds"}, {1e-6, "microseconds"}, {1e-9, "nanoseconds"}})
    for (const double start : {0.0, 1.7e9}) {
      const double unit = one;
      SCOPED_TRACE(::testing::Message() << name << " from " << start);
      Feed feed;
      feed.run(0, 50, [&](int, double t) { return (t + start) / unit; });
      EXPECT_EQ(feed.used[0].size(), 500u);
      EXPECT_EQ(feed.used[1].size(), 25u);
      EXPECT_NEAR(feed.used[0].back(), start + 49.9, 1e-5);
      EXPECT_THAT(feed.notices, ElementsAre(std::string("time stamps are in ") + name));
    }
}

TEST(StreamClocks, DetectsADifferentUnitOfOneStream) {
  Feed feed;
  feed.run(10, 60, [](int stream, double t) { return stream == 1 ? 1e3 * t : t; });
  EXPECT_EQ(feed.used[1].size(), 25u);
  EXPECT_NEAR(feed.used[1].back(), 58.0, 1e-9);
  EXPECT_THAT(feed.notices, ElementsAre("usbl: time stamps are in milliseconds"));
}

}  // namespace
}  // namespace tandem
