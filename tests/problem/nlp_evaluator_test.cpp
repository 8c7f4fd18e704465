#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include <tandem/residuals/steady_course.hpp>

#include "mixed_problem.hpp"

namespace tandem::testing {
namespace {

/// Finite differences are accurate to about 1e-11 of the largest entry here.
constexpr double kTolerance = 1e-9;

void expect_equal(const Eigen::MatrixXd& given, const Eigen::MatrixXd& expected, double tolerance = kTolerance) {
  ASSERT_EQ(given.rows(), expected.rows());
  ASSERT_EQ(given.cols(), expected.cols());
  EXPECT_LE((given - expected).cwiseAbs().maxCoeff(), tolerance * expected.cwiseAbs().maxCoeff());
}

Eigen::VectorXd constraints(NlpEvaluator& nlp) {
  Eigen::VectorXd c(nlp.num_rows());
  nlp.constraints(c);
  return c;
}

template <class R, class Handles>
Vector<R::dim> rows(const R& residual, const Handles& x, const Problem& problem) {
  Vector<R::dim> r;
  std::apply([&](const auto&... handle) { residual(problem.value(handle)..., r); }, x);
  return r;
}

class NlpEvaluatorTest : public ::testing::Test {
 protected:
  MixedProblem mixed;
  NlpEvaluator nlp{mixed.problem};
  Eigen::VectorXd delta = random_vector(nlp.num_unknowns(), 0.5, 3);

  double cost_at(const Eigen::VectorXd& d) {
    nlp.move_to(d);
    return nlp.cost();
  }
  Eigen::VectorXd lagrangian_gradient_at(const Eigen::VectorXd& d, double factor, const Eigen::VectorXd& multipliers) {
    nlp.move_to(d);
    return factor * gradient(nlp) + dense_jacobian(nlp).transpose() * multipliers;
  }
};

TEST_F(NlpEvaluatorTest, CountsUnknownsAndRows) {
  EXPECT_EQ(nlp.num_unknowns(), 6 + 6 + 3 + 3 + 6 + 6);
  EXPECT_EQ(nlp.num_rows(), 2 + 2 + 2 + 6 + 2 + 3);
}

TEST_F(NlpEvaluatorTest, MoveToAppliesExp) {
  const MixedVariables& v = mixed.v;
  const SE3 a = mixed.problem.value(v.a);
  const SE2 q = mixed.problem.value(v.q);
  const Body s = mixed.problem.value(v.s);
  nlp.move_to(delta);
  EXPECT_TRUE(mixed.problem.value(v.a).matrix() == a.matrix()) << "only recenter() changes the stored values";
  nlp.recenter();
  EXPECT_TRUE(mixed.problem.value(v.a).matrix() == (a * SE3::Exp(delta.segment<6>(0))).matrix());
  EXPECT_TRUE(mixed.problem.value(v.q).matrix() == (q * SE2::Exp(delta.segment<3>(15))).matrix());
  EXPECT_TRUE(mixed.problem.value(v.s).matrix() == (s * Body::Exp(delta.segment<6>(24))).matrix());
}

TEST_F(NlpEvaluatorTest, CostIsHalfTheSumOfTheLosses) {
  nlp.move_to(delta);
  const double cost = nlp.cost();
  nlp.recenter();
  double expected = 0;
  each_mixed_cost(mixed.v, [&](const auto& residual, const Gaussian& noise, const auto& x, const Loss& loss) {
    expected += 0.5 * loss((noise.sqrt_information() * rows(residual, x, mixed.problem)).squaredNorm()).rho;
  });
  EXPECT_NEAR(cost, expected, 1e-13 * expected);
  EXPECT_NEAR(nlp.cost(), expected, 1e-13 * expected);
}

TEST_F(NlpEvaluatorTest, GradientMatchesFiniteDifferences) {
  const auto expected = differences(delta, [&](const auto& d) { return Vector<1>(cost_at(d)); });
  nlp.move_to(delta);
  Eigen::VectorXd g(nlp.num_unknowns()), with_hessian(nlp.num_unknowns()), H = hessian_values(nlp);
  const double cost = nlp.gradient(g);
  expect_equal(g.transpose(), expected);
  EXPECT_DOUBLE_EQ(nlp.linearize(with_hessian, H), cost);
  EXPECT_DOUBLE_EQ(nlp.cost(), cost);
  EXPECT_TRUE(with_hessian.isApprox(g, 1e-14));
}

/// Evaluates each residual as a constraint to get its Jacobian by finite differences. The weighted sum of JᵀJ is the
/// Gauss-Newton Hessian.
TEST_F(NlpEvaluatorTest, GaussNewtonHessianMatchesFiniteDifferences) {
  const int n = nlp.num_unknowns();
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(n, n);
  each_mixed_cost(mixed.v, [&](const auto& residual, const Gaussian& noise, const auto& x, const Loss& loss) {
    Problem problem;
    const MixedVariables own = add_mixed_variables(problem);
    const auto rebind = [&]<class G>(const Variable<G>& handle) {
      Variable<G> result = handle;
      result.problem = own.a.problem;
      return result;
    };
    problem.subject_to(residual, at_least(0), std::apply([&](auto... h) { return std::tuple(rebind(h)...); }, x));
    NlpEvaluator block(problem);
    const auto value = [&](const Eigen::VectorXd& d) {
      block.move_to(d);
      return constraints(block);
    };
    const Eigen::MatrixXd W = noise.sqrt_information();
    const Eigen::MatrixXd J = W * differences(delta, value);
    expected += loss((W * value(delta)).squaredNorm()).d1 * J.transpose() * J;
  });
  nlp.move_to(delta);
  Eigen::VectorXd g(n), H = hessian_values(nlp);
  nlp.linearize(g, H);
  expect_equal(dense(nlp.hessian_pattern(), H), expected);
}

TEST_F(NlpEvaluatorTest, ConstraintsAreResidualRowsWithBounds) {
  nlp.move_to(delta);
  const Eigen::VectorXd c = constraints(nlp);
  nlp.recenter();
  int row = 0;
  each_mixed_constraint(mixed.v, [&](const auto& residual, const auto& bounds, const auto& x) {
    constexpr int dim = std::remove_cvref_t<decltype(residual)>::dim;
    EXPECT_TRUE(c.segment<dim>(row).isApprox(rows(residual, x, mixed.problem), 1e-14));
    EXPECT_EQ(nlp.lower().segment<dim>(row), bounds.lower);
    EXPECT_EQ(nlp.upper().segment<dim>(row), bounds.upper);
    row += dim;
  });
  EXPECT_EQ(row, nlp.num_rows());
}

TEST_F(NlpEvaluatorTest, ConstraintJacobianMatchesFiniteDifferences) {
  const auto expected = differences(delta, [&](const auto& d) {
    nlp.move_to(d);
    return constraints(nlp);
  });
  nlp.move_to(delta);
  const Eigen::MatrixXd J = dense_jacobian(nlp);
  expect_equal(J, expected);
  Eigen::VectorXd H = hessian_values(nlp), values(static_cast<Eigen::Index>(nlp.jacobian_pattern().row.size()));
  nlp.constraint_jacobian(values);
  nlp.reset();  // the point no longer matters
  const Eigen::VectorXd weights = random_vector(nlp.num_rows(), 1.0, 9).cwiseMax(0.0);
  nlp.add_constraint_hessian(weights, values, H);
  expect_equal(dense(nlp.hessian_pattern(), H), J.transpose() * weights.asDiagonal() * J, 1e-14);
}

TEST_F(NlpEvaluatorTest, LinearizeConstraintsEqualsSeparateEvaluations) {
  nlp.move_to(delta);
  const int rows = nlp.num_rows();
  Eigen::VectorXd c(rows), both_c(rows);
  Eigen::VectorXd J(static_cast<Eigen::Index>(nlp.jacobian_pattern().row.size())), both_J(J.size());
  nlp.constraints(c);
  nlp.constraint_jacobian(J);
  nlp.linearize_constraints(both_c, both_J);
  EXPECT_EQ(c, both_c);
  EXPECT_EQ(J, both_J);
}

TEST_F(NlpEvaluatorTest, LinearizeConstraintsAtPointEqualsRecenteredEvaluation) {
  const int rows = nlp.num_rows();
  Eigen::VectorXd c(rows), c_there(rows);
  Eigen::VectorXd J(static_cast<Eigen::Index>(nlp.jacobian_pattern().row.size())), J_there(J.size());
  nlp.move_to(delta);
  nlp.linearize_constraints_at_point(c, J);
  nlp.recenter();
  nlp.linearize_constraints(c_there, J_there);
  EXPECT_EQ(c, c_there);
  EXPECT_EQ(J, J_there);
}

TEST_F(NlpEvaluatorTest, RestoresSavedValues) {
  const double cost = nlp.cost();
  nlp.save();
  nlp.move_to(delta);
  nlp.recenter();
  ASSERT_NE(nlp.cost(), cost);
  nlp.move_to(delta);
  nlp.restore();
  EXPECT_EQ(nlp.cost(), cost);
}

/// exact_hessian() uses differences with h = 1e-5. Its error is rounding 1e-16 / h plus truncation, h² times third
/// derivatives, which are 10 to 100 times the second ones.
TEST_F(NlpEvaluatorTest, ExactHessianMatchesFiniteDifferences) {
  for (const double factor : {1.0, 0.3}) {
    const Eigen::VectorXd multipliers = random_vector(nlp.num_rows(), 2.0, 5);
    const auto expected =
        differences(delta, [&](const auto& d) { return lagrangian_gradient_at(d, factor, multipliers); });
    nlp.move_to(delta);
    Eigen::VectorXd H = hessian_values(nlp);
    nlp.exact_hessian(factor, multipliers, H);
    expect_equal(dense(nlp.hessian_pattern(), H), expected, 1e-8);
  }
}

TEST_F(NlpEvaluatorTest, ExactHessianAtTheCentreMatchesFiniteDifferences) {
  const Eigen::VectorXd multipliers = random_vector(nlp.num_rows(), 2.0, 6), zero = 0.0 * delta;
  const auto expected = differences(zero, [&](const auto& d) { return lagrangian_gradient_at(d, 1.0, multipliers); });
  nlp.reset();
  Eigen::VectorXd H = hessian_values(nlp);
  nlp.exact_hessian(1.0, multipliers, H);
  expect_equal(dense(nlp.hessian_pattern(), H), expected, 1e-8);
}

TEST_F(NlpEvaluatorTest, CurvatureIsExactMinusGaussNewtonHessian) {
  const Eigen::VectorXd multipliers = random_vector(nlp.num_rows(), 2.0, 7);
  Eigen::VectorXd g(nlp.num_unknowns()), H = hessian_values(nlp), exact = H, curvature = H;
  for (const double far : {0.0, 1.0}) {
    nlp.move_to(far * delta);
    nlp.linearize(g, H);
    nlp.exact_hessian(1.0, multipliers, exact);
    nlp.curvature(multipliers, curvature);
    EXPECT_LE((H + curvature - exact).cwiseAbs().maxCoeff(), 1e-13 * exact.cwiseAbs().maxCoeff());
    EXPECT_GE(curvature.cwiseAbs().maxCoeff(), 1e-3 * exact.cwiseAbs().maxCoeff());
  }
}

TEST_F(NlpEvaluatorTest, FixingVariablesRemovesTheirRowsAndColumns) {
  nlp.move_to(0.0 * delta);
  const int n = nlp.num_unknowns();
  Eigen::VectorXd g(n), H = hessian_values(nlp);
  nlp.linearize(g, H);
  const Eigen::MatrixXd full = dense(nlp.hessian_pattern(), H), J = dense_jacobian(nlp);
  const double cost = nlp.cost();

  mixed.problem.fix(mixed.v.b);
  mixed.problem.fix(mixed.v.s);
  NlpEvaluator reduced(mixed.problem);
  std::vector<int> kept;
  for (int i = 0; i < 24; ++i)
    if (i < 6 || i >= 12) kept.push_back(i);
  ASSERT_EQ(reduced.num_unknowns(), static_cast<int>(kept.size()));
  Eigen::VectorXd small_g(reduced.num_unknowns()), small_H = hessian_values(reduced);
  EXPECT_DOUBLE_EQ(reduced.linearize(small_g, small_H), cost);
  EXPECT_EQ(small_g, g(kept));
  EXPECT_EQ(dense(reduced.hessian_pattern(), small_H), full(kept, kept));
  EXPECT_EQ(dense_jacobian(reduced), J(Eigen::seqN(0, J.rows()), kept));
  EXPECT_EQ(reduced.describe_unknown(6).variable, "p");

  const SE3 b = mixed.problem.value(mixed.v.b);
  reduced.move_to(random_vector(reduced.num_unknowns(), 0.5, 9));
  const auto at = random_vector(reduced.num_unknowns(), 0.5, 9);
  const auto expected = differences(at, [&](const auto& d) {
    reduced.move_to(d);
    return Vector<1>(reduced.cost());
  });
  reduced.move_to(at);
  expect_equal(gradient(reduced).transpose(), expected);
  reduced.recenter();
  EXPECT_TRUE(mixed.problem.value(mixed.v.b).matrix() == b.matrix());
}

TEST_F(NlpEvaluatorTest, RecenterKeepsPointAndCost) {
  const double cost = cost_at(delta);
  const Eigen::VectorXd c = constraints(nlp);
  nlp.recenter();
  EXPECT_EQ(nlp.largest_angle(), 0.0);
  EXPECT_EQ(nlp.cost(), cost);
  EXPECT_EQ(constraints(nlp), c);
  const Eigen::VectorXd at_centre = gradient(nlp), zero = 0.0 * delta;
  const auto expected = differences(zero, [&](const auto& d) { return Vector<1>(cost_at(d)); });
  expect_equal(at_centre.transpose(), expected);
  cost_at(0.3 * delta);
  nlp.reset();
  EXPECT_EQ(nlp.cost(), cost);
  EXPECT_EQ(gradient(nlp), at_centre);
}

TEST_F(NlpEvaluatorTest, LinearizeAtPointEqualsRecenteredLinearize) {
  Eigen::VectorXd g(nlp.num_unknowns()), H = hessian_values(nlp), centred_g = g, centred_H = H, chart_g = g;
  nlp.move_to(delta);
  nlp.gradient(chart_g);
  const double cost = nlp.linearize_at_point(g, H);
  Eigen::VectorXd again(nlp.num_unknowns());
  nlp.gradient(again);
  EXPECT_EQ(again, chart_g) << "later derivatives are with respect to δ again";
  nlp.move_to(delta);
  nlp.linearize_at_point(g, H);
  nlp.recenter();
  EXPECT_EQ(nlp.linearize(centred_g, centred_H), cost);
  EXPECT_EQ(centred_g, g);
  EXPECT_EQ(centred_H, H);
}

TEST_F(NlpEvaluatorTest, LargestAngleCoversAllGroups) {
  Eigen::VectorXd d = 0.0 * delta;
  d[2] = 50.0;   // translations do not count
  d[4] = 0.3;    // rotation of a
  d[17] = -0.7;  // heading of q
  nlp.move_to(d);
  EXPECT_DOUBLE_EQ(nlp.largest_angle(), 0.7);
  d.segment<3>(24) << 0.6, 0.0, 0.8;  // rotation of s
  nlp.move_to(d);
  EXPECT_DOUBLE_EQ(nlp.largest_angle(), 1.0);
}

TEST_F(NlpEvaluatorTest, ViolationIsTheLargestDistanceOutsideTheBounds) {
  Eigen::VectorXd c = nlp.lower().cwiseMax(-10.0).cwiseMin(nlp.upper());
  EXPECT_EQ(nlp.violation(c).size, 0.0);
  EXPECT_EQ(nlp.violation(c).row, -1);
  c[3] += 0.75;  // bounds −0.1 and 0.3
  c[14] = -1.0;  // lower bound 0.4
  EXPECT_DOUBLE_EQ(nlp.violation(c).size, 1.4);
  EXPECT_EQ(nlp.violation(c).row, 14);
  c[5] = std::nan("");
  EXPECT_EQ(nlp.violation(c).row, 5);
}

TEST_F(NlpEvaluatorTest, DescribesRowsAndUnknowns) {
  EXPECT_EQ(nlp.describe_row(0), "twist components of a, b");
  EXPECT_EQ(nlp.describe_row(3), "twist components of c, b");
  EXPECT_EQ(nlp.describe_row(4), "roll-pitch of c");
  EXPECT_EQ(nlp.describe_row(11), "constant twist of b, a, b");
  EXPECT_EQ(nlp.describe_row(16), "carried point of s, p");
  const auto u = nlp.describe_unknown(17);
  EXPECT_EQ(u.variable, "q");
  EXPECT_EQ(u.entry, 2);
  EXPECT_EQ(u.direction, "heading");
  EXPECT_EQ(nlp.describe_unknown(2).direction, "z");
  EXPECT_EQ(nlp.describe_unknown(4).direction, "rotation about y");
  EXPECT_EQ(nlp.describe_unknown(0).variable, "a");
  EXPECT_EQ(nlp.describe_unknown(29).variable, "s");
}

TEST_F(NlpEvaluatorTest, DescribesNonfiniteBlock) {
  EXPECT_EQ(nlp.describe_nonfinite_block(), "");
  mixed.problem.set_value(mixed.v.p, R3({0.0, std::numeric_limits<double>::quiet_NaN(), 0.0}));
  EXPECT_EQ(NlpEvaluator(mixed.problem).describe_nonfinite_block(), "USBL position of b, p");
}

/// Eigen stores matrices of one row row-major, so one-dimensional variables need a test.
TEST(NlpEvaluator, HessianWithOneDimensionalVariables) {
  using R = SteadyCourse<UsblPosition<SE2>>;
  const R residual{UsblPosition<SE2>{Vector<2>(3.0, -1.0)}, 7.0};
  for (const bool speed_first : {false, true}) {
    Problem problem;
    Variable<Rn<1>> speed;
    if (speed_first) speed = problem.add(Rn<1>(Vector<1>(1.5)));
    const auto c = problem.add(SE2::Exp({1.0, 2.0, 0.3})), t = problem.add(SE2::Exp({4.0, -2.0, 1.3}));
    if (!speed_first) speed = problem.add(Rn<1>(Vector<1>(1.5)));
    problem.minimize(residual, Gaussian{1.0, 1.0}, {c, t, speed});
    NlpEvaluator nlp(problem);
    Vector<2> r;
    Matrix<2, 3> Jc, Jt;
    Matrix<2, 1> Js;
    residual(problem.value(c), problem.value(t), problem.value(speed), r, &Jc, &Jt, &Js);
    Matrix<2, 7> J;
    speed_first ? (J << Js, Jc, Jt) : (J << Jc, Jt, Js);
    Eigen::VectorXd gradient(7), H = hessian_values(nlp);
    nlp.linearize(gradient, H);
    expect_equal(dense(nlp.hessian_pattern(), H), J.transpose() * J, 1e-14);
  }
}

TEST(NlpEvaluator, RowMagnitudesAreSumsOverTheTerms) {
  Problem problem;
  const auto v = problem.add(R3({-3.0, 0.0, 1e6}));
  const auto T = problem.add(SE3(SO3(), {3.0, 4.0, 0.0}));
  problem.subject_to(Prior<R3>{R3({1.0, 2.0, 3.0})}, at_most(0.0), {v});
  problem.subject_to(Prior<SE3>{SE3(SO3(), {3.0, 4.0, 0.0})}, equal_to(0.0), {T});
  NlpEvaluator nlp(problem);
  Eigen::VectorXd jacobian(Eigen::Index(nlp.jacobian_pattern().row.size())), magnitudes(nlp.num_rows());
  nlp.constraint_jacobian(jacobian);
  nlp.row_magnitudes(jacobian, magnitudes);
  ASSERT_EQ(magnitudes.size(), 9);
  // The Jacobians are identities. A coordinate of a pose counts as the norm of the position, an angle as 1.
  std::vector<double> sorted(magnitudes.data(), magnitudes.data() + 9);
  std::sort(sorted.begin(), sorted.end());
  const std::vector<double> expected{0.0, 1.0, 1.0, 1.0, 3.0, 5.0, 5.0, 5.0, 1e6};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(sorted[i], expected[i], 1e-9) << i;
}

TEST(NlpEvaluator, RejectsProblemWithoutFreeVariables) {
  Problem problem;
  EXPECT_THROW(NlpEvaluator{problem}, Error);
  problem.fix(problem.add(SE3()));
  EXPECT_THROW(NlpEvaluator{problem}, Error);
}

}  // namespace
}  // namespace tandem::testing
