#include <cmath>

#include <gmock/gmock.h>

#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/heading_search/range_observability.hpp>
#include <tandem/solvers/heading_search/solve_tracking.hpp>

#include "problem/tracking/simulated_run.hpp"

/// Bearings of a target from a chaser that manoeuvres, or not.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;

class BearingsOnly : public ::testing::TestWithParam<std::tuple<bool, Mode>> {  // planar, mode
 protected:
  TrackingData data(const Vector<6>& chaser_twist) {
    run.chaser_twist = chaser_twist;
    run.target_twist = twist(0.5, 0.0);
    TrackingData d = run.data({{.name = "camera", .type = SensorType::bearing}}, every(1.0, 0.0, run.duration));
    for (std::size_t i = 0; i < d.sensors[0].measurements.size(); ++i)  // noise of one standard deviation
      d.sensors[0].measurements[i].azimuth += i % 3 == 0 ? 0.02 : -0.01;
    return d;
  }
  TrackingOptions options() const { return {.mode = std::get<1>(GetParam())}; }
  SimulatedRun run{.planar = std::get<0>(GetParam()), .duration = 60.0};
};

TEST_P(BearingsOnly, DoNotPullTheTargetIntoTheSensor) {
  for (const double speed : {0.0, 1.4}) {
    TrackingProblem tracking = make_tracking_problem(data(twist(speed, 0.0)), options());
    const Summary s = solve_tracking(tracking, GaussNewtonOptions{});
    // From a standing chaser, the orientations of Mode A converge too slowly for the iteration limit.
    if (speed > 0 || options().mode == Mode::B) {
      EXPECT_TRUE(s.converged()) << speed << " m/s: " << s.message;
      EXPECT_THAT(describe(s.unobservable), HasSubstr("target in range")) << speed << " m/s";
    }
    EXPECT_FALSE(range_is_observable(tracking, Marginals(tracking.problem)));
    const std::size_t k = tracking.assumed_range->keyframe;
    const Vector<3> seen = tracking.chaser_pose(k).inverse().act(tracking.target_state(k).position);
    EXPECT_GT(seen.norm(), 0.05) << speed << " m/s";
  }
}

TEST_P(BearingsOnly, DetermineTheRangeIfTheChaserTurns) {
  TrackingProblem tracking = make_tracking_problem(data(twist(1.4, 0.15)), options());
  const Summary s = solve_tracking(tracking, GaussNewtonOptions{});
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_EQ(describe(s.unobservable).find("range"), std::string::npos);
  EXPECT_TRUE(range_is_observable(tracking, Marginals(tracking.problem)));
}

INSTANTIATE_TEST_SUITE_P(All, BearingsOnly, ::testing::Combine(::testing::Bool(), ::testing::Values(Mode::A, Mode::B)));

}  // namespace
}  // namespace tandem::testing
