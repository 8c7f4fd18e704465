#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/solvers/gauss_newton.hpp>

#include "simulated_run.hpp"

/// Mode B: poses at keyframes with a measured pose, points at others.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TrackingOptions mode_b(Junction junction = Junction::boundary) { return {.mode = Mode::B, .junction = junction}; }

struct Pattern {
  std::string keyframes;
  int boundaries;  ///< number of poses next to a point
};
const std::vector<Pattern> kPatterns{{"PPpp", 1}, {"pPp", 1}, {"PpP", 2},     {"ppPPPpp", 2},
                                     {"PPP", 0},  {"ppp", 0}, {"P.P.pp.", 2}, {"ppPpPPppPPPp", 5}};

class ModeB : public ::testing::TestWithParam<bool> {  // planar
 protected:
  SimulatedRun run{.planar = GetParam()};
};

TEST_P(ModeB, HasExpectedVariablesAndBlocks) {
  const int pose = run.planar ? 3 : 6, point = run.planar ? 2 : 3;
  for (const Pattern& p : kPatterns) {
    SCOPED_TRACE(p.keyframes);
    const int n = int(p.keyframes.size());
    const int poses = int(std::count(p.keyframes.begin(), p.keyframes.end(), 'P'));
    const int measured = n - int(std::count(p.keyframes.begin(), p.keyframes.end(), '.'));
    for (const Junction junction : {Junction::boundary, Junction::direct}) {
      const int boundaries = junction == Junction::boundary ? p.boundaries : 0;
      const TrackingProblem tracking = make_tracking_problem(patterned(run, p.keyframes), mode_b(junction));
      ASSERT_EQ(int(tracking.keyframes.size()), n);
      EXPECT_EQ(tracking.problem.size().unknowns, (n + poses) * pose + (n - poses + boundaries) * point);
      EXPECT_EQ(tracking.problem.num_variables(), 2 * n + boundaries);
      // prior, odometry, measurements, triples, boundaries, roll-pitch
      EXPECT_EQ(tracking.problem.num_soft_blocks(),
                1 + (n - 1) + measured + (n - 2) + boundaries + (run.planar ? 0 : poses));
    }
  }
}

TEST_P(ModeB, AddsBoundaryPointsToPosesNextToPoints) {
  const TrackingProblem tracking = make_tracking_problem(patterned(run, "PPppP"), mode_b());
  std::vector<std::string> names;
  for (int i = 0; i < tracking.problem.num_variables(); ++i) names.push_back(tracking.problem.name(i));
  EXPECT_THAT(names,
              ::testing::ElementsAre("chaser 0", "target 0", "chaser 1", "target 1", "target point 1", "chaser 2",
                                     "target 2", "chaser 3", "target 3", "chaser 4", "target 4", "target point 4"));
}

TEST_P(ModeB, ReportsOrientationOnlyOfPoses) {
  const std::string pattern = "ppPPp.P";
  const TrackingProblem tracking = make_tracking_problem(patterned(run, pattern), mode_b());
  for (std::size_t k = 0; k < pattern.size(); ++k)
    EXPECT_EQ(tracking.target_state(k).rotation.has_value(), pattern[k] == 'P') << k;
}

TEST_P(ModeB, HeldOutPoseGivesPoint) {
  TrackingData data = patterned(run, "ppPpP");
  data.sensors[1].measurements[0].held_out = true;
  const TrackingProblem tracking = make_tracking_problem(data, mode_b());
  EXPECT_FALSE(tracking.target_state(2).rotation.has_value());
  EXPECT_TRUE(tracking.target_state(4).rotation.has_value());
}

TEST_P(ModeB, EqualsModeAWithPosesOnly) {
  TrackingData data = patterned(run, "PPPPPP");
  data.sensors[1].measurements[3].position.x() += 0.4;  // for a nonzero cost
  TrackingProblem a = make_tracking_problem(data), b = make_tracking_problem(data, mode_b());
  EXPECT_EQ(cost(a), cost(b));
  const Summary solved_a = solve(a.problem, GaussNewtonOptions{}), solved_b = solve(b.problem, GaussNewtonOptions{});
  EXPECT_TRUE(solved_a.converged()) << solved_a.message;
  EXPECT_GT(solved_a.cost, 0.1);
  EXPECT_EQ(solved_a.cost, solved_b.cost);
}

/// Constant velocity of points is exact only for a target that moves straight.
TEST_P(ModeB, CostIsZeroAtTruthOfStraightTarget) {
  run.target_twist = twist(0.9, 0.0);
  for (const Pattern& p : kPatterns)
    for (const Junction junction : {Junction::boundary, Junction::direct}) {
      const TrackingData data = patterned(run, p.keyframes);
      TrackingProblem tracking = make_tracking_problem(data, mode_b(junction));
      run.set_truth(tracking);
      const Summary summary =
          solve(tracking.problem, GaussNewtonOptions{});  // set_truth() does not set boundary points
      EXPECT_LE(summary.cost, 1e-14) << p.keyframes;
      EXPECT_LE(run.largest_error(tracking), 1e-7) << p.keyframes;
    }
}

/// The difference is quadratic in σ of the boundary.
TEST_P(ModeB, BoundaryConvergesToDirectJunction) {
  TrackingData data = patterned(run, "pppPPPpp.ppPPp.p");
  for (TargetSensor& sensor : data.sensors)  // disturbances stretch the boundaries
    for (std::size_t i = 0; i < sensor.measurements.size(); ++i)
      sensor.measurements[i].position += 0.3 * Vector<3>(std::sin(3.0 * double(i)), std::cos(5.0 * double(i)), 0.0);
  TrackingProblem direct = make_tracking_problem(data, mode_b(Junction::direct));
  ASSERT_TRUE(solve(direct.problem, GaussNewtonOptions{}).converged());
  double before = HUGE_VAL;
  for (const double sigma : {1e-1, 1e-2, 1e-3}) {
    data.noise.boundary.setConstant(sigma);
    TrackingProblem boundary = make_tracking_problem(data, mode_b());
    const Summary summary = solve(boundary.problem, GaussNewtonOptions{});
    ASSERT_TRUE(summary.converged()) << summary.message;
    double distance = 0;
    for (std::size_t k = 0; k < direct.keyframes.size(); ++k)
      distance = std::max(distance, (boundary.target_state(k).position - direct.target_state(k).position).norm());
    EXPECT_LE(distance, before / 20) << sigma;
    before = distance;
  }
  EXPECT_LE(before, 1e-4) << "m, with σ = 1 mm";
}

TEST_P(ModeB, RequiresNoiseOfPoints) {
  TrackingData data = patterned(run, "PPpp");
  data.noise.constant_velocity.setZero();
  EXPECT_THAT([&] { make_tracking_problem(data, mode_b()); }, ThrowsMessage<Error>(HasSubstr("constant_velocity")));
  data = patterned(run, "PPpp");
  data.noise.boundary.setZero();
  EXPECT_THAT([&] { make_tracking_problem(data, mode_b()); }, ThrowsMessage<Error>(HasSubstr("boundary")));
  make_tracking_problem(data, mode_b(Junction::direct));  // does not need `boundary`
}

TEST_P(ModeB, RejectsOtherModels) {
  for (const MotionModel model : {MotionModel::constant_velocity, MotionModel::damped_velocity,
                                  MotionModel::white_noise_acceleration, MotionModel::steady_course})
    EXPECT_THAT([&] { make_tracking_problem(patterned(run, "PPpp"), {.model = model, .mode = Mode::B}); },
                ThrowsMessage<Error>(HasSubstr("mode B requires the constant-twist or the damped-twist model")));
}

INSTANTIATE_TEST_SUITE_P(Groups, ModeB, ::testing::Bool(), [](const auto& info) { return info.param ? "SE2" : "SE3"; });

}  // namespace
}  // namespace tandem::testing
