#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include <tandem/residuals/on_course.hpp>

#include "mixed_problem.hpp"

namespace tandem::testing {
namespace {

/// Differences are good to 1e-11 of the largest entry here; derivatives must agree to what is left of that.
constexpr double kTolerance = 1e-9;

void expect_equal(const Eigen::MatrixXd& given, const Eigen::MatrixXd& expected, double tolerance = kTolerance) {
  ASSERT_EQ(given.rows(), expected.rows());
  ASSERT_EQ(given.cols(), expected.cols());
  EXPECT_LE((given - expected).cwiseAbs().maxCoeff(), tolerance * expected.cwiseAbs().maxCoeff());
}

Eigen::VectorXd constraints(Program& program) {
  Eigen::VectorXd c(program.num_rows());
  program.constraints(c);
  return c;
}

template <class R, class Handles>
Vector<R::dim> rows(const R& residual, const Handles& x, const Problem& problem) {
  Vector<R::dim> r;
  std::apply([&](const auto&... handle) { residual(problem.value(handle)..., r); }, x);
  return r;
}

class ProgramTest : public ::testing::Test {
 protected:
  MixedProblem mixed;
  Program program{mixed.problem};
  Eigen::VectorXd delta = random_vector(program.num_unknowns(), 0.5, 3);

  double cost_at(const Eigen::VectorXd& d) {
    program.move_to(d);
    return program.cost();
  }
  Eigen::VectorXd lagrangian_gradient_at(const Eigen::VectorXd& d, double factor, const Eigen::VectorXd& multipliers) {
    program.move_to(d);
    return factor * gradient(program) + dense_jacobian(program).transpose() * multipliers;
  }
};

TEST_F(ProgramTest, UnknownsStandInTheOrderOfTheVariables) {
  EXPECT_EQ(program.num_unknowns(), 6 + 6 + 3 + 3 + 6 + 6);
  EXPECT_EQ(program.num_rows(), 2 + 2 + 2 + 6 + 2 + 3);
}

TEST_F(ProgramTest, MovesEachVariableAlongItsExp) {
  const MixedVariables& v = mixed.v;
  const SE3 a = mixed.problem.value(v.a);
  const SE2 q = mixed.problem.value(v.q);
  const Body s = mixed.problem.value(v.s);
  program.move_to(delta);
  EXPECT_TRUE(mixed.problem.value(v.a).matrix() == a.matrix()) << "values are X̄ until it is recentred";
  program.recenter();
  EXPECT_TRUE(mixed.problem.value(v.a).matrix() == (a * SE3::Exp(delta.segment<6>(0))).matrix());
  EXPECT_TRUE(mixed.problem.value(v.q).matrix() == (q * SE2::Exp(delta.segment<3>(15))).matrix());
  EXPECT_TRUE(mixed.problem.value(v.s).matrix() == (s * Body::Exp(delta.segment<6>(24))).matrix());
}

TEST_F(ProgramTest, CostIsTheSumOfHalfTheLosses) {
  program.move_to(delta);
  const double cost = program.cost();
  program.recenter();
  double expected = 0;
  each_mixed_cost(mixed.v, [&](const auto& residual, const Gaussian& noise, const auto& x, const Loss& loss) {
    expected += 0.5 * loss((noise.sqrt_information() * rows(residual, x, mixed.problem)).squaredNorm()).rho;
  });
  EXPECT_NEAR(cost, expected, 1e-13 * expected);
  EXPECT_NEAR(program.cost(), expected, 1e-13 * expected);
}

TEST_F(ProgramTest, GradientAgreesWithDifferences) {
  const auto expected = differences(delta, [&](const auto& d) { return Vector<1>(cost_at(d)); });
  program.move_to(delta);
  Eigen::VectorXd g(program.num_unknowns()), with_hessian(program.num_unknowns()), H = hessian_values(program);
  const double cost = program.gradient(g);
  expect_equal(g.transpose(), expected);
  EXPECT_DOUBLE_EQ(program.linearize(with_hessian, H), cost);
  EXPECT_DOUBLE_EQ(program.cost(), cost);
  EXPECT_TRUE(with_hessian.isApprox(g, 1e-14));
}

/// Each block on its own, as a constraint, gives its rows' Jacobian by differences; weighted and summed up
/// they are the Gauss-Newton Hessian.
TEST_F(ProgramTest, GaussNewtonHessianAgreesWithDifferences) {
  const int n = program.num_unknowns();
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(n, n);
  each_mixed_cost(mixed.v, [&](const auto& residual, const Gaussian& noise, const auto& x, const Loss& loss) {
    Problem problem;
    const MixedVariables own = add_mixed_variables(problem);
    const auto rebind = [&]<class G>(const Variable<G>& handle) {
      Variable<G> result = handle;
      if constexpr (std::is_same_v<G, SE3>) result.store = own.a.store;
      if constexpr (std::is_same_v<G, R3>) result.store = own.p.store;
      if constexpr (std::is_same_v<G, SE2>) result.store = own.q.store;
      if constexpr (std::is_same_v<G, Body>) result.store = own.s.store;
      return result;
    };
    problem.subject_to(residual, at_least(0), std::apply([&](auto... h) { return std::tuple(rebind(h)...); }, x));
    Program block(problem);
    const auto value = [&](const Eigen::VectorXd& d) {
      block.move_to(d);
      return constraints(block);
    };
    const Eigen::MatrixXd W = noise.sqrt_information();
    const Eigen::MatrixXd J = W * differences(delta, value);
    expected += loss((W * value(delta)).squaredNorm()).d1 * J.transpose() * J;
  });
  program.move_to(delta);
  Eigen::VectorXd g(n), H = hessian_values(program);
  program.linearize(g, H);
  expect_equal(dense(program.hessian_pattern(), H), expected);
}

TEST_F(ProgramTest, ConstraintsAreTheResidualsRowsWithTheirBounds) {
  program.move_to(delta);
  const Eigen::VectorXd c = constraints(program);
  program.recenter();
  int row = 0;
  each_mixed_constraint(mixed.v, [&](const auto& residual, const auto& bounds, const auto& x) {
    constexpr int dim = std::remove_cvref_t<decltype(residual)>::dim;
    EXPECT_TRUE(c.segment<dim>(row).isApprox(rows(residual, x, mixed.problem), 1e-14));
    EXPECT_EQ(program.lower().segment<dim>(row), bounds.lower);
    EXPECT_EQ(program.upper().segment<dim>(row), bounds.upper);
    row += dim;
  });
  EXPECT_EQ(row, program.num_rows());
}

TEST_F(ProgramTest, ConstraintJacobianAgreesWithDifferences) {
  const auto expected = differences(delta, [&](const auto& d) {
    program.move_to(d);
    return constraints(program);
  });
  program.move_to(delta);
  const Eigen::MatrixXd J = dense_jacobian(program);
  expect_equal(J, expected);
  Eigen::VectorXd H = hessian_values(program), values(static_cast<Eigen::Index>(program.jacobian_pattern().row.size()));
  program.constraint_jacobian(values);
  program.reset();  // the values say where
  const Eigen::VectorXd weights = random_vector(program.num_rows(), 1.0, 9).cwiseMax(0.0);
  program.add_constraint_hessian(weights, values, H);
  expect_equal(dense(program.hessian_pattern(), H), J.transpose() * weights.asDiagonal() * J, 1e-14);
}

TEST_F(ProgramTest, ConstraintsAndJacobianInOneEvaluationAreTheSame) {
  program.move_to(delta);
  const int rows = program.num_rows();
  Eigen::VectorXd c(rows), both_c(rows);
  Eigen::VectorXd J(static_cast<Eigen::Index>(program.jacobian_pattern().row.size())), both_J(J.size());
  program.constraints(c);
  program.constraint_jacobian(J);
  program.linearize_constraints(both_c, both_J);
  EXPECT_EQ(c, both_c);
  EXPECT_EQ(J, both_J);
}

TEST_F(ProgramTest, ConstraintsByPerturbationsOfThePointAreThoseOnceItIsTheCentre) {
  const int rows = program.num_rows();
  Eigen::VectorXd c(rows), c_there(rows);
  Eigen::VectorXd J(static_cast<Eigen::Index>(program.jacobian_pattern().row.size())), J_there(J.size());
  program.move_to(delta);
  program.linearize_constraints_at_point(c, J);
  program.recenter();
  program.linearize_constraints(c_there, J_there);
  EXPECT_EQ(c, c_there);
  EXPECT_EQ(J, J_there);
}

TEST_F(ProgramTest, RestoresWhatItKept) {
  const double cost = program.cost();
  program.keep();
  program.move_to(delta);
  program.recenter();
  ASSERT_NE(program.cost(), cost);
  program.move_to(delta);
  program.restore();
  EXPECT_EQ(program.cost(), cost);
}

/// The Hessian itself is made by differences with h = 1e-5: rounding 1e-16 / h, truncation h² of third
/// derivatives of some 10 to 100 times the second.
TEST_F(ProgramTest, ExactHessianAgreesWithDifferences) {
  for (const double factor : {1.0, 0.3}) {
    const Eigen::VectorXd multipliers = random_vector(program.num_rows(), 2.0, 5);
    const auto expected =
        differences(delta, [&](const auto& d) { return lagrangian_gradient_at(d, factor, multipliers); });
    program.move_to(delta);
    Eigen::VectorXd H = hessian_values(program);
    program.exact_hessian(factor, multipliers, H);
    expect_equal(dense(program.hessian_pattern(), H), expected, 1e-8);
  }
}

TEST_F(ProgramTest, ExactHessianAtTheCentreAgreesWithDifferences) {
  const Eigen::VectorXd multipliers = random_vector(program.num_rows(), 2.0, 6), zero = 0.0 * delta;
  const auto expected = differences(zero, [&](const auto& d) { return lagrangian_gradient_at(d, 1.0, multipliers); });
  program.reset();
  Eigen::VectorXd H = hessian_values(program);
  program.exact_hessian(1.0, multipliers, H);
  expect_equal(dense(program.hessian_pattern(), H), expected, 1e-8);
}

TEST_F(ProgramTest, CurvatureIsWhatGaussNewtonsLacksOfTheExactHessian) {
  const Eigen::VectorXd multipliers = random_vector(program.num_rows(), 2.0, 7);
  Eigen::VectorXd g(program.num_unknowns()), H = hessian_values(program), exact = H, curvature = H;
  for (const double far : {0.0, 1.0}) {
    program.move_to(far * delta);
    program.linearize(g, H);
    program.exact_hessian(1.0, multipliers, exact);
    program.curvature(multipliers, curvature);
    EXPECT_LE((H + curvature - exact).cwiseAbs().maxCoeff(), 1e-13 * exact.cwiseAbs().maxCoeff());
    EXPECT_GE(curvature.cwiseAbs().maxCoeff(), 1e-3 * exact.cwiseAbs().maxCoeff());
  }
}

TEST_F(ProgramTest, FixedVariablesLeaveTheRestAsItIs) {
  program.move_to(0.0 * delta);
  const int n = program.num_unknowns();
  Eigen::VectorXd g(n), H = hessian_values(program);
  program.linearize(g, H);
  const Eigen::MatrixXd full = dense(program.hessian_pattern(), H), J = dense_jacobian(program);
  const double cost = program.cost();

  mixed.problem.fix(mixed.v.b);
  mixed.problem.fix(mixed.v.s);
  Program reduced(mixed.problem);
  std::vector<int> kept;
  for (int i = 0; i < 24; ++i)
    if (i < 6 || i >= 12) kept.push_back(i);
  ASSERT_EQ(reduced.num_unknowns(), static_cast<int>(kept.size()));
  Eigen::VectorXd small_g(reduced.num_unknowns()), small_H = hessian_values(reduced);
  EXPECT_DOUBLE_EQ(reduced.linearize(small_g, small_H), cost);
  EXPECT_EQ(small_g, g(kept));
  EXPECT_EQ(dense(reduced.hessian_pattern(), small_H), full(kept, kept));
  EXPECT_EQ(dense_jacobian(reduced), J(Eigen::all, kept));
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

TEST_F(ProgramTest, RecenteringKeepsThePointAndCentresTheChart) {
  const double cost = cost_at(delta);
  const Eigen::VectorXd c = constraints(program);
  program.recenter();
  EXPECT_EQ(program.largest_angle(), 0.0);
  EXPECT_EQ(program.cost(), cost);
  EXPECT_EQ(constraints(program), c);
  const Eigen::VectorXd at_centre = gradient(program), zero = 0.0 * delta;
  const auto expected = differences(zero, [&](const auto& d) { return Vector<1>(cost_at(d)); });
  expect_equal(at_centre.transpose(), expected);
  cost_at(0.3 * delta);
  program.reset();
  EXPECT_EQ(program.cost(), cost);
  EXPECT_EQ(gradient(program), at_centre);
}

TEST_F(ProgramTest, LinearizesAtThePointAsIfRecentred) {
  Eigen::VectorXd g(program.num_unknowns()), H = hessian_values(program), centred_g = g, centred_H = H, chart_g = g;
  program.move_to(delta);
  program.gradient(chart_g);
  const double cost = program.linearize_at_point(g, H);
  Eigen::VectorXd again(program.num_unknowns());
  program.gradient(again);
  EXPECT_EQ(again, chart_g) << "the chart is that of before";
  program.move_to(delta);
  program.linearize_at_point(g, H);
  program.recenter();
  EXPECT_EQ(program.linearize(centred_g, centred_H), cost);
  EXPECT_EQ(centred_g, g);
  EXPECT_EQ(centred_H, H);
}

TEST_F(ProgramTest, LargestAngleIsOverAllGroups) {
  Eigen::VectorXd d = 0.0 * delta;
  d[2] = 50.0;   // metres do not count
  d[4] = 0.3;    // of a
  d[17] = -0.7;  // of q, in the plane
  program.move_to(d);
  EXPECT_DOUBLE_EQ(program.largest_angle(), 0.7);
  d.segment<3>(24) << 0.6, 0.0, 0.8;  // of s
  program.move_to(d);
  EXPECT_DOUBLE_EQ(program.largest_angle(), 1.0);
}

TEST_F(ProgramTest, ViolationIsTheLargestDistanceOutside) {
  Eigen::VectorXd c = program.lower().cwiseMax(-10.0).cwiseMin(program.upper());
  EXPECT_EQ(program.violation(c).size, 0.0);
  EXPECT_EQ(program.violation(c).row, -1);
  c[3] += 0.75;  // between −0.1 and 0.3
  c[14] = -1.0;  // at least 0.4
  EXPECT_DOUBLE_EQ(program.violation(c).size, 1.4);
  EXPECT_EQ(program.violation(c).row, 14);
  c[5] = std::nan("");
  EXPECT_EQ(program.violation(c).row, 5);
}

TEST_F(ProgramTest, DescribesRowsAndUnknowns) {
  EXPECT_EQ(program.describe_row(0), "twist components of a, b");
  EXPECT_EQ(program.describe_row(3), "twist components of c, b");
  EXPECT_EQ(program.describe_row(4), "roll-pitch of c");
  EXPECT_EQ(program.describe_row(11), "constant twist of b, a, b");
  EXPECT_EQ(program.describe_row(16), "carried point of s, p");
  const auto u = program.describe_unknown(17);
  EXPECT_EQ(u.variable, "q");
  EXPECT_EQ(u.entry, 2);
  EXPECT_EQ(u.direction, "heading");
  EXPECT_EQ(program.describe_unknown(2).direction, "z");
  EXPECT_EQ(program.describe_unknown(4).direction, "rotation about y");
  EXPECT_EQ(program.describe_unknown(0).variable, "a");
  EXPECT_EQ(program.describe_unknown(29).variable, "s");
}

TEST_F(ProgramTest, DescribesTheBlockThatIsNotFinite) {
  EXPECT_EQ(program.describe_bad_block(), "");
  mixed.problem.set_value(mixed.v.p, R3({0.0, std::numeric_limits<double>::quiet_NaN(), 0.0}));
  EXPECT_EQ(Program(mixed.problem).describe_bad_block(), "USBL position of b, p");
}

/// Blocks of one row are no ordinary ones: Eigen keeps them by rows.
TEST(Program, HessianOfVariablesOfOneDimension) {
  using R = OnCourse<UsblPosition<SE2>>;
  const R residual{UsblPosition<SE2>{Vector<2>(3.0, -1.0)}, 7.0};
  for (const bool speed_first : {false, true}) {
    Problem problem;
    Variable<Rn<1>> speed;
    if (speed_first) speed = problem.add(Rn<1>(Vector<1>(1.5)));
    const auto c = problem.add(SE2::Exp({1.0, 2.0, 0.3})), t = problem.add(SE2::Exp({4.0, -2.0, 1.3}));
    if (!speed_first) speed = problem.add(Rn<1>(Vector<1>(1.5)));
    problem.minimize(residual, Gaussian{1.0, 1.0}, {c, t, speed});
    Program program(problem);
    Vector<2> r;
    Matrix<2, 3> Jc, Jt;
    Matrix<2, 1> Js;
    residual(problem.value(c), problem.value(t), problem.value(speed), r, &Jc, &Jt, &Js);
    Matrix<2, 7> J;
    speed_first ? (J << Js, Jc, Jt) : (J << Jc, Jt, Js);
    Eigen::VectorXd gradient(7), H = hessian_values(program);
    program.linearize(gradient, H);
    expect_equal(dense(program.hessian_pattern(), H), J.transpose() * J, 1e-14);
  }
}

TEST(Program, NeedsAFreeVariable) {
  Problem problem;
  EXPECT_THROW(Program{problem}, Error);
  problem.fix(problem.add(SE3()));
  EXPECT_THROW(Program{problem}, Error);
}

}  // namespace
}  // namespace tandem::testing
