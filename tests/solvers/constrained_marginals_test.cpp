#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problem/tracking/simulated_tracking.hpp"
#include "solvers/marginals_cases.hpp"

/// Compares marginals under hard equalities with the dense null-space method in extended precision.
namespace tandem::testing {
namespace {

constexpr double kConstrainedTolerance = 1e-8;

/// Residual aᵀx + bᵀy.
struct Along {
  static constexpr std::string_view name = "along";
  static constexpr int dim = 1;
  using States = std::tuple<R3, R3>;
  Vector<3> a, b;
  void operator()(const R3& x, const R3& y, Vector<1>& r, Matrix<1, 3>* Jx = nullptr,
                  Matrix<1, 3>* Jy = nullptr) const {
    r[0] = a.dot(x.vector()) + b.dot(y.vector());
    if (Jx) *Jx = a.transpose();
    if (Jy) *Jy = b.transpose();
  }
};

/// Chain of points with a prior on the first one and weak relative residuals.
struct Points {
  Problem problem;
  std::vector<Variable<R3>> x;
  explicit Points(int n, bool ties = true) {
    for (int k = 0; k < n; ++k) x.push_back(problem.add(R3(Vector<3>(k, 0.3 * k, 0)), "point " + std::to_string(k)));
    problem.minimize(Prior<R3>{R3()}, Gaussian{0.1, 0.2, 0.3}, {x[0]});
    for (int k = 1; ties && k < n; ++k)
      problem.minimize(RelativePose<R3>{R3()}, Gaussian{0.5, 0.1 * k, 0.3}, {x[std::size_t(k) - 1], x[std::size_t(k)]});
  }
  void constrain(const Vector<3>& a, int i, const Vector<3>& b, int j) {
    problem.subject_to(Along{a, b}, equal_to(0), {x[std::size_t(i)], x[std::size_t(j)]});
  }
  double error() { return compare(problem, x).error; }
};

const Vector<3> kZero = Vector<3>::Zero();

TEST(ConstrainedMarginals, MatchTheDenseMethodForMixedGroups) {
  MixedProblem mixed;
  const auto& v = mixed.v;
  const Comparison c =
      compare(mixed.problem, std::vector{v.a, v.b, v.c}, std::vector{v.p}, std::vector{v.q}, std::vector{v.s});
  EXPECT_LE(c.error, kConstrainedTolerance);
  EXPECT_EQ(c.pairs, 36);
}

TEST(ConstrainedMarginals, AreZeroAlongConstrainedDirections) {
  MixedProblem mixed;
  const DenseMarginals reference(mixed.problem);
  ASSERT_EQ(reference.A.rows(), 4);
  const Marginals marginals(mixed.problem);
  const auto& v = mixed.v;
  const Matrix<12, 12> ab = marginals.joint(v.a, v.b);
  const Matrix<6, 6> qp = marginals.joint(v.q, v.p);
  for (int row = 0; row < 4; ++row) {
    const auto part = [&](const auto& x) -> Eigen::VectorXd {
      const int b = reference.block_of_id[std::size_t(mixed.problem.id(x))];
      return reference.A.row(row).segment(reference.first[std::size_t(b)],
                                          reference.first[std::size_t(b) + 1] - reference.first[std::size_t(b)]);
    };
    Vector<12> on_ab;
    on_ab << part(v.a), part(v.b);
    Vector<6> on_qp;
    on_qp << part(v.q), part(v.p);
    EXPECT_LE((ab * on_ab).norm(), 1e-13 * ab.norm());
    EXPECT_LE((qp * on_qp).norm(), 1e-13 * qp.norm());
    EXPECT_GT(on_ab.norm() + on_qp.norm(), 0.5) << "the row reads one of these pairs";
  }
}

TEST(ConstrainedMarginals, AreZeroForFullyConstrainedVariables) {
  Points points(5);
  points.problem.subject_to(Prior<R3>{R3()}, equal_to(0), {points.x[2]});
  EXPECT_LE(points.error(), 1e-12);
  const Marginals marginals(points.problem);
  EXPECT_TRUE(marginals.covariance(points.x[2]).isZero(1e-30));
  EXPECT_TRUE(marginals.cross_covariance(points.x[2], points.x[4]).isZero(1e-30));
  EXPECT_TRUE(marginals.cross_covariance(points.x[0], points.x[4]).isZero(1e-15))
      << "the constrained point separates the chain";
}

/// H is singular, because no soft residual reads the later points.
TEST(ConstrainedMarginals, AllowASingularHessian) {
  Points points(6, false);
  for (int k = 1; k < 6; ++k)
    points.problem.subject_to(RelativePose<R3>{R3()}, equal_to(0),
                              {points.x[std::size_t(k) - 1], points.x[std::size_t(k)]});
  EXPECT_LE(points.error(), 1e-12);
  EXPECT_TRUE(Marginals(points.problem)
                  .covariance(points.x[5])
                  .isApprox(Vector<3>(0.01, 0.04, 0.09).asDiagonal().toDenseMatrix(), 1e-12));
}

TEST(ConstrainedMarginals, NameUnobservableDirections) {
  Points points(3, false);
  points.constrain({1, 0, 0}, 0, {-1, 0, 0}, 1);
  points.problem.subject_to(RelativePose<R3>{R3()}, equal_to(0), {points.x[1], points.x[2]});
  const Marginals marginals(points.problem);  // the common y and z of two points are unobservable
  EXPECT_THAT(describe(marginals.unobservable()), ::testing::HasSubstr("point 2 in y, z"));
  EXPECT_EQ(marginals.covariance(points.x[2])(1, 1), HUGE_VAL);
  EXPECT_TRUE(std::isfinite(marginals.covariance(points.x[2])(0, 0)));
  EXPECT_THROW(marginals.require_regular(), Error);
}

TEST(ConstrainedMarginals, AllowRedundantRows) {
  Points points(8);
  const Vector<3> a(0.3, -1.0, 0.5), b(0.2, 0.8, -1.1);
  for (int twice = 0; twice < 3; ++twice) points.constrain(a * (1.0 + twice), 2, b * (1.0 + twice), 3);
  for (int k = 0; k < 7; ++k) points.constrain(a, k, -a, k + 1);  // a loop of such rows
  points.constrain(a, 0, -a, 7);
  points.constrain(a, 1, -a, 5);
  EXPECT_LE(points.error(), kConstrainedTolerance);
}

TEST(ConstrainedMarginals, AllowRowsOfAnyScale) {
  for (const double scale : {1e-9, 1e-3, 1e4, 1e9}) {
    Points points(8);
    const Vector<3> a(0.3, -1.0, 0.5), b(0.2, 0.8, -1.1);
    points.constrain(a * scale, 2, b * scale, 3);
    points.constrain(b / scale, 3, a / scale, 4);
    points.constrain(b, 5, kZero, 6);
    EXPECT_LE(points.error(), 1e-12) << scale;
  }
}

/// Rows that differ by δ lose digits as eps / δ.
TEST(ConstrainedMarginals, AllowNearlyRedundantRows) {
  for (const double delta : {1e-1, 1e-3, 1e-5, 1e-7}) {
    Points points(8);
    const Vector<3> a(0.3, -1.0, 0.5), b(0.2, 0.8, -1.1), c(1.0, 0.4, -0.3);
    points.constrain(a, 2, b, 3);
    points.constrain(a + delta * c, 2, b, 3);
    points.constrain(a, 5, b, 6);
    points.constrain(a, 5, b - delta * c, 6);
    EXPECT_LE(points.error(), kConstrainedTolerance) << delta;
  }
}

/// The variable that is eliminated first has a small coefficient. This elimination order loses digits as the square of
/// the ratio, as Marginals documents: the error is 3e-8 at 1e-4.
TEST(ConstrainedMarginals, AllowRowsWithSmallCoefficients) {
  for (const double small : {1e-1, 1e-2, 1e-3}) {
    Points points(8);
    const Vector<3> a(0.3, -1.0, 0.5), b(0.2, 0.8, -1.1);
    points.constrain(a * small, 2, b, 3);
    points.constrain(a, 5, b * small, 6);
    EXPECT_LE(points.error(), kConstrainedTolerance) << small;
  }
}

TEST(ConstrainedMarginals, AllowFixedVariables) {
  Points points(6);
  const Vector<3> a(0.3, -1.0, 0.5), b(0.2, 0.8, -1.1);
  points.constrain(a, 1, b, 2);
  points.constrain(a, 2, b, 3);
  points.problem.fix(points.x[2]);
  EXPECT_LE(points.error(), 1e-12);
  points.problem.fix(points.x[1]);  // the first row now reads no free variable
  EXPECT_LE(points.error(), 1e-12);
}

/// Stars, which need AMD's order; rows pass through several fronts before they are used.
TEST(ConstrainedMarginals, MatchTheDenseMethodForStars) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937_64 random(seed);
    const auto pick = [&](int n) { return static_cast<int>(random() % unsigned(n)); };
    Points points(16);
    for (int k = 2; k < 16; ++k)
      points.problem.minimize(RelativePose<R3>{R3()}, Gaussian{1, 2, 3}, {points.x[0], points.x[std::size_t(k)]});
    for (int i = 0; i < 24; ++i)
      points.constrain(random_vector(3, 1.0, seed * 100 + unsigned(i)), pick(16),
                       random_vector(3, 1.0, seed * 1000 + unsigned(i)), pick(16));
    EXPECT_LE(points.error(), kConstrainedTolerance) << seed;
  }
}

TEST(ConstrainedMarginals, MatchTheDenseMethodForANonHolonomicTarget) {
  Simulation simulation;
  simulation.duration = 12.0;
  TrackingOptions options;
  options.non_holonomic = Role::hard;
  options.surge = at_least(0.0);
  TrackingProblem tracking = make_tracking_problem(simulation.data(), options);
  const Comparison c = compare(tracking.problem, poses(tracking.chaser), poses(tracking.target));
  EXPECT_LE(c.error, kConstrainedTolerance);
}

}  // namespace
}  // namespace tandem::testing
