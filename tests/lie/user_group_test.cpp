// check::group accepts a correct user-defined group and reports the failed identity for each of several mistakes.

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include <tandem/lie/testing.hpp>

namespace tandem {
namespace {

enum class Mistake { none, left_for_right, inverse_jacobian, adjoint, logarithm, action, product };

/// Affine maps of a line, p ↦ a p + b with a > 0. Tangent: [ρ; σ] with a = exp(σ).
template <Mistake mistake>
class Line {
 public:
  static constexpr int dof = 2, matrix_size = 2, point_dim = 1;
  using Scalar = double;
  using Tangent = Vector<2>;
  using Jacobian = Matrix<2, 2>;
  using AlgebraMatrix = Matrix<2, 2>;

  Line() = default;
  Line(double a, double b) : a_(a), b_(b) {}

  static Line identity() { return {}; }
  static Line Exp(const Tangent& v) { return {std::exp(v[1]), f(v[1]) * v[0]}; }
  Tangent Log() const {
    const double s = std::log(a_);
    return {b_ / (mistake == Mistake::logarithm ? 1. : f(s)), s};
  }
  Line inverse() const { return {1. / a_, -b_ / a_}; }
  Line operator*(const Line& y) const { return {a_ * y.a_, mistake == Mistake::product ? b_ + y.b_ : a_ * y.b_ + b_}; }
  AlgebraMatrix matrix() const { return (AlgebraMatrix() << a_, b_, 0., 1.).finished(); }
  static AlgebraMatrix hat(const Tangent& v) { return (AlgebraMatrix() << v[1], v[0], 0., 0.).finished(); }
  static Tangent vee(const AlgebraMatrix& m) { return {m(0, 1), m(0, 0)}; }

  Jacobian Ad() const { return (Jacobian() << a_, mistake == Mistake::adjoint ? b_ : -b_, 0., 1.).finished(); }
  static Jacobian Jl(const Tangent& v) { return (Jacobian() << f(v[1]), -v[0] * g(v[1]), 0., 1.).finished(); }
  static Jacobian Jr(const Tangent& v) { return mistake == Mistake::left_for_right ? Jl(v) : Jl(-v); }
  static Jacobian Jl_inverse(const Tangent& v) {
    const double d = mistake == Mistake::inverse_jacobian ? 1. : f(v[1]);
    return (Jacobian() << 1. / f(v[1]), v[0] * g(v[1]) / d, 0., 1.).finished();
  }
  static Jacobian Jr_inverse(const Tangent& v) { return Jl_inverse(-v); }
  static double angle(const Tangent&) { return 0.; }

  Vector<1> act(const Vector<1>& p) const { return Vector<1>(a_ * p[0] + b_); }
  Matrix<1, 2> act_jacobian(const Vector<1>& p) const { return {mistake == Mistake::action ? 1. : a_, a_ * p[0]}; }
  Matrix<1, 1> act_point_jacobian() const { return Matrix<1, 1>(a_); }

 private:
  /// Returns (exp(s) − 1) / s.
  static double f(double s) { return s == 0. ? 1. : std::expm1(s) / s; }
  /// Returns (f(s) − 1) / s = Σ s^k / (k + 2)!.
  static double g(double s) {
    if (std::abs(s) > 1.) return (f(s) - 1.) / s;
    double term = 0.5, sum = term;
    for (int k = 1; k < 18; ++k) sum += term *= s / (k + 2);
    return sum;
  }

  double a_ = 1., b_ = 0.;
};
static_assert(LieGroup<Line<Mistake::none>>);

// Limits the rounding errors: entries reach exp(2), and Log divides by numbers of that size.
constexpr double kLargestNorm = 2.;

template <Mistake mistake>
std::string report() {
  return check::group<Line<mistake>>(kLargestNorm).report();
}

TEST(UserGroup, PassesAllChecks) { EXPECT_EQ(report<Mistake::none>(), ""); }

TEST(UserGroup, ReportNamesTheFailedIdentity) {
  EXPECT_NE(report<Mistake::left_for_right>().find("Jr(v) = sum (-ad)^k / (k+1)!"), std::string::npos);
  EXPECT_NE(report<Mistake::inverse_jacobian>().find("Jl Jl_inverse = I"), std::string::npos);
  EXPECT_NE(report<Mistake::adjoint>().find("Ad(x) v = vee(X hat(v) X^-1)"), std::string::npos);
  EXPECT_NE(report<Mistake::adjoint>().find("compose, first"), std::string::npos);
  EXPECT_NE(report<Mistake::logarithm>().find("Log(Exp(v)) = v"), std::string::npos);
  EXPECT_NE(report<Mistake::action>().find("act, group"), std::string::npos);
  EXPECT_NE(report<Mistake::product>().find("matrix(x y) = matrix(x) matrix(y)"), std::string::npos);
}

TEST(UserGroup, NanCountsAsInfiniteError) {
  check::Errors errors;
  errors.compare("identity", Eigen::MatrixXd::Constant(1, 1, std::nan("")), Eigen::MatrixXd::Zero(1, 1));
  EXPECT_TRUE(std::isinf(errors.largest()));
  EXPECT_NE(errors.report(1.), "");
}

}  // namespace
}  // namespace tandem
