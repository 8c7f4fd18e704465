#include <gtest/gtest.h>

#include <tandem/studies/online/track_records.hpp>

namespace tandem {
namespace {

TrackRecord full_record() {
  TrackRecord r{1.25, KeyframeType::pose, true, 0.001, 0.002, 12.5, 61};
  r.chaser = SE3(SO3::Exp({0.1, -0.2, 2}), {1, 2, 3});
  r.chaser_velocity = {0.5, 0.25, -0.125};
  r.chaser_sigma = 0.1;
  r.chaser_rotation_sigma = 0.01;
  r.target = TargetState(SE3(SO3::Exp({0, 0, -1}), {4, 5, 6}));
  r.target_velocity = {-1, -2, -3};
  r.covariance = (Matrix<3, 3>() << 3, 0.1, 0.2, 0.1, 4, 0.3, 0.2, 0.3, 5).finished();
  r.measured = Vector<3>(7, 8, 9);
  r.measured_rotation = SO3::Exp({0.3, 0, 0});
  r.ahead = {RelativeTarget{{10, 11, 12}, *r.covariance}, RelativeTarget{{1, 2, 3}}, std::nullopt};
  r.health = {false, 2, 1, {{7, 3, 4.5, 0.25}, {0, 0, {}, {}}}, {OutputState::aided, 0.5}, {OutputState::invalid, 41}};
  return r;
}

/// Expects equal values, or both absent.
template <class T>
void expect_same(const std::optional<T>& a, const std::optional<T>& b, const char* what) {
  ASSERT_EQ(a.has_value(), b.has_value()) << what;
  if (!a) return;
  if constexpr (std::same_as<T, SO3>) {
    EXPECT_TRUE(a->quaternion().coeffs().isApprox(b->quaternion().coeffs(), 1e-15)) << what;  // normalised again
  } else {
    EXPECT_EQ(*a, *b) << what;
  }
}

void expect_same(const TrackRecord& a, const TrackRecord& b) {
  EXPECT_EQ(a.t, b.t);
  EXPECT_EQ(a.type, b.type);
  EXPECT_EQ(a.new_keyframe, b.new_keyframe);
  EXPECT_EQ(a.seconds, b.seconds);
  EXPECT_EQ(a.processor_seconds, b.processor_seconds);
  EXPECT_EQ(a.keyframes, b.keyframes);
  EXPECT_EQ(a.chaser.translation(), b.chaser.translation());
  expect_same<SO3>(a.chaser.rotation(), b.chaser.rotation(), "rotation of the chaser");
  EXPECT_EQ(a.chaser_velocity, b.chaser_velocity);
  EXPECT_EQ(a.target_velocity, b.target_velocity);
  expect_same(a.memory, b.memory, "memory");
  expect_same(a.chaser_sigma, b.chaser_sigma, "chaser_sigma");
  expect_same(a.chaser_rotation_sigma, b.chaser_rotation_sigma, "chaser_rotation_sigma");
  expect_same(a.covariance, b.covariance, "covariance");
  expect_same(a.measured, b.measured, "measured");
  expect_same(a.measured_rotation, b.measured_rotation, "measured_rotation");
  EXPECT_EQ(a.health.converged, b.health.converged);
  EXPECT_EQ(a.health.resets, b.health.resets);
  EXPECT_EQ(a.health.suspensions, b.health.suspensions);
  EXPECT_EQ(a.health.chaser.state, b.health.chaser.state);
  EXPECT_EQ(a.health.chaser.age, b.health.chaser.age);
  EXPECT_EQ(a.health.target.state, b.health.target.state);
  EXPECT_EQ(a.health.target.age, b.health.target.age);
  ASSERT_EQ(a.health.sensors.size(), b.health.sensors.size());
  for (std::size_t i = 0; i < a.health.sensors.size(); ++i) {
    EXPECT_EQ(a.health.sensors[i].used, b.health.sensors[i].used);
    EXPECT_EQ(a.health.sensors[i].rejected, b.health.sensors[i].rejected);
    expect_same(a.health.sensors[i].sigmas, b.health.sensors[i].sigmas, "sigmas");
    expect_same(a.health.sensors[i].age, b.health.sensors[i].age, "age");
  }
  ASSERT_EQ(a.ahead.size(), b.ahead.size());
  for (std::size_t i = 0; i < a.ahead.size(); ++i) {
    ASSERT_EQ(a.ahead[i].has_value(), b.ahead[i].has_value()) << "ahead";
    if (!a.ahead[i]) continue;
    EXPECT_EQ(a.ahead[i]->position, b.ahead[i]->position);
    expect_same(a.ahead[i]->covariance, b.ahead[i]->covariance, "covariance ahead");
  }
  ASSERT_EQ(a.target.has_value(), b.target.has_value());
  if (!a.target) return;
  EXPECT_EQ(a.target->position, b.target->position);
  expect_same(a.target->rotation, b.target->rotation, "rotation of the target");
}

TEST(TrackRecords, RestoreAllFields) {
  std::vector<TrackRecord> records = {full_record(), full_record(), full_record(), full_record()};
  records[1].target.reset();
  records[1].memory.reset();
  records[1].type = KeyframeType::none;
  records[1].new_keyframe = false;
  records[1].covariance.reset();
  records[1].measured.reset();
  records[1].measured_rotation.reset();
  records[2].target = TargetState(Vector<3>(1, 2, 3));  // a point
  records[2].chaser_sigma.reset();
  records[2].chaser_rotation_sigma.reset();
  records[2].ahead = {std::nullopt, RelativeTarget{{1, 1, 1}}, std::nullopt};
  records[2].type = KeyframeType::position;
  TrackRecords file(3);
  for (const TrackRecord& r : records) file.add(r);
  EXPECT_EQ(file.size(), 4u);
  for (int pass = 0; pass < 2; ++pass) {  // the records can be read more than once
    std::size_t i = 0;
    file.each([&](const TrackRecord& r) {
      SCOPED_TRACE(i);
      expect_same(r, records.at(i++));
    });
    EXPECT_EQ(i, 4u);
  }
}

TEST(TrackRecords, MayBeEmpty) {
  const TrackRecords none(0);
  none.each([](const TrackRecord&) { FAIL(); });
  EXPECT_EQ(none.size(), 0u);
}

}  // namespace
}  // namespace tandem
