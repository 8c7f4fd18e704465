#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include <tandem/lie/dual_groups.hpp>
#include <tandem/lie/testing.hpp>

#include "samples.hpp"

namespace tandem {
namespace {

using D = Dual<3>;  // an odd number of directions

D at(double x, double dx, double dy) {
  D d(x);
  d.v << dx, dy, 0.0, 0.0;
  return d;
}

/// Expects f(x + ε₀, y + ε₁) to have the value and the derivatives of f, by extrapolated central differences.
template <class F>
void expect_derivatives(const char* name, const F& f, double x, double y) {
  const D dual = f(at(x, 1.0, 0.0), at(y, 0.0, 1.0));
  EXPECT_NEAR(dual.a, f(x, y), 1e-15 * (1.0 + std::abs(dual.a))) << name;
  const auto slope = [&](double dx, double dy) {
    const auto central = [&](double h) { return (f(x + h * dx, y + h * dy) - f(x - h * dx, y - h * dy)) / (2.0 * h); };
    const double coarse = central(2e-3), fine = central(1e-3);
    return fine + (fine - coarse) / 3.0;
  };
  EXPECT_NEAR(dual.v[0], slope(1.0, 0.0), 1e-8 * (1.0 + std::abs(dual.v[0]))) << name;
  EXPECT_NEAR(dual.v[1], slope(0.0, 1.0), 1e-8 * (1.0 + std::abs(dual.v[1]))) << name;
  EXPECT_EQ(dual.v[2], 0.0) << name;
  EXPECT_EQ(dual.v[3], 0.0) << name;
}

TEST(Dual, FunctionsHaveTheirDerivatives) {
  for (const double x : {0.3, 0.8})
    for (const double y : {0.4, 0.9}) {
#define TANDEM_EXPECT(...)                          \
  expect_derivatives(                               \
      #__VA_ARGS__,                                 \
      [](const auto& x, const auto& y) {            \
        using namespace std; /* NOLINT */           \
        static_cast<void>(x), static_cast<void>(y); \
        return __VA_ARGS__;                         \
      },                                            \
      x, y)
      TANDEM_EXPECT(x + y);
      TANDEM_EXPECT(x - y);
      TANDEM_EXPECT(x * y);
      TANDEM_EXPECT(x / y);
      TANDEM_EXPECT(2.0 + x - 3.0);
      TANDEM_EXPECT(2.0 - x);
      TANDEM_EXPECT(2.0 * x * 3.0);
      TANDEM_EXPECT(2.0 / x / 3.0);
      TANDEM_EXPECT(-x + +y);
      TANDEM_EXPECT(abs(-x) + abs(y));
      TANDEM_EXPECT(sqrt(x * y));
      TANDEM_EXPECT(cbrt(x * y));
      TANDEM_EXPECT(exp(x * y));
      TANDEM_EXPECT(expm1(x * y));
      TANDEM_EXPECT(log(x * y));
      TANDEM_EXPECT(log1p(x * y));
      TANDEM_EXPECT(sin(x * y));
      TANDEM_EXPECT(cos(x * y));
      TANDEM_EXPECT(tan(x * y));
      TANDEM_EXPECT(asin(x * y));
      TANDEM_EXPECT(acos(x * y));
      TANDEM_EXPECT(atan(x * y));
      TANDEM_EXPECT(atan2(x, y));
      TANDEM_EXPECT(atan2(-x, -y));
      TANDEM_EXPECT(sinh(x * y));
      TANDEM_EXPECT(cosh(x * y));
      TANDEM_EXPECT(tanh(x * y));
      TANDEM_EXPECT(hypot(x, y));
      TANDEM_EXPECT(pow(x, 2.5));
      TANDEM_EXPECT(pow(x, y));
      TANDEM_EXPECT(pow(2.0, y));
#undef TANDEM_EXPECT
    }
}

TEST(Dual, CompoundAssignmentsEqualTheOperators) {
  const D x = at(0.3, 1.0, 2.0), y = at(0.7, -1.0, 0.5);
  const auto expect = [](D a, const D& b) {
    EXPECT_EQ(a.a, b.a);
    EXPECT_TRUE((a.v == b.v).all());
  };
  D z = x;
  expect(z += y, x + y);
  z = x;
  expect(z -= y, x - y);
  z = x;
  expect(z *= y, x * y);
  z = x;
  expect(z /= y, x / y);
}

TEST(Dual, ComparesValues) {
  const D x = at(0.3, 1.0, 0.0), y = at(0.7, 0.0, 1.0);
  EXPECT_TRUE(x < y && x <= y && y > x && x != y && x == at(0.3, 5.0, 5.0));
  EXPECT_TRUE(x < 0.5 && 0.5 < y && x > 0.0 && !(y < 0.5));
  EXPECT_EQ(std::max(x, y).v[1], 1.0);
}

TEST(Dual, NamesDerivativesThatAreNotFinite) {
  EXPECT_TRUE(isfinite(sqrt(at(1e-300, 1.0, 0.0))));
  EXPECT_FALSE(isfinite(sqrt(at(0.0, 1.0, 0.0))));
  EXPECT_TRUE(isnan(log(at(-1.0, 1.0, 0.0))));
}

/// Returns the derivatives at 0 of f, which maps N dual numbers to M, in one evaluation.
template <class S, int M, int N, class F>
Matrix<M, N> derivative_at_zero(const F& f) {
  Vector<N, S> d;
  for (int i = 0; i < N; ++i) d[i] = S::variable(0.0, i);
  const Vector<M, S> r = f(d);
  Matrix<M, N> J;
  for (int i = 0; i < M; ++i) J.row(i) = r[i].v.template head<N>().transpose();
  return J;
}

/// Compares every Jacobian of operations.hpp with dual numbers in the tangent space.
template <class G>
class DualGroups : public ::testing::Test {};
TYPED_TEST_SUITE(DualGroups, AllGroups);
TYPED_TEST(DualGroups, MatchAllJacobians) {
  using G = TypeParam;
  using S = Dual<std::max(G::dof, G::point_dim)>;
  static_assert(Over<typename G::template Rebind<S>, G>);
  Samples samples;
  check::Errors errors;
  const auto compare = [&](const G& x, const typename G::Tangent& v, const Vector<G::point_dim>& p, double s) {
    check::for_each_jacobian(x, v, p, s, [&]<int M, int N>(const char* name, const Matrix<M, N>& J, const auto& f) {
      errors.compare(name, check::dense(J), check::dense(derivative_at_zero<S, M, N>(f)), 1.);
    });
  };
  for (const double angle : test_angles())
    for (const double s : {0., 0.3, 1.5})
      compare(samples.template element<G>(), samples.template tangent<G>(angle),
              samples.template vector<G::point_dim>(), s);
  compare(G::identity(), G::Tangent::Zero(), Vector<G::point_dim>::Zero(), 0.3);
  EXPECT_EQ(errors.report(1e-14), "");
}

/// Expects two matrices of dual numbers to be equal up to rounding.
template <class A, class B>
void expect_same(const A& a, const B& b) {
  for (int i = 0; i < a.rows(); ++i)
    for (int j = 0; j < a.cols(); ++j) {
      EXPECT_NEAR(a(i, j).a, b(i, j).a, 1e-14);
      EXPECT_LE((a(i, j).v - b(i, j).v).matrix().norm(), 2e-14 * (1.0 + b(i, j).v.matrix().norm()));
    }
}

/// Parts and matrices of the specialised groups equal those of the groups that differentiate their stored numbers.
template <class G>
class SpecialisedGroups : public ::testing::Test {};
using Specialised = ::testing::Types<SE2, SO3, SE3, SE23>;
TYPED_TEST_SUITE(SpecialisedGroups, Specialised);
TYPED_TEST(SpecialisedGroups, EqualThePlainGroups) {
  using G = TypeParam;
  using S = Dual<G::dof>;
  using P = Dual<G::dof, true>;
  using X = typename G::template Rebind<S>;
  using Plain = typename G::template Rebind<P>;
  Samples samples;
  for (const double angle : {0.0, 1e-3, 0.7, 3.0}) {
    const G value = samples.template element<G>() * G::Exp(samples.template tangent<G>(angle));
    const X x = X::perturbed(value, 0);
    Vector<G::dof, P> e;
    for (int i = 0; i < G::dof; ++i) e[i] = P::variable(0.0, i);
    const Plain plain(value.template cast<P>() * Plain::Exp(e));
    expect_same(x.matrix(), plain.matrix());
    expect_same(x.Ad(), plain.Ad());
    expect_same(x.Log(), plain.Log());
    expect_same(x.inverse().matrix(), plain.inverse().matrix());
    const Vector<G::point_dim, S> p = samples.template vector<G::point_dim>().template cast<S>();
    expect_same(x.act(p), plain.act(Vector<G::point_dim, P>(p.template cast<P>())));
    expect_same(x.act_jacobian(p), plain.act_jacobian(Vector<G::point_dim, P>(p.template cast<P>())));
    expect_same(X::Jl(x.Log()), Plain::Jl(plain.Log()));
    if constexpr (requires { x.translation(); }) {
      expect_same(x.rotation().matrix(), plain.rotation().matrix());
      expect_same(x.translation(), plain.translation());
    }
    if constexpr (std::is_same_v<G, SE3> || std::is_same_v<G, SE2>)
      expect_same(X(x.rotation(), x.translation()).Log(), x.Log());
    if constexpr (std::is_same_v<G, SO3>) {
      expect_same(x.quaternion().coeffs(), plain.quaternion().coeffs());
      expect_same(X(x.quaternion()).Log(), x.Log());
      expect_same(X(x.matrix()).Log(), x.Log());
    }
    // Constants have no derivatives.
    const X constant = value.template cast<S>();
    EXPECT_TRUE(constant.is_constant());  // products and actions then skip its derivatives
    expect_same((constant * x).Log(), (value.template cast<P>() * plain).Log());
    expect_same((x * constant).Log(), (plain * value.template cast<P>()).Log());
    for (int i = 0; i < G::dof; ++i) EXPECT_TRUE((constant.Log()[i].v == 0.0).all());
  }
}

}  // namespace
}  // namespace tandem
