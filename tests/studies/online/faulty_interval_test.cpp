#include <gtest/gtest.h>

#include <tandem/studies/online/faulty_interval.hpp>

namespace tandem {
namespace {

RecordHealth health(bool converged, std::size_t used, std::size_t rejected) {
  return {converged, 0, 0, {{used, rejected, {}, {}}}};
}

TEST(FaultyIntervalDetector, DetectsUnconvergedUpdates) {
  FaultyIntervalDetector detector(60);
  for (int t = 0; t <= 200; ++t) detector.updated(t, health(t < 20 || t > 90, std::size_t(t), 0));
  const auto longest = detector.longest();
  ASSERT_TRUE(longest);
  EXPECT_EQ(longest->since, 20);
  EXPECT_EQ(longest->until, 90);
  EXPECT_FALSE(longest->ongoing);
}

TEST(FaultyIntervalDetector, DetectsRejectionOfAllMeasurements) {
  FaultyIntervalDetector detector(60);
  for (int t = 0; t <= 100; ++t) detector.updated(t, health(true, std::size_t(std::min(t, 30)), t > 30 ? 5 : 0));
  ASSERT_TRUE(detector.longest());
  EXPECT_EQ(detector.longest()->since, 31);
  EXPECT_TRUE(detector.longest()->ongoing);
}

TEST(FaultyIntervalDetector, IgnoresGapsAndShortIntervals) {
  FaultyIntervalDetector silent(60), brief(60);
  for (int t = 0; t <= 300; ++t) silent.updated(t, health(t > 2, 3, 0));
  EXPECT_FALSE(silent.longest());
  for (int t = 0; t <= 300; ++t) brief.updated(t, health(t % 50 == 0, std::size_t(t), 0));
  EXPECT_FALSE(brief.longest());
}

}  // namespace
}  // namespace tandem
