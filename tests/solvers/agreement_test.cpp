#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cases.hpp"
#include "problem/tracking/simulated_tracking.hpp"

/// Tests that all solvers find the same optimum of noisy tracking problems.
namespace tandem::testing {
namespace {

std::vector<AnySolver> soft_solvers() {
  std::vector<AnySolver> solvers = main_solvers();
  for (const std::string& algorithm : nlopt_algorithms()) solvers.push_back(nlopt(algorithm));
  return solvers;
}

struct Result {
  Summary summary;
  std::vector<SE3> target;
};

Result solve(const TrackingData& data, const TrackingOptions& options, const AnySolver& solver) {
  TrackingProblem tracking = make_tracking_problem(data, options);
  Result result{solver(tracking.problem), {}};
  EXPECT_TRUE(result.summary.converged()) << solver << ": " << result.summary.message;
  EXPECT_LE(result.summary.max_violation, 1e-6) << solver;
  for (const auto& x : tracking.target) result.target.push_back(tracking.problem.value(pose(x)));
  return result;
}

void expect_same(const Result& a, const Result& b, const AnySolver& solver) {
  EXPECT_NEAR(a.summary.cost, b.summary.cost, 1e-6 * b.summary.cost) << solver;
  ASSERT_EQ(a.target.size(), b.target.size());
  // The root of the cost tolerance, times standard deviations of about 0.1.
  for (std::size_t k = 0; k < a.target.size(); ++k)
    EXPECT_LE((a.target[k].inverse() * b.target[k]).Log().norm(), 5e-3) << solver << " at keyframe " << k;
}

TEST(Agreement, AllSolversAgreeOnASoftProblem) {
  const TrackingData data = noisy(8.0).data();
  const Result reference = solve(data, {}, soft_solvers().front());
  EXPECT_GT(reference.summary.cost, 5.0);
  for (const AnySolver& solver : soft_solvers()) expect_same(solve(data, {}, solver), reference, solver);
}

TEST(Agreement, SolversAgreeOnSoftLimitsAndNonHolonomicMotion) {
  const TrackingData data = noisy(8.0).data();
  const TrackingOptions options{
      .non_holonomic = Role::soft, .surge = between(0.0, 0.8), .max_yaw_rate = 0.05, .limits = Role::soft};
  const Result reference = solve(data, options, main_solvers().front());
  for (const AnySolver& solver : main_solvers()) expect_same(solve(data, options, solver), reference, solver);
}

class RobustLoss : public ::testing::TestWithParam<Loss> {};
INSTANTIATE_TEST_SUITE_P(Losses, RobustLoss, ::testing::Values(Huber(1.0), Cauchy(1.0), GemanMcClure(3.0), Tukey(5.0)));

TEST_P(RobustLoss, SolversFindTheSameOptimum) {
  Simulation simulation = noisy(8.0);
  simulation.noise = 0.5;  // little noise, so that redescending losses have a single minimum nearby
  TrackingData data = simulation.data();
  data.sensors[0].measurements[1].position += Vector<3>(8.0, -5.0, 3.0);  // an outlier of 20 standard deviations
  const TrackingOptions options{.loss = GetParam()};
  const Result reference = solve(data, options, main_solvers().front());
  const Result plain = solve(data, {}, main_solvers().front());
  EXPECT_LT(reference.summary.cost, 0.5 * plain.summary.cost) << "the outlier has less weight";
  for (const AnySolver& solver : main_solvers()) expect_same(solve(data, options, solver), reference, solver);
}

TEST(Agreement, SolversAgreeOnHardConstraints) {
  const TrackingData data = noisy(6.0).data();
  const Bounds<1> slow = between(0.0, 0.85);
  for (const TrackingOptions& options :
       {TrackingOptions{.non_holonomic = Role::hard}, TrackingOptions{.roll_pitch = Role::hard},
        TrackingOptions{.surge = slow, .max_yaw_rate = 0.05},
        TrackingOptions{.roll_pitch = Role::hard, .non_holonomic = Role::hard, .surge = slow, .max_yaw_rate = 0.05}}) {
    const double unconstrained =
        solve(data, {.roll_pitch = options.roll_pitch == Role::hard ? Role::off : Role::soft}, main_solvers().front())
            .summary.cost;
    std::optional<Result> reference;
    for (const AnySolver& solver : hard_solvers()) {
      const Result result = solve(data, options, solver);
      EXPECT_GT(result.summary.cost, unconstrained) << "the constraints are active";
      if (!reference) reference = result;
      expect_same(result, *reference, solver);
    }
  }
}

}  // namespace
}  // namespace tandem::testing
