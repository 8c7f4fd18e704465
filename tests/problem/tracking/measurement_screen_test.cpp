#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/tracking/measurement_screen.hpp>

namespace tandem {
namespace {

using ::testing::HasSubstr;
using Verdict = OdometryScreen::Verdict;

Stamped<SE3> pose_at(double t, double ahead = 0) { return {t, SE3(SO3(), Vector<3>(t + ahead, 0, 0))}; }

TEST(OdometryScreen, DiscardsSinglePosesThatTheVehicleCannotReach) {
  OdometryScreen screen;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(screen.judge(pose_at(0.1 * i)), Verdict::use) << i;
  for (const double ahead : {8.0, 300.0, 1e6}) EXPECT_EQ(screen.judge(pose_at(10, ahead)), Verdict::displaced) << ahead;
  EXPECT_EQ(screen.judge(pose_at(10, 1e12)), Verdict::missing);
  EXPECT_EQ(screen.judge(pose_at(10.1)), Verdict::use);
}

TEST(OdometryScreen, FiveConsistentPosesEstablishANewOrigin) {
  OdometryScreen screen;
  for (int i = 0; i < 100; ++i) screen.judge(pose_at(0.1 * i));
  for (int i = 100; i < 104; ++i) EXPECT_EQ(screen.judge(pose_at(0.1 * i, 50)), Verdict::displaced);
  EXPECT_EQ(screen.judge(pose_at(10.4, 50)), Verdict::new_origin);
  EXPECT_EQ(screen.judge(pose_at(10.5, 50)), Verdict::use);
  EXPECT_NEAR(screen.continued(pose_at(10.5, 50)).value.translation().x(), 10.5, 1e-9) << "at the speed before";
}

TEST(OdometryScreen, AStartOfFewerPosesIsWrong) {
  OdometryScreen screen;
  EXPECT_EQ(screen.judge(pose_at(0, 500)), Verdict::use);
  for (int i = 1; i < 5; ++i) EXPECT_EQ(screen.judge(pose_at(0.1 * i)), Verdict::displaced);
  EXPECT_EQ(screen.judge(pose_at(0.5)), Verdict::wrong_start);
  for (int i = 6; i < 100; ++i) EXPECT_EQ(screen.judge(pose_at(0.1 * i)), Verdict::use);
  EXPECT_EQ(screen.continued(pose_at(10)).value.translation().x(), 10) << "the origin of the good poses";
}

TEST(OdometryScreen, AnExcursionEndsAtTheOldOrigin) {
  for (const double away : {50.0, 500.0}) {
    OdometryScreen screen;
    for (int i = 0; i < 100; ++i) screen.judge(pose_at(0.1 * i));
    for (int i = 100; i < 130; ++i) {
      screen.judge(pose_at(0.1 * i, away));
      EXPECT_EQ(screen.bridged().norm() > 0, i == 104);
    }
    EXPECT_EQ(screen.excursion_begin(), 10.0);
    for (int i = 130; i < 134; ++i) EXPECT_EQ(screen.judge(pose_at(0.1 * i)), Verdict::displaced);
    EXPECT_EQ(screen.judge(pose_at(13.4)), Verdict::returned);
    EXPECT_EQ(screen.judge(pose_at(13.5)), Verdict::use);
    EXPECT_NEAR(screen.continued(pose_at(13.5)).value.translation().x(), 13.5, 1e-12);
    for (int i = 136; i < 140; ++i) screen.judge(pose_at(0.1 * i));
    for (int i = 140; i < 144; ++i) screen.judge(pose_at(0.1 * i, -300));
    EXPECT_EQ(screen.judge(pose_at(14.4, -300)), Verdict::new_origin) << "another jump";
  }
}

TEST(OdometryScreen, AVehicleDoesNotStopWithoutBraking) {
  OdometryScreen frozen, braking;
  for (int i = 0; i < 100; ++i) frozen.judge(pose_at(0.1 * i));
  for (int i = 1; i < 5; ++i) EXPECT_EQ(frozen.judge({9.9 + 0.1 * i, pose_at(9.9).value}), Verdict::use);
  for (int i = 5; i < 50; ++i) EXPECT_EQ(frozen.judge({9.9 + 0.1 * i, pose_at(9.9).value}), Verdict::frozen) << i;
  EXPECT_TRUE(frozen.is_frozen());
  EXPECT_EQ(frozen.judge(pose_at(15)), Verdict::use);
  EXPECT_FALSE(frozen.is_frozen());
  OdometryScreen axis;  // x stops, y goes on
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(axis.judge({0.1 * i, SE3(SO3(), Vector<3>(0.1 * std::min(i, 50), 0.1 * i, 0))}),
              i < 55 ? Verdict::use : Verdict::frozen)
        << i;
  double x = 0;
  for (int i = 0; i < 300; ++i) {
    x += 0.1 * std::max(0.0, 2 - 0.1 * 0.3 * i);
    EXPECT_EQ(braking.judge({0.1 * i, SE3(SO3(), Vector<3>(x, 0, 0))}), Verdict::use) << i;
  }
}

TEST(MeasurementScreen, DiscardsTheLinesOfARecordingThatAreNotBelieved) {
  TrackingData data;
  for (int i = 0; i < 300; ++i) data.odometry.push_back(pose_at(0.1 * i, i == 150 ? 500 : 0));
  TargetSensor usbl;
  usbl.name = "usbl";
  usbl.sigma = Vector<3>::Ones();
  for (int i = 0; i < 30; ++i) usbl.measurements.push_back({.t = 1.0 * i, .position = {20 + 0.1 * i, 3, -1}});
  usbl.measurements[5].position.setZero();
  usbl.measurements[7].position.setConstant(std::nan(""));
  for (int i = 20; i < 28; ++i) usbl.measurements[std::size_t(i)].position = {22, 3, -1};
  data.sensors = {usbl};
  const auto findings = screen(data);
  EXPECT_EQ(data.odometry.size(), 299u);
  EXPECT_EQ(data.sensors[0].measurements.size(), 30u - 2u - 7u);
  ASSERT_EQ(findings.size(), 4u);
  EXPECT_THAT(findings[0].text(), HasSubstr("odometry: dropped 1 line at 15 s"));
  EXPECT_THAT(findings[1].text(), HasSubstr("usbl: dropped 1 line at 7 s with NaN"));
  EXPECT_THAT(findings[2].text(), HasSubstr("usbl: dropped 1 line at 5 s with exact zeros"));
  EXPECT_THAT(findings[3].text(), HasSubstr("usbl: dropped 7 lines between 21 and 27 s with a repeated value"));
}

TEST(MeasurementScreen, ContinuesTheOdometryAfterAJump) {
  TrackingData data;
  for (int i = 0; i < 300; ++i) data.odometry.push_back(pose_at(0.1 * i, i >= 150 ? 500 : 0));
  const auto findings = screen(data);
  EXPECT_EQ(data.odometry.size(), 300u);
  EXPECT_NEAR(data.odometry.back().value.translation().x(), 29.9, 1e-9);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].text(), "odometry: jumps to a new origin at 15 s");
}

TEST(MeasurementScreen, DropsAWrongStartAndAnExcursionOfTheOdometry) {
  TrackingData data;
  const auto is_wrong = [](int i) { return i == 0 || (i >= 150 && i < 180); };
  for (int i = 0; i < 300; ++i) data.odometry.push_back(pose_at(0.1 * i, is_wrong(i) ? 500 : 0));
  const auto findings = screen(data);
  EXPECT_EQ(data.odometry.size(), 300u - 30u) << "the first pose is replaced";
  for (const Stamped<SE3>& x : data.odometry) EXPECT_NEAR(x.value.translation().x(), x.t, 1e-9);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_THAT(findings[0].text(), HasSubstr("odometry: dropped 31 lines"));
}

}  // namespace
}  // namespace tandem
