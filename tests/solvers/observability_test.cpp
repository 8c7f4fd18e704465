#include <cmath>

#include <gmock/gmock.h>

#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/range.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

/// Tests what the library reports about directions along which the cost is constant.
namespace tandem::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Boat on a winding course of which a fixed sensor measures positions. The motion noise along x is `ratio` times that
/// along y. All lengths are in units of `unit` metres.
struct Boat {
  Boat(int n, double ratio, double unit, double fix_sigma = 0.3) {
    const auto sensor = problem.add(SE2(), "sensor");
    problem.fix(sensor);
    double course = 0.3;
    Vector<2> p(-30, 5);
    for (int k = 0; k < n; ++k) {
      const Vector<2> noise(std::sin(17.0 * k * k + 1), std::sin(29.0 * k * k + 2));
      const Vector<2> fix = unit * Vector<2>(p + 0.3 * noise);
      x.push_back(problem.add(SE2(SO2(course), fix), "boat " + std::to_string(k)));
      problem.minimize(UsblPosition<SE2>{fix}, Gaussian{fix_sigma * unit, fix_sigma * unit}, {sensor, x.back()});
      if (k >= 2)
        problem.minimize(ConstantTwist<SE2>{1, 1}, Gaussian{ratio * 0.05 * unit, 0.05 * unit, 0.02},
                         {x[std::size_t(k - 2)], x[std::size_t(k - 1)], x[std::size_t(k)]});
      course += 0.05 * std::sin(0.2 * k);
      p += Vector<2>(std::cos(course), std::sin(course));
    }
  }
  Problem problem;
  std::vector<Variable<SE2>> x;
};

/// If all boats turn by one angle, the residuals of the motion turn, too. With equal noise along x and y, their norm is
/// constant, although the Gauss-Newton Hessian has curvature along the turn.
TEST(Observability, ReportsATurnOfResidualsThatAreNotZero) {
  for (const double unit : {1.0, 1e-3, 1e3})
    for (const double fix_sigma : {0.3, 0.03}) {
      Boat boat(80, 1, unit, fix_sigma);
      const Summary s = solve(boat.problem, GaussNewtonOptions{});
      ASSERT_TRUE(s.converged()) << s.message;
      ASSERT_EQ(s.unobservable.size(), boat.x.size()) << unit << " " << fix_sigma;
      for (const UnobservableState& state : s.unobservable) EXPECT_THAT(state.directions, ElementsAre("heading"));
      const Marginals marginals(boat.problem);
      EXPECT_EQ(marginals.unobservable().size(), boat.x.size());
      for (const auto& x : boat.x) {
        const Matrix<3, 3> S = marginals.covariance(x);
        EXPECT_EQ(S(2, 2), HUGE_VAL);
        EXPECT_TRUE((S.topLeftCorner<2, 2>().allFinite()));
        EXPECT_LT(std::sqrt(S.topLeftCorner<2, 2>().trace()), 2 * fix_sigma * unit);
      }
    }
}

/// Propagated covariances and the log determinant are those of the Gauss-Newton Hessian, which has curvature along the
/// turn. They are the same whether the turn is searched for or not.
TEST(Observability, GaugesDoNotChangePropagatedCovariances) {
  Boat boat(80, 1, 1.0);
  ASSERT_TRUE(solve(boat.problem, GaussNewtonOptions{}).converged());
  const Marginals marginals(boat.problem), without = Marginals::without_gauges(boat.problem);
  EXPECT_EQ(marginals.unobservable().size(), boat.x.size());
  EXPECT_TRUE(without.unobservable().empty());
  EXPECT_EQ(marginals.log_determinant(), without.log_determinant());
  EXPECT_NO_THROW(without.require_regular());
  for (const auto& x : boat.x) {
    const std::vector<int> ids = {boat.problem.id(x)}, dofs = {3};
    const Matrix<3, 3> J = Matrix<3, 3>::Identity();
    EXPECT_EQ(marginals.propagated(J, ids, dofs), without.propagated(J, ids, dofs));
    EXPECT_GT(without.propagated(J, ids, dofs)(2, 2), 0);
  }
}

/// A null direction of the Hessian makes the problem singular, whether gauges are searched for or not.
TEST(Observability, NullDirectionsAreFoundWithoutGauges) {
  Problem problem;
  const auto q = problem.add(SE2(), "boat"), w = problem.add(SE2::Exp({1, 2, 0.3}), "buoy");
  problem.minimize(Prior<SE2>{SE2()}, Gaussian{0.1, 0.1, 0.1}, {q});
  problem.minimize(UsblPosition<SE2>{Vector<2>(1, 2)}, Gaussian{0.1, 0.1}, {q, w});
  const Marginals without = Marginals::without_gauges(problem);
  EXPECT_THROW(without.require_regular(), NotObservableError);
  const std::vector<int> ids = {problem.id(w)}, dofs = {3};
  EXPECT_EQ(without.propagated(Matrix<3, 3>::Identity(), ids, dofs)(2, 2), HUGE_VAL);
}

TEST(Observability, ReportsNoTurnIfTheNoiseDistinguishesTheAxes) {
  for (const double unit : {1.0, 1e-3, 1e3}) {
    Boat boat(80, 0.5, unit);
    const Summary s = solve(boat.problem, GaussNewtonOptions{});
    ASSERT_TRUE(s.converged()) << s.message;
    EXPECT_EQ(describe(s.unobservable), "") << unit;
    EXPECT_TRUE(Marginals(boat.problem).covariance(boat.x[40]).allFinite());
  }
}

/// A pose measured by two ranges has four unobservable directions, of which rounding leaves some curvature.
template <LieGroup G>
void expect_two_ranges_to_converge(const G& start, const G& a, const G& b, double unit, std::size_t dof) {
  for (const int secant_pairs : {8, 0}) {
    Problem problem;
    const auto x = problem.add(start, "vehicle"), first = problem.add(a), second = problem.add(b);
    problem.fix(first);
    problem.fix(second);
    problem.minimize(Range<G>{5 * unit}, Gaussian{0.1 * unit}, {x, first});
    problem.minimize(Range<G>{8 * unit}, Gaussian{0.1 * unit}, {x, second});
    GaussNewtonOptions options;
    options.secant_pairs = secant_pairs;
    const Summary s = solve(problem, options);
    EXPECT_TRUE(s.converged()) << s.message << ", unit " << unit;
    EXPECT_LT(s.cost, 1e-10);
    EXPECT_LT(s.iterations, 60);
    EXPECT_LT(problem.value(x).translation().norm(), 10 * unit);
    ASSERT_EQ(s.unobservable.size(), 1u);
    EXPECT_GE(s.unobservable[0].directions.size(), dof - 2);
  }
}

TEST(Observability, RoundingIsNotInformation) {
  for (const double unit : {1.0, 1e-6, 1e6}) {
    const SE3 b(SO3(), Vector<3>(10 * unit, 0, 0));
    for (const Vector<3>& p : {Vector<3>(1, 2, 3), Vector<3>(4, 4, 0), Vector<3>(100, 20, 3)})
      for (const Vector<3>& turn : {Vector<3>(0, 0, 0), Vector<3>(0.3, -1, 2)})
        expect_two_ranges_to_converge(SE3(SO3::Exp(turn), Vector<3>(unit * p)), SE3(), b, unit, 6);
    expect_two_ranges_to_converge(SE2(SO2(0.4), Vector<2>(unit * Vector<2>(1, 2))), SE2(),
                                  SE2(SO2(), Vector<2>(unit * Vector<2>(10, 0))), unit, 3);
  }
}

/// A prior that is looser than the rest of the problem by many decades still gives exact covariances.
TEST(Observability, LoosePriorsKeepTheirCovariances) {
  for (const double sigma : {1e2, 1e5, 1e8}) {
    Problem problem;
    std::vector<Variable<R3>> x;
    for (int k = 0; k < 50; ++k) {
      x.push_back(problem.add(R3(), "x" + std::to_string(k)));
      if (k > 0)
        problem.minimize(RelativePose<R3>{R3()}, Gaussian{0.01, 0.02, 0.03}, {x[std::size_t(k - 1)], x.back()});
    }
    problem.minimize(Prior<R3>{R3()}, Gaussian{sigma, 2 * sigma, 3.0}, {x[0]});
    const Summary s = solve(problem, GaussNewtonOptions{});
    EXPECT_TRUE(s.converged()) << s.message;
    EXPECT_EQ(describe(s.unobservable), "") << sigma;
    const Marginals marginals(problem);
    for (const std::size_t k : {0u, 20u, 49u}) {
      const Matrix<3, 3> S = marginals.covariance(x[k]);
      EXPECT_NEAR(S(0, 0) / (sigma * sigma + 1e-4 * double(k)), 1, 1e-6) << sigma << " " << k;
      EXPECT_NEAR(S(1, 1) / (4 * sigma * sigma + 4e-4 * double(k)), 1, 1e-6) << sigma << " " << k;
      EXPECT_NEAR(S(2, 2), 9 + 9e-4 * double(k), 1e-8) << sigma << " " << k;
      EXPECT_LT(std::abs(S(0, 1)), 1e-8 * sigma * sigma);
    }
    const double log_det = -49 * 2 * (std::log(0.01) + std::log(0.02) + std::log(0.03)) -
                           2 * (std::log(sigma) + std::log(2 * sigma) + std::log(3.0));
    EXPECT_NEAR(marginals.log_determinant(), log_det, 1e-6) << sigma;
  }
}

/// The difference of two unobservable positions is known.
TEST(Observability, FunctionsOfUnobservableStatesCanBeKnown) {
  Problem problem;
  const auto a = problem.add(R3(), "a"), b = problem.add(R3(), "b");
  problem.minimize(RelativePose<R3>{R3()}, Gaussian{0.1, 0.2, 0.3}, {a, b});
  EXPECT_TRUE(solve(problem, GaussNewtonOptions{}).converged());
  const Marginals marginals(problem);
  EXPECT_EQ(marginals.covariance(a)(0, 0), HUGE_VAL);
  EXPECT_EQ(marginals.covariance(b)(2, 2), HUGE_VAL);
  Matrix<3, 6> J;
  J << -Matrix<3, 3>::Identity(), Matrix<3, 3>::Identity();
  const std::vector<int> ids{problem.id(a), problem.id(b)}, dofs{3, 3};
  const Eigen::MatrixXd known = marginals.propagated(J, ids, dofs);
  EXPECT_TRUE(known.isApprox(Vector<3>(0.01, 0.04, 0.09).asDiagonal().toDenseMatrix(), 1e-12));
  EXPECT_EQ(marginals.propagated(J.leftCols<3>(), std::vector{problem.id(a)}, std::vector{3})(1, 1), HUGE_VAL);
}

}  // namespace
}  // namespace tandem::testing
