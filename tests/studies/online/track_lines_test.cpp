#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/online/track_json_line.hpp>
#include <tandem/studies/online/track_lines.hpp>
#include <tandem/studies/online/track_rows.hpp>

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

/// The chaser is at the origin and heads north (the world's y). The target is 10 m ahead, 10 m to starboard and 5 m up;
/// it heads south and moves east at 2 m/s.
TrackRecord record(double t) {
  TrackRecord r{t, KeyframeType::position, true, 0.002, 0.001, {}, 42};
  r.chaser = SE3(SO3::Exp({0, 0, std::numbers::pi / 2}), {0, 0, 0});
  r.chaser_velocity = {0, 1.5, 0};
  r.chaser_sigma = 0.25;
  r.target = TargetState(SE3(SO3::Exp({0, 0, -std::numbers::pi / 2}), {10, 10, 5}));
  r.target_velocity = {2, 0, 0};
  r.covariance = Vector<3>(4, 1, 4).asDiagonal();
  return r;
}

TEST(TrackLines, PrintTargetInNauticalTerms) {
  TrackLines lines(Frame::enu_flu(), true, false);
  EXPECT_EQ(lines(record(80.2)),
            "  time [s] range [m] bearing [°] elev. [°] speed [m/s] heading [°]    σ [m]  window update [ms]  health\n"
            "     80.20     15.00        45.0      19.5        2.00       180.0     3.00      42        2.00  ok\n");
}

TEST(TrackLines, PrintPredictionsWithSigma) {
  TrackLines lines(Frame::enu_flu(), true, false, {5, 10});
  TrackRecord r = record(80.2);
  r.ahead = {RelativeTarget{{3, 4, 0}, Matrix<3, 3>(Vector<3>(1, 4, 4).asDiagonal())}, RelativeTarget{{6, 8, 0}}};
  EXPECT_THAT(lines(r), testing::AllOf(HasSubstr("   σ [m]      in 5 s [m]     in 10 s [m]  window"),
                                       HasSubstr("    3.00     5.00 ± 3.00           10.00      42")));
  r.t = 81.2;
  r.ahead[0].reset();
  EXPECT_THAT(lines(r), HasSubstr("    3.00               –           10.00      42"));
  r.t = 82.2;
  r.ahead[0] = RelativeTarget{{3, 4, 0}, Matrix<3, 3>(Vector<3>(1, 4, 1e12).asDiagonal())};
  r.covariance = Vector<3>(1e12, 1, 1).asDiagonal();
  EXPECT_THAT(lines(r), HasSubstr("       ∞        5.00 ± ∞           10.00      42")) << "an axis is unobserved";
}

TEST(TrackLines, AndFilesShowUnobservedAxes) {
  TrackRecord r = record(80.2);
  r.covariance = Vector<3>(1e12, 1, 4).asDiagonal();
  r.ahead = {RelativeTarget{{3, 4, 0}, Matrix<3, 3>(Vector<3>(1e14, 4, 4).asDiagonal())}};
  r.chaser_sigma = 1e6;
  const Frame frame = Frame::enu_flu();
  const std::string row = TrackRows(frame, {5}, {}).of(r)[2];
  EXPECT_THAT(row, testing::AllOf(HasSubstr(",,1,2,,3,4,0,,2,2,")));
  const auto json = nlohmann::json::parse(track_json_line(r, frame, {}, {5}));
  EXPECT_EQ(json["sigma_m"], nlohmann::json::parse("[null, 1.0, 2.0]"));
  EXPECT_EQ(json["ahead"][0]["sigma_m"], nlohmann::json::parse("[null, 2.0, 2.0]"));
  EXPECT_TRUE(json["chaser_sigma_m"].is_null());
  EXPECT_EQ(*body_sigma(frame, r, 3), Vector<3>(HUGE_VAL, 3, 6));
  EXPECT_THAT(TrackLines(frame, false, false)(r), HasSubstr("        ∞      42"));
}

TEST(TrackLines, AppearOncePerSecond) {
  TrackLines lines(Frame::enu_flu(), true, false);
  lines(record(1));
  TrackRecord slow = record(1.5);
  slow.seconds = 0.5;
  EXPECT_EQ(lines(slow), "");
  TrackRecord late = record(2.5);
  late.new_keyframe = false;
  EXPECT_EQ(lines(late), "") << "a late measurement does not change the newest state";
  EXPECT_THAT(lines(record(2.5)), testing::AllOf(StartsWith("      2.50 "), testing::EndsWith(" 500.00  ok\n")));
  EXPECT_THAT(lines(record(3)), testing::EndsWith(" 2.00  ok\n"));
}

TEST(TrackLines, RepeatHeader) {
  TrackLines lines(Frame::enu_flu(), true, false);
  for (int i = 0; i < 51; ++i) {
    SCOPED_TRACE(i);
    if (i % 25 == 0)
      EXPECT_THAT(lines(record(i)), HasSubstr("range [m]"));
    else
      EXPECT_THAT(lines(record(i)), testing::Not(HasSubstr("range [m]")));
  }
}

TEST(TrackLines, PrintDashForUnknownValues) {
  TrackLines lines(Frame::enu_flu(), true, true);
  TrackRecord r = record(1);
  r.target = TargetState(Vector<3>(10, 10, 0));  // a point has no orientation: its course is shown
  r.covariance.reset();
  EXPECT_THAT(lines(r), HasSubstr("     14.14        45.0         –        2.00        90.0        –      42"));
  r.t = 2;
  r.target_velocity = {0.001, 0, 0};
  EXPECT_THAT(lines(r), HasSubstr(" 0.00           –        –      42")) << "too slow to have a course";
  r.t = 3;
  r.target.reset();
  EXPECT_THAT(lines(r),
              HasSubstr("      3.00         –           –         –           –           –        –      42"));
}

TEST(TrackLines, PrintChaserInScenarioFrame) {
  TrackLines lines(Frame::ned_frd(), false, false);
  TrackRecord r = record(1);
  r.chaser = SE3(r.chaser.rotation(), {1, 2, 3});
  EXPECT_EQ(lines(r),
            "  time [s]     x [m]       y [m]     z [m] speed [m/s] heading [°]    σ [m]  window update [ms]  health\n"
            "      1.00      2.00        1.00     -3.00        1.50         0.0     0.25      42        2.00  ok\n");
}

TEST(TrackLines, PrintHealth) {
  TrackLines lines(Frame::enu_flu(), true, false);
  TrackRecord r = record(1);
  r.health.sensors = {{5, 2, 7.0, 3.0}, {1, 1, {}, 14.0}};
  EXPECT_THAT(lines(r), testing::EndsWith("  3 rejected\n"));
  r.t = 2;
  EXPECT_THAT(lines(r), testing::EndsWith("  ok\n"));
  r.t = 3;
  r.health.chaser = {OutputState::aided, 0};
  r.health.target = {OutputState::lost, 22.4};
  EXPECT_THAT(lines(r), testing::EndsWith("  target lost, no fix for 22 s\n"));
  r.t = 4;
  r.health.converged = false;
  EXPECT_THAT(lines(r), testing::EndsWith("  unconverged\n"));
  r.t = 5;
  r.health.target = {OutputState::invalid, 3};
  EXPECT_THAT(lines(r), testing::EndsWith("  target invalid, no fix for 3 s, unconverged\n"));
  r.t = 6;
  r.health.converged = true;
  r.health.target.age = r.health.chaser.age = 45;
  r.health.chaser.state = OutputState::invalid;
  EXPECT_THAT(lines(r), testing::EndsWith("  target invalid, no fix for 45 s; chaser invalid, no fix for 45 s\n"));
  EXPECT_THAT(lines(record(1)), HasSubstr("      1.00 ")) << "the time was reset";
}

TEST(TrackJsonLines, HaveStatesAndCovariancesInTheFrameOfTheScenario) {
  TrackRecord r = record(80.2);
  r.reported.chaser_twist << 1, 2, 3, 4, 5, 6;
  r.reported.target_twist = r.reported.chaser_twist;
  r.reported.chaser_rows = 6;
  r.reported.covariance = Eigen::MatrixXd::Ones(12, 12) + Eigen::MatrixXd::Identity(12, 12);
  r.ahead = {RelativeTarget{{3, 4, 0}, Matrix<3, 3>(Vector<3>(1, 4, 9).asDiagonal())}};
  r.health.sensors = {{.used = 3, .rejected = 1, .sigmas = 2.0, .age = 0.5, .nis = 1.25}};
  const auto json_in = [&](const Frame& frame, LineCovariance covariance) {
    return nlohmann::json::parse(track_json_line(r, frame, {"usbl"}, {5}, covariance));
  };
  const auto enu = json_in(Frame::enu_flu(), LineCovariance::joint);
  EXPECT_EQ(enu["schema"], "tandem.track-line/1");
  EXPECT_EQ(enu["target_m"], (std::vector<double>{10, 10, 5}));
  EXPECT_NEAR(enu["heading_rad"], std::numbers::pi, 1e-12);
  EXPECT_EQ(enu["speed_m_s"], 2.0);
  EXPECT_EQ(enu["sensors"]["usbl"]["nis"], 1.25);
  EXPECT_EQ(enu["covariance"].size(), 12u);
  EXPECT_EQ(enu["covariance"][0][0], 2.0);
  EXPECT_EQ(enu["ahead"][0]["covariance_m2"][2][2], 9.0);
  EXPECT_NEAR(enu["ahead"][0]["target_m"][1], 3, 1e-12) << "3 m ahead of the chaser, which heads north";
  const auto ned = json_in(Frame::ned_frd(), LineCovariance::blocks);
  EXPECT_EQ(ned["target_m"], (std::vector<double>{10, 10, -5}));
  EXPECT_EQ(ned["chaser_twist"], (std::vector<double>{1, -2, -3, 4, -5, -6}));
  EXPECT_FALSE(ned.contains("covariance"));
  EXPECT_EQ(ned["target_covariance"].size(), 6u);
  EXPECT_EQ(ned["target_covariance"][0][1], -1.0) << "forward and starboard instead of port";
  EXPECT_EQ(ned["target_covariance"][1][2], 1.0);
  EXPECT_FALSE(ned.contains("window"));
  r.reported.window_target = TargetState(SE3(SO3(), {9, 10, 5}));
  r.reported.window_twist = r.reported.chaser_twist;
  const auto joint = json_in(Frame::enu_flu(), LineCovariance::joint),
             blocks = json_in(Frame::ned_frd(), LineCovariance::blocks);
  EXPECT_FALSE(joint.contains("covariance")) << "it belongs to the window, not to the newest state";
  EXPECT_EQ(joint["target_m"], (std::vector<double>{10, 10, 5}));
  EXPECT_EQ(joint["window"]["target_m"], (std::vector<double>{9, 10, 5}));
  EXPECT_EQ(joint["window"]["covariance"], enu["covariance"]);
  EXPECT_EQ(blocks["window"]["target_twist"], ned["chaser_twist"]);
  EXPECT_EQ(blocks["window"]["target_covariance"], ned["target_covariance"]);
  EXPECT_EQ(blocks["chaser_covariance"], ned["chaser_covariance"]);
  EXPECT_FALSE(blocks.contains("target_covariance"));
}

TEST(TrackJsonLines, KeepTheRate) {
  TrackJsonLines lines(Frame::enu_flu(), {}, {}, LineCovariance::off, 2.0);
  int printed = 0;
  for (int i = 0; i < 100; ++i) printed += !lines(record(10 + 0.1 * i)).empty();
  EXPECT_EQ(printed, 20);
  EXPECT_FALSE(lines(record(3)).empty()) << "the time base was reset";
}

}  // namespace
}  // namespace tandem
