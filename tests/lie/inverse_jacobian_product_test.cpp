// Jr⁻¹(v) w and its derivatives for every group, and the coefficient D with its derivatives.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include <tandem/lie/inverse_jacobian_product.hpp>

#include "dual_numbers.hpp"

namespace tandem {
namespace {

using Long = long double;
using Once = ceres::Jet<Long, 1>;
using Twice = ceres::Jet<Once, 1>;  // value, first and second derivative

/// Returns D(4h²) = (sin h / h − cos h) / (4h² sin h / h), with numerator and denominator as power series.
template <class T>
T quotient_of_series(const T& x) {
  const T h2 = x / T(Once(4.L));
  T numerator(Once(0.L)), denominator(Once(0.L)), power(Once(1.L));
  Long factorial = 1.L;  // (2k + 1)!
  for (int k = 0; k < 25; ++k) {
    const Long next = factorial * static_cast<Long>((2 * k + 2) * (2 * k + 3)), sign = k % 2 == 0 ? 1.L : -1.L;
    numerator += power * T(Once(sign * static_cast<Long>(2 * k + 2) / next));
    denominator += power * T(Once(sign * 4.L / factorial));
    power *= h2;
    factorial = next;
  }
  return numerator / denominator;
}

void expect_coefficient(double x, double tolerance) {
  Twice dual(Once(static_cast<Long>(x), 0));
  dual.v[0] = Once(1.L);
  const Twice exact = quotient_of_series(dual);
  const InverseCoefficient<double> got(x);
  const auto error = [](double a, Long b) { return static_cast<double>(std::abs(static_cast<Long>(a) / b - 1.L)); };
  EXPECT_LE(error(got.value, exact.a.a), tolerance) << x;
  EXPECT_LE(error(got.first, exact.a.v[0]), tolerance) << x;
  EXPECT_LE(error(got.second, exact.v[0].v[0]), tolerance) << x;
}

TEST(InverseCoefficient, IsExactToRoundingUpToPi) {
  for (double theta = 0.; theta < M_PI; theta += 1e-3) expect_coefficient(theta * theta, 1e-15);
  for (const double theta : {1e-12, 1e-8, 1e-4, M_PI - 1e-9, M_PI}) expect_coefficient(theta * theta, 1e-15);
  expect_coefficient(std::nextafter(10., 0.), 1e-15);
  EXPECT_DOUBLE_EQ(InverseCoefficient<double>(0.).value, 1. / 12);
  EXPECT_DOUBLE_EQ(InverseCoefficient<double>(0.).first, 1. / 720);
  EXPECT_DOUBLE_EQ(InverseCoefficient<double>(0.).second, 1. / 15120);
}

TEST(InverseCoefficient, IsAccurateBeyondPi) {
  for (double x = 10.; x < 36.; x += 0.1) expect_coefficient(x, 1e-13);  // towards the pole at 39.5
}

TEST(InverseCoefficient, DerivativesMatchDualNumbers) {
  for (const double x : {0., 1e-6, 0.3, 4., 9.8, 10., 20.}) {
    const InverseCoefficient<Jet> dual(Jet(x, 0));
    const InverseCoefficient<double> plain(x);
    EXPECT_NEAR(dual.value.v[0] / plain.first, 1., 1e-13) << x;
    EXPECT_NEAR(dual.first.v[0] / plain.second, 1., 1e-12) << x;
  }
}

template <class G>
class InverseJacobianProduct : public ::testing::Test {
 protected:
  Samples samples;
};
TYPED_TEST_SUITE(InverseJacobianProduct, AllGroups);

TYPED_TEST(InverseJacobianProduct, AdMatchesTheLieBracket) {
  using G = TypeParam;
  check::Errors errors;
  for (int i = 0; i < 10; ++i) {
    const auto v = this->samples.template tangent<G>(1.3, 4.);
    errors.compare("ad(v) w = vee([hat(v), hat(w)])", check::dense(G::ad(v)), check::adjoint_of_algebra<G>(v));
  }
  EXPECT_EQ(errors.report(1e-15), "");
}

TYPED_TEST(InverseJacobianProduct, MatchesTheInverseJacobian) {
  using G = TypeParam;
  auto angles = test_angles();
  angles.insert(angles.end(), {3.5, 4.5, 5.5});
  check::Errors errors;
  for (const double angle : angles)
    for (const double scale : {1e-9, 1., 100.}) {
      const auto v = this->samples.template tangent<G>(angle, scale), w = this->samples.template tangent<G>(1., 3.);
      typename G::Jacobian Jw;
      const typename G::Tangent product = Jr_inverse_times<G>(v, w, nullptr, &Jw), expected = G::Jr_inverse(v) * w;
      const double size = G::Jr_inverse(v).cwiseAbs().maxCoeff() * w.cwiseAbs().maxCoeff();
      errors.compare("Jr_inverse(v) w", check::dense(product), check::dense(expected), size);
      errors.compare("by w", check::dense(Jw), check::dense(G::Jr_inverse(v)));
    }
  EXPECT_EQ(errors.report(1e-14), "");
}

TYPED_TEST(InverseJacobianProduct, DerivativesMatchDualNumbers) {
  using G = TypeParam;
  using Dual = typename G::template Rebind<Jet>;
  auto angles = test_angles();
  angles.insert(angles.end(), {3.5, 4.5, 5.5});
  check::Errors errors;
  for (const double angle : angles)
    for (const double scale : {1e-9, 1., 100.}) {
      const auto v = this->samples.template tangent<G>(angle, scale), w = this->samples.template tangent<G>(1., 3.);
      typename G::Jacobian Jv, Jw;
      Jr_inverse_times<G>(v, w, &Jv, &Jw);
      using Vec = Vector<G::dof, Jet>;
      const Vec dual_v = v.template cast<Jet>(), dual_w = w.template cast<Jet>();
      errors.compare("by v", check::dense(Jv), check::dense(dual_derivative<G::dof, G::dof>([&](const Vec& d) {
                       return Jr_inverse_times<Dual>(Vec(dual_v + d), dual_w);
                     })),
                     1.);
      errors.compare("by w", check::dense(Jw), check::dense(dual_derivative<G::dof, G::dof>([&](const Vec& d) {
                       return Jr_inverse_times<Dual>(dual_v, Vec(dual_w + d));
                     })),
                     1.);
    }
  EXPECT_EQ(errors.report(2e-14), "");
}

TYPED_TEST(InverseJacobianProduct, DerivativesMatchDifferences) {
  using G = TypeParam;
  check::Errors errors;
  for (const double angle : test_angles()) {
    const auto v = this->samples.template tangent<G>(angle), w = this->samples.template tangent<G>(1.);
    typename G::Jacobian Jv;
    Jr_inverse_times<G>(v, w, &Jv);
    // Differences of G::Jr_inverse, so that the reference shares no code. Truncation step⁴/30 f⁽⁵⁾, rounding 1e-15 /
    // step.
    const auto f = [&](const Vector<G::dof>& d) { return Vector<G::dof>(G::Jr_inverse(v + d) * w); };
    errors.compare("by v", check::dense(Jv), check::dense(check::central_differences<G::dof, G::dof>(f, 1e-3)), 1.);
  }
  EXPECT_EQ(errors.report(1e-11), "");
}

}  // namespace
}  // namespace tandem
