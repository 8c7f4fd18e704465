#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/heading_search/slow_turns.hpp>
#include <tandem/solvers/heading_search/solve_tracking.hpp>

namespace tandem::testing {
namespace {

/// Brute force over all choices of at most one turn per keyframe. Stretch i overlaps with i − 1 only.
double least_cost(const std::vector<std::vector<SlowTurn>>& turns, bool even, std::size_t i = 0, int sum = 0,
                  bool free = true) {
  if (i == turns.size()) return even && sum % 2 != 0 ? HUGE_VAL : 0;
  double least = least_cost(turns, even, i + 1, sum);
  if (!free) return least;
  for (const SlowTurn& t : turns[i]) {
    const bool next_free = i + 1 == turns.size() || turns[i + 1][0].stretch.first > t.stretch.last;
    least = std::min(least, t.cost + least_cost(turns, even, i + 1, sum + t.half_turns, next_free));
  }
  return least;
}

TEST(SlowTurns, CombinationEqualsTheBestOfAllCombinations) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0.2);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<std::vector<SlowTurn>> turns(6);
    std::size_t first = 0;
    for (auto& at : turns) {
      first += 6 + random() % 8;
      for (const int half_turns : {-1, 1, 2}) at.push_back({half_turns, normal(random), {first, first + 9}, {}});
    }
    for (const bool even : {false, true}) {
      double cost = 0;
      int half_turns = 0;
      std::size_t next = 0;
      for (const SlowTurn* t : best_turns(turns, even)) {
        EXPECT_GE(t->stretch.first, next);
        next = t->stretch.last + 1;
        cost += t->cost;
        half_turns += t->half_turns;
      }
      EXPECT_NEAR(cost, least_cost(turns, even), 1e-12);
      if (even) EXPECT_EQ(half_turns % 2, 0);
    }
  }
}

/// Position and heading of a target that goes ahead in a left turn, stops, goes astern, stops, and goes ahead in a right
/// turn. The headings at the beginning and the end are equal.
std::vector<SE3> ahead_and_astern(bool planar) {
  std::vector<SE3> poses;
  double x = 10, y = 5, yaw = 0;
  const auto ramp = [](double t, double from, double to) { return std::clamp((t - from) / (to - from), 0.0, 1.0); };
  for (double t = 0; t <= 240; t += 1) {
    poses.push_back(SE3(SO3::Exp({0, 0, yaw}), Vector<3>(x, y, planar ? 0 : -8)));
    const double speed = 0.8 * (1 - 2 * ramp(t, 80, 100) + 2 * ramp(t, 140, 160));
    x += speed * std::cos(yaw);
    y += speed * std::sin(yaw);
    yaw += t >= 30 && t < 80 ? 0.05 : t >= 160 && t < 210 ? -0.05 : 0.0;
  }
  return poses;
}

/// Measures positions each 4 s, and poses in the first and last 20 s, from a chaser at rest.
TrackingData data_of(const std::vector<SE3>& poses, bool planar) {
  TrackingData data;
  data.planar = planar;
  const auto sigmas = [&](Vector<6> v) {
    return planar ? Eigen::VectorXd(Vector<3>(v[0], v[1], v[5])) : Eigen::VectorXd(v);
  };
  data.noise.prior = sigmas(Vector<6>::Constant(1e-3));
  data.noise.odometry = sigmas(Vector<6>(0.01, 0.01, 0.01, 6e-4, 6e-4, 6e-4));
  data.noise.constant_twist = sigmas(Vector<6>(0.15, 0.05, 0.05, 0.02, 0.02, 0.06));
  TargetSensor usbl{.name = "usbl", .type = SensorType::position};
  usbl.sigma = Eigen::VectorXd::Constant(planar ? 2 : 3, 0.5);
  TargetSensor optical{.name = "optical", .type = SensorType::pose};
  optical.sigma = sigmas(Vector<6>(0.1, 0.1, 0.1, 0.04, 0.04, 0.04));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double t = double(i);
    data.odometry.push_back({t, SE3()});
    const Vector<3> position = poses[i].translation();
    if (t <= 20 || t >= 220)
      optical.measurements.push_back({.t = t, .position = position, .rotation = poses[i].rotation()});
    else if (i % 4 == 0)
      usbl.measurements.push_back({.t = t, .position = position});
  }
  data.sensors = {usbl, optical};
  return data;
}

class AheadAndAstern : public ::testing::TestWithParam<std::tuple<bool, MotionModel>> {};  // planar

/// The initial guess goes ahead all the time, with a half turn at each stop. Neither half turn can be removed without
/// the other.
TEST_P(AheadAndAstern, RemovesTheHalfTurnsAtBothStops) {
  const auto [planar, model] = GetParam();
  const std::vector<SE3> poses = ahead_and_astern(planar);
  const TrackingData data = data_of(poses, planar);
  TrackingOptions options;
  options.model = model;
  TrackingProblem tracking = make_tracking_problem(data, options), reference = make_tracking_problem(data, options);
  const HeadingGap gap = heading_gaps(reference, 10.0)[0];
  std::vector<double> truth;
  for (std::size_t k = gap.first; k <= gap.last; ++k)
    truth.push_back(poses[std::size_t(std::lround(reference.keyframes[k].t))].rotation().Log().z());
  set_headings(reference, gap, truth);
  const double best = solve(reference.problem, GaussNewtonOptions{}).cost;
  const Summary s = solve_tracking(tracking, GaussNewtonOptions{});
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_LE(s.cost, best * (1 + 1e-6));
  EXPECT_LT(max_heading_difference(headings(tracking, gap), truth), 1.0);
}

INSTANTIATE_TEST_SUITE_P(All, AheadAndAstern,
                         ::testing::Combine(::testing::Bool(),
                                            ::testing::Values(MotionModel::constant_twist,
                                                              MotionModel::white_noise_acceleration)));

}  // namespace
}  // namespace tandem::testing
