#include <gtest/gtest.h>

#include <tandem/problem/navigation/imu_record.hpp>

namespace tandem {
namespace {

/// Returns a reading that is linear in time.
ImuSample reading(double t) { return {t, Vector<3>(1 + t, -2 * t, 9.8), Vector<3>(0.1, 0.2 * t, -0.3)}; }

/// Records readings every 0.1 s from 0 to `to`.
ImuRecord record(double to, double max_gap = 0.25) {
  ImuSensor sensor;
  sensor.noise = {1e-3, 1e-4, 1e-5, 1e-6};
  sensor.max_gap = max_gap;
  ImuRecord r(sensor);
  for (int i = 0; 0.1 * i <= to + 1e-9; ++i) r.add(reading(0.1 * i));
  return r;
}

ImuDelta integrated(const ImuRecord& r, double from, double to) {
  ImuPreintegrator sum = r.start(Vector<6>::Zero());
  r.integrate(from, to, sum);
  return sum.delta();
}

void expect_same(const ImuDelta& a, const ImuDelta& b, double tolerance) {
  EXPECT_NEAR(a.dt, b.dt, 1e-12);
  EXPECT_LE((a.v - b.v).norm(), tolerance);
  EXPECT_LE((a.p - b.p).norm(), tolerance);
  EXPECT_LE((a.R.inverse() * b.R).Log().norm(), tolerance);
}

TEST(ImuRecord, InterpolatesAtIntervalEnds) {
  const ImuRecord r = record(1.0);
  ImuPreintegrator sum = r.start(Vector<6>::Zero());
  for (const auto& [a, b] : {std::pair{0.23, 0.3}, {0.3, 0.4}, {0.4, 0.5}, {0.5, 0.57}})
    sum.integrate(reading(a), reading(b));
  expect_same(integrated(r, 0.23, 0.57), sum.delta(), 1e-12);
  EXPECT_NEAR(integrated(r, 0.3, 0.5).dt, 0.2, 1e-12);
}

TEST(ImuRecord, IntegratesWithinOneSampleInterval) {
  const ImuRecord r = record(1.0);
  ImuPreintegrator sum = r.start(Vector<6>::Zero());
  sum.integrate(reading(0.42), reading(0.46));
  expect_same(integrated(r, 0.42, 0.46), sum.delta(), 1e-12);
}

TEST(ImuRecord, IntegratesInParts) {
  const ImuRecord r = record(1.0);
  ImuPreintegrator sum = r.start(Vector<6>::Zero());
  r.integrate(0.05, 0.4, sum);
  r.integrate(0.4, 0.9, sum);
  expect_same(integrated(r, 0.05, 0.9), sum.delta(), 1e-12);
}

TEST(ImuRecord, HoldsFirstAndLastSample) {
  const ImuRecord r = record(0.5);
  ImuPreintegrator after = r.start(Vector<6>::Zero()), before = after;
  after.integrate(reading(0.5).specific_force, reading(0.5).angular_rate, 0.2);
  before.integrate(reading(0.0).specific_force, reading(0.0).angular_rate, 0.2);
  expect_same(integrated(r, 0.5, 0.7), after.delta(), 1e-12);
  expect_same(integrated(r, -0.2, 0.0), before.delta(), 1e-12);
}

TEST(ImuRecord, RejectsSamplesThatAreNotLater) {
  ImuRecord r = record(0.5);
  EXPECT_FALSE(r.add(reading(0.5)));
  EXPECT_FALSE(r.add(reading(0.2)));
  EXPECT_TRUE(r.add(reading(0.6)));
  EXPECT_EQ(r.first(), 0.0);
  EXPECT_EQ(r.last(), 0.6);
}

TEST(ImuRecord, CoversIntervalsWithoutGap) {
  ImuRecord r = record(1.0);
  for (int i = 0; i <= 10; ++i) r.add(reading(2.0 + 0.1 * i));  // a gap from 1 to 2 s
  EXPECT_TRUE(r.covers(0.0, 1.0));
  EXPECT_TRUE(r.covers(0.33, 0.71));
  EXPECT_TRUE(r.covers(0.5, 1.2)) << "the end is within max_gap of a sample";
  EXPECT_TRUE(r.covers(2.1, 3.2));
  EXPECT_FALSE(r.covers(0.5, 1.3));
  EXPECT_FALSE(r.covers(0.5, 2.5));
  EXPECT_FALSE(r.covers(1.4, 1.6)) << "within the gap";
  EXPECT_FALSE(r.covers(2.5, 3.4)) << "the end is too far after the last sample";
  EXPECT_FALSE(r.covers(-0.4, 0.5)) << "the start is too far before the first sample";
  EXPECT_TRUE(r.covers(-0.2, 0.5));
  EXPECT_FALSE(ImuRecord(ImuSensor()).covers(0, 1));
}

TEST(ImuRecord, DropBeforeKeepsSampleAtTime) {
  ImuRecord r = record(1.0);
  const ImuDelta all = integrated(r, 0.45, 0.9);
  r.drop_before(0.45);
  EXPECT_NEAR(r.first(), 0.4, 1e-12);
  expect_same(integrated(r, 0.45, 0.9), all, 1e-15);
  r.drop_before(5.0);
  EXPECT_NEAR(r.first(), 1.0, 1e-12) << "the last sample is kept";
}

TEST(ImuRecord, MeanIsAlongBodyAxes) {
  ImuSensor sensor;
  sensor.mount = SE3(SO3::Exp({0, 0, M_PI / 2}), Vector<3>(1, 0, 0));
  ImuRecord r(sensor);
  for (int i = 0; i <= 10; ++i) r.add(reading(0.1 * i));
  const auto mean = r.mean(0.2, 0.4);
  ASSERT_TRUE(mean);
  EXPECT_LE((mean->specific_force - Vector<3>(0.6, 1.3, 9.8)).norm(), 1e-12)
      << "the sensor's x axis is the body's y axis";
  EXPECT_LE((mean->angular_rate - Vector<3>(-0.06, 0.1, -0.3)).norm(), 1e-12);
  EXPECT_FALSE(r.mean(0.41, 0.49));
}

}  // namespace
}  // namespace tandem
