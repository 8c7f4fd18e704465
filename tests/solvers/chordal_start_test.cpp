#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/chordal_start.hpp>
#include <tandem/solvers/gauss_newton.hpp>

namespace tandem {
namespace {

/// A grid of poses with random orientations, each measured from its neighbours with noise of these standard deviations.
template <LieGroup G>
struct Grid {
  std::vector<G> truth;
  std::vector<PoseEdge<G>> edges;

  Grid(double metres, double radians) {
    constexpr int kSide = 6, n = G::point_dim;
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    const auto drawn = [&](double position, double rotation) {
      typename G::Tangent e;
      for (int i = 0; i < G::dof; ++i) e[i] = (i < n ? position : rotation) * normal(random);
      return e;
    };
    Eigen::VectorXd sigma = Eigen::VectorXd::Constant(G::dof, radians > 0 ? radians : 1);
    sigma.head(n).setConstant(metres > 0 ? metres : 1);
    for (int k = 0; k < kSide * kSide; ++k) {
      truth.push_back(G::Exp(drawn(3, 1.5)));
      for (const int from : {k - 1, k - kSide})
        if (from >= 0) {
          const G z = truth[std::size_t(from)].inverse() * truth.back() * G::Exp(drawn(metres, radians));
          edges.push_back({from, k, z, Gaussian(sigma)});
        }
    }
  }

  Summary solve_from(const std::vector<G>& start) const {
    Problem problem;
    std::vector<Variable<G>> x;
    for (const G& pose : start) x.push_back(problem.add(pose));
    problem.fix(x[0]);
    for (const PoseEdge<G>& e : edges)
      problem.minimize(RelativePose<G>{e.z}, e.noise, {x[std::size_t(e.from)], x[std::size_t(e.to)]});
    return solve(problem, GaussNewtonOptions{});
  }
};

template <class G>
class ChordalStart : public ::testing::Test {};
using Groups = ::testing::Types<SE2, SE3>;
TYPED_TEST_SUITE(ChordalStart, Groups);

TYPED_TEST(ChordalStart, IsExactWithoutNoise) {
  const Grid<TypeParam> grid(0, 0);
  const auto found = chordal_start<TypeParam>(int(grid.truth.size()), grid.edges, grid.truth[0]);
  for (std::size_t i = 0; i < found.size(); ++i)
    EXPECT_LE((grid.truth[i].inverse() * found[i]).Log().norm(), 1e-9) << i;
}

/// The minimum equals the minimum from the true poses, for any distance of the poses from the first one.
TYPED_TEST(ChordalStart, LeadsToTheMinimumOfTheTruth) {
  const Grid<TypeParam> grid(0.2, 0.2);
  const Summary from_truth = grid.solve_from(grid.truth);
  const Summary found = grid.solve_from(chordal_start<TypeParam>(int(grid.truth.size()), grid.edges, grid.truth[0]));
  EXPECT_TRUE(found.converged()) << found.message;
  EXPECT_NEAR(found.cost, from_truth.cost, 1e-6 * from_truth.cost);
  std::vector<TypeParam> odometry{grid.truth[0]};
  for (const auto& edge : grid.edges)
    if (edge.to == int(odometry.size()) && edge.from + 1 == edge.to) odometry.push_back(odometry.back() * edge.z);
  EXPECT_LT(found.initial_cost, grid.solve_from(odometry).initial_cost);
}

TYPED_TEST(ChordalStart, NamesUnconnectedAndUnknownPoses) {
  const std::vector<PoseEdge<TypeParam>> edges{{0, 1, TypeParam(), Gaussian(Eigen::VectorXd::Ones(TypeParam::dof))}};
  const auto start = [&](int poses) { chordal_start<TypeParam>(poses, edges); };
  EXPECT_THAT([&] { start(3); }, ::testing::ThrowsMessage<BadInputError>(::testing::HasSubstr("pose 2 to pose 0")));
  EXPECT_THAT([&] { start(1); }, ::testing::ThrowsMessage<BadInputError>(::testing::HasSubstr("pose 1")));
  EXPECT_TRUE(chordal_start<TypeParam>(0, {}).empty());
}

}  // namespace
}  // namespace tandem
