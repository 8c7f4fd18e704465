#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <tandem/problem/tracking/planar.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/heading_search/heading_starts.hpp>
#include <tandem/solvers/heading_search/solve_tracking.hpp>

/// Tests the search for headings in a gap between two intervals of optical measurements, from a guess in the wrong
/// basin.
namespace tandem::testing {
namespace {

constexpr double kDuration = 120.0, kFrom = 30.0, kTo = 90.0;  // [s]; no optical measurements from kFrom to kTo

/// Chaser at rest, and a target with a constant turn rate, by `turn` over the whole run.
TrackingData turning(double turn, bool planar = false) {
  TrackingData data;
  data.planar = planar;
  const auto sigmas = [&](Vector<6> v) {
    return planar ? Eigen::VectorXd(Vector<3>(v[0], v[1], v[5])) : Eigen::VectorXd(v);
  };
  data.noise.prior = sigmas(Vector<6>::Constant(1e-3));
  data.noise.odometry = sigmas(Vector<6>(0.01, 0.01, 0.01, 6e-4, 6e-4, 6e-4));
  data.noise.constant_twist = sigmas(Vector<6>(0.15, 0.05, 0.05, 0.02, 0.02, 0.06));
  data.noise.constant_velocity = Eigen::VectorXd::Constant(planar ? 2 : 3, 0.15);
  data.noise.boundary = Eigen::VectorXd::Constant(planar ? 2 : 3, 1e-3);
  TargetSensor usbl{.name = "usbl", .type = SensorType::position};
  usbl.sigma = Eigen::VectorXd::Constant(planar ? 2 : 3, 0.5);
  TargetSensor optical{.name = "optical", .type = SensorType::pose};
  optical.sigma = sigmas(Vector<6>(0.1, 0.1, 0.1, 0.04, 0.04, 0.04));
  const auto target = [&](double t) {
    const double rate = turn / kDuration;
    return SE3(SO3(), Vector<3>(10, 5, 0)) * SE3::Exp((Vector<6>() << 1, 0, 0, 0, 0, rate).finished() * t);
  };
  for (double t = 0; t <= kDuration; t += 1) {
    data.odometry.push_back({t, SE3()});
    const SE3 z = target(t);
    if (t > kFrom && t < kTo) {
      if (std::fmod(t, 4) == 0) usbl.measurements.push_back({.t = t, .position = z.translation()});
    } else {
      optical.measurements.push_back({.t = t, .position = z.translation(), .rotation = z.rotation()});
    }
  }
  data.sensors = {usbl, optical};
  return data;
}

TEST(HeadingGaps, LieBetweenOrientationMeasurements) {
  const TrackingProblem tracking = make_tracking_problem(turning(1.0));
  const auto gaps = heading_gaps(tracking, 10.0);
  ASSERT_EQ(gaps.size(), 1u);
  EXPECT_EQ(tracking.keyframes[gaps[0].first].t, kFrom + 1);
  EXPECT_EQ(tracking.keyframes[gaps[0].last].t, kTo - 1);
  EXPECT_TRUE(heading_gaps(tracking, 70.0).empty());
  TrackingOptions points;
  points.mode = Mode::B;
  EXPECT_TRUE(heading_gaps(make_tracking_problem(turning(1.0), points), 10.0).empty());
}

TEST(HeadingGaps, IncludeBothEndsOfARecording) {
  TrackingData data = turning(1.0);
  auto& optical = data.sensors[1].measurements;
  std::erase_if(optical, [](const Measurement& m) { return m.t < 20 || m.t > 100; });
  TrackingProblem tracking = make_tracking_problem(data);
  const auto gaps = heading_gaps(tracking, 15.0);
  ASSERT_EQ(gaps.size(), 3u);
  EXPECT_EQ(gaps[0].first, 0u);
  EXPECT_EQ(gaps[2].last, tracking.keyframes.size() - 1);
  const auto held = candidate_headings(tracking, gaps[2], HeadingCandidate::shorter_turn);
  EXPECT_NEAR(held.front(), held.back(), 1e-12);
}

TEST(HeadingGaps, GapVariablesIncludeTheMargin) {
  const TrackingProblem tracking = make_tracking_problem(turning(1.0));
  const HeadingGap gap = heading_gaps(tracking, 10.0)[0];
  const std::size_t keyframes = gap.last - gap.first + 1 + 2 * 5;
  const auto target = gap_variables(tracking, gap, 5, false), both = gap_variables(tracking, gap, 5, true);
  EXPECT_EQ(target.size(), keyframes);
  EXPECT_EQ(both.size(), 2 * keyframes);
  EXPECT_EQ(target.front(), tracking.problem.id(std::get<Variable<SE3>>(tracking.target[gap.first - 5])));
}

TEST(HeadingGaps, HeadingComparisons) {
  const double pi = std::numbers::pi;
  EXPECT_EQ(fraction_aligned({0.0, 1.0, 3.0, -3.0}, {0.1, 1.0 + pi, -3.0, 0.0}), 0.5);
  EXPECT_NEAR(max_heading_difference({3.0, 0.0}, {-3.0, 0.1}), 2 * pi - 6, 1e-12);
}

TEST(HeadingGaps, CandidatesTurnInBothDirections) {
  const TrackingProblem tracking = make_tracking_problem(turning(2.0));
  const HeadingGap gap = heading_gaps(tracking, 10.0)[0];
  const auto shorter = candidate_headings(tracking, gap, HeadingCandidate::shorter_turn);
  const auto longer = candidate_headings(tracking, gap, HeadingCandidate::longer_turn);
  EXPECT_GT(shorter.back(), shorter.front());
  EXPECT_LT(longer.back(), longer.front());
  const double step = (longer.back() - longer.front()) / double(longer.size() - 1);
  EXPECT_NEAR(60 * (shorter.back() - shorter.front()) / 58 - 60 * step, 2 * std::numbers::pi, 1e-9);
}

/// Starts with the target astern throughout the gap. A plain solve stays in that basin.
template <class Check>
void reversed_gap(const TrackingData& data, const TrackingOptions& options, Check check) {
  TrackingProblem reference = make_tracking_problem(data, options);
  const double least = solve(reference.problem, GaussNewtonOptions{}).cost;

  const auto start = [&] {
    TrackingProblem tracking = make_tracking_problem(data, options);
    const HeadingGap gap = heading_gaps(tracking, 10.0)[0];
    set_headings(tracking, gap, candidate_headings(tracking, gap, HeadingCandidate::reversed));
    return tracking;
  };
  TrackingProblem plain = start(), tracking = start();
  const Summary stuck = solve(plain.problem, GaussNewtonOptions{});
  EXPECT_GT(stuck.cost, least + 1.0);
  const Summary s = solve_tracking(tracking, GaussNewtonOptions{});
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_NEAR(s.cost, least, 1e-6 * (1 + least));
  EXPECT_GT(s.iterations, stuck.iterations);
  check(tracking);
  const HeadingSearch again = search_headings(tracking);
  EXPECT_EQ(again.gaps, 1);
  EXPECT_EQ(again.improved, 0);
}

TEST(SolveTracking, LeavesAPoorBasin) {
  reversed_gap(turning(1.0), {}, [](const TrackingProblem& tracking) {
    const std::size_t middle = tracking.keyframes.size() / 2;
    EXPECT_NEAR(heading(*tracking.target_state(middle).rotation), 0.5, 0.05);
  });
}
TEST(SolveTracking, LeavesAPoorBasinInThePlane) {
  reversed_gap(turning(1.0, true), {}, [](const TrackingProblem&) {});
}

TEST(SolveTracking, EqualsThePlainSolveWithoutAGap) {
  TrackingData data = turning(1.0);
  std::erase_if(data.sensors[1].measurements, [](const Measurement& m) { return m.t > kFrom; });
  TrackingOptions points;
  points.mode = Mode::B;
  TrackingProblem plain = make_tracking_problem(data, points), tracking = make_tracking_problem(data, points);
  const Summary a = solve(plain.problem, GaussNewtonOptions{}), b = solve_tracking(tracking, GaussNewtonOptions{});
  EXPECT_EQ(a.cost, b.cost);
  EXPECT_EQ(a.iterations, b.iterations);
}

}  // namespace
}  // namespace tandem::testing
