#include <numbers>

#include <gtest/gtest.h>

#include <tandem/problem/tracking/planar.hpp>
#include <tandem/studies/commands/sensor_options.hpp>
#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/estimation/estimate_files.hpp>
#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/table.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

double distance(const SE3& a, const SE3& b) { return (a.inverse() * b).Log().norm(); }

const SE3 kSomePose = SE3::Exp((Vector<6>() << 1.0, -2.0, 3.0, 0.3, -0.7, 1.9).finished());

TEST(Frame, EveryConversionIsItsOwnInverse) {
  const Vector<3> p(1.0, -2.0, 3.0);
  for (const Frame& frame : {Frame::enu_flu(), Frame::ned_frd()}) {
    EXPECT_EQ(frame.world(frame.world(p)), p);
    EXPECT_EQ(frame.body(frame.body(p)), p);
    EXPECT_LE(distance(frame.world(frame.world(kSomePose)), kSomePose), 1e-14);
    EXPECT_LE(distance(frame.body(frame.body(kSomePose)), kSomePose), 1e-14);
    EXPECT_EQ(frame.angle(frame.angle(0.3)), 0.3);
    EXPECT_EQ(frame.world_axes() * p, frame.world(p));
    EXPECT_EQ(frame.body_axes() * p, frame.body(p));
  }
  EXPECT_EQ(Frame().name(), "ENU-FLU");
  EXPECT_EQ(Frame().world(p), p);
  EXPECT_EQ(Frame::ned_frd().name(), "NED-FRD");
}

TEST(Frame, KnownValues) {
  const Frame ned = Frame::ned_frd();
  EXPECT_EQ(ned.world(Vector<3>(10.0, 20.0, 30.0)), Vector<3>(20.0, 10.0, -30.0)) << "north east down, east north up";
  EXPECT_EQ(ned.body(Vector<3>(1.0, 2.0, 3.0)), Vector<3>(1.0, -2.0, -3.0)) << "to starboard and below";
  const double quarter = 0.5 * std::numbers::pi;
  // Level and facing north: the identity in NED-FRD, a quarter turn to the left of east in ENU-FLU.
  const SE3 north = ned.world(SE3(SO3(), Vector<3>(10.0, 20.0, 30.0)));
  EXPECT_LE(distance(north, SE3(SO3::Exp({0, 0, quarter}), Vector<3>(20.0, 10.0, -30.0))), 1e-14);
  // Facing east: a quarter turn to the right of north in NED-FRD, the identity in ENU-FLU.
  EXPECT_LE(distance(ned.world(SE3(SO3::Exp({0, 0, quarter}), Vector<3>::Zero())), SE3()), 1e-14);
  // Nose up is a positive rotation about the starboard axis and a negative one about the port axis.
  EXPECT_LE((ned.body(SO3::Exp({0, 0.2, 0})).inverse() * SO3::Exp({0, -0.2, 0})).Log().norm(), 1e-14);
  // Starboard down is a positive roll in both conventions.
  EXPECT_LE((ned.body(SO3::Exp({0.2, 0, 0})).inverse() * SO3::Exp({0.2, 0, 0})).Log().norm(), 1e-14);
  EXPECT_EQ(ned.angle(0.3), -0.3) << "a bearing to starboard";
}

TEST(Frame, ConversionCommutesWithComposition) {
  const Frame ned = Frame::ned_frd();
  const SE3 relative = SE3::Exp((Vector<6>() << 0.5, 0.2, -0.1, 0.4, -0.2, 0.3).finished());
  EXPECT_LE(distance(ned.world(kSomePose * relative), ned.world(kSomePose) * ned.body(relative)), 1e-14);
  const Vector<3> p(1.0, 2.0, 3.0);
  EXPECT_LE((ned.world(kSomePose.act(p)) - ned.world(kSomePose).act(ned.body(p))).norm(), 1e-14);
}

/// Five seconds of data, written by hand in both frames. The chaser moves east at 1 m/s, 2 m up. The target is 5 m
/// ahead,
/// 1 m to port and 0.5 m above, and heads 0.1 rad to port.
class BothFrames : public testing::Test {
 protected:
  BothFrames() {
    for (const ScratchFolder* folder : {&enu_, &ned_}) write_small_scenario(*folder);
    const std::string head =
        "noise:\n  prior: [0.001, 0.001, 0.001, 0.001, 0.001, 0.001]\n"
        "  odometry: [0.01, 0.02, 0.03, 0.001, 0.002, 0.003]\n  usbl: [1.0, 2.0, 3.0]\n"
        "  optical: [0.1, 0.2, 0.3, 0.04, 0.05, 0.06]\n"
        "  constant_twist: [0.1, 0.2, 0.3, 0.02, 0.03, 0.04]\n";
    enu_.write("scenario.yaml", "name: small\nframe: ENU-FLU\n" + head +
                                    "  constant_velocity: [0.1, 0.2, 0.3]\n"
                                    "  boundary: [0.01, 0.02, 0.03]\n" +
                                    sensors("0.3", "0.1"));
    ned_.write("scenario.yaml", "name: small\nframe: NED-FRD\n" + head +
                                    "  constant_velocity: [0.2, 0.1, 0.3]\n"
                                    "  boundary: [0.02, 0.01, 0.03]\n" +
                                    sensors("-0.3", "-0.1"));
    std::string enu, ned, enu_target, ned_target;
    for (int t = 0; t <= 5; ++t) {
      const std::string T = std::to_string(t), ahead = std::to_string(t + 5);
      enu += T + " " + T + " 0 2 0 0 0 1\n";
      ned += T + " 0 " + T + " -2 0 0 0.7071067811865476 0.7071067811865476\n";
      enu_target += T + " " + ahead + " 1 2.5 0 0 0.04997916927067833 0.9987502603949663\n";
      // Heading π/2 − 0.1 rad from north; the quaternion has half of this angle.
      ned_target += T + " 1 " + ahead + " -2.5 0 0 0.6708824723277438 0.7415636913464778\n";
    }
    for (const char* file : {"chaser_odometry.tum", "truth_chaser.tum"}) {
      enu_.write(file, enu);
      ned_.write(file, ned);
    }
    enu_.write("truth_target.tum", enu_target);
    ned_.write("truth_target.tum", ned_target);
    enu_.write("usbl.csv", "t,x,y,z\n1,5.2,1,0.4\n4.5,5,1.2,0.5\n");  // not the truth, so that the noise matters
    ned_.write("usbl.csv", "t,x,y,z\n1,5.2,-1,-0.4\n4.5,5,-1.2,-0.5\n");
    enu_.write("optical.csv",
               "t,x,y,z,qx,qy,qz,qw\n2,5,1,0.5,0,0,0.04997916927067833,0.9987502603949663\n"
               "3,5.1,1,0.5,0,0,0.04997916927067833,0.9987502603949663\n");
    ned_.write("optical.csv",
               "t,x,y,z,qx,qy,qz,qw\n2,5,-1,-0.5,0,0,-0.04997916927067833,0.9987502603949663\n"
               "3,5.1,-1,-0.5,0,0,-0.04997916927067833,0.9987502603949663\n");
    enu_.write("sonar.csv", "t,range,azimuth,elevation\n2.5,5.2,0.15,0.05\n");
    ned_.write("sonar.csv", "t,range,azimuth,elevation\n2.5,5.2,-0.15,-0.05\n");
  }
  static std::string sensors(const std::string& y, const std::string& z) {
    return "sensors:\n  sonar: {type: range_bearing, file: sonar.csv, sigma: [0.1, 0.02, 0.03], position: [0.2, " + y +
           ", " + z + "]}\n";
  }

  static void expect_same(const Estimate& a, const Estimate& b) {
    EXPECT_NEAR(a.summary.initial_cost, b.summary.initial_cost, 1e-9 * a.summary.initial_cost);
    EXPECT_GT(a.summary.cost, 1e-3);
    EXPECT_NEAR(a.summary.cost, b.summary.cost, 1e-9 * a.summary.cost);
    ASSERT_EQ(a.chaser.size(), b.chaser.size());
    for (std::size_t k = 0; k < a.chaser.size(); ++k) {
      EXPECT_LE(distance(a.chaser[k], b.chaser[k]), 1e-7);
      EXPECT_LE((a.target[k].position - b.target[k].position).norm(), 1e-7);
      ASSERT_EQ(a.target[k].rotation.has_value(), b.target[k].rotation.has_value());
      if (a.target[k].rotation) {
        EXPECT_LE((a.target[k].rotation->inverse() * *b.target[k].rotation).Log().norm(), 1e-7);
      }
      EXPECT_NEAR(*a.errors[k].position, *b.errors[k].position, 1e-7);
    }
  }

  ScratchFolder enu_, ned_;
};

TEST_F(BothFrames, GiveTheSameEstimate) {
  for (const Mode mode : {Mode::A, Mode::B}) {
    const TrackingOptions options{.mode = mode};
    expect_same(estimate(read_scenario(enu_.path()), options, GaussNewtonOptions{}),
                estimate(read_scenario(ned_.path()), options, GaussNewtonOptions{}));
  }
}

TEST_F(BothFrames, NoiseOptionsAreAlongAxesOfFiles) {
  const auto with = [](const ScratchFolder& folder, const std::string& name, const std::vector<double>& sigmas) {
    Scenario scenario = read_scenario(folder.path());
    SensorOptions options;
    options.noise.push_back({{"--noise", name}, sigmas});
    apply(options, {.target = true, .own = false}, scenario);
    return estimate(scenario, {.mode = Mode::B}, GaussNewtonOptions{});
  };
  expect_same(with(enu_, "constant_velocity", {0.5, 0.01, 0.3}), with(ned_, "constant_velocity", {0.01, 0.5, 0.3}));
  expect_same(with(enu_, "boundary", {0.5, 0.1, 0.3}), with(ned_, "boundary", {0.1, 0.5, 0.3}));
  expect_same(with(enu_, "usbl", {0.5, 0.1, 0.3}), with(ned_, "usbl", {0.5, 0.1, 0.3}));
}

TEST_F(BothFrames, ResultsAreInFrameOfFiles) {
  const ScratchFolder out_enu, out_ned;
  for (const auto& [in, out] : {std::pair(&enu_, &out_enu), std::pair(&ned_, &out_ned)}) {
    const Scenario scenario = read_scenario(in->path());
    write_results(estimate(scenario, {}, GaussNewtonOptions{}), scenario, out->path());
  }
  for (const char* file : {"chaser.tum", "target.tum", "chaser_truth.tum", "target_truth.tum"}) {
    const auto enu = poses(read_tum(out_enu.path() / file)), ned = poses(read_tum(out_ned.path() / file));
    ASSERT_EQ(enu.size(), ned.size());
    for (std::size_t k = 0; k < enu.size(); ++k) {
      EXPECT_EQ(enu[k].t, ned[k].t);
      EXPECT_LE(distance(Frame::ned_frd().world(ned[k].value), enu[k].value), 1e-7) << file;
      EXPECT_LT(ned[k].value.translation().z(), -1.5) << "down";
    }
  }
}

}  // namespace
}  // namespace tandem
