// Values and derivatives of AngleCoefficients against power series in long double, from 0 to π.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <tandem/lie/coefficients.hpp>

namespace tandem {
namespace {

using Long = long double;
using Dual = ceres::Jet<Long, 1>;

// Long double rounds at 1e-19 (x86) and the terms below never exceed 2, so the reference values are accurate to 1e-18.
static_assert(std::numeric_limits<Long>::digits >= 64, "the reference values need a long double of 64 bits or more");

Long factorial(int n) {
  Long f = 1.L;
  for (int i = 2; i <= n; ++i) f *= static_cast<Long>(i);
  return f;
}

/// Returns Σ_k (−1)^k a(k) x^k.
template <class A>
Dual alternating(const Dual& x, const A& a) {
  Dual sum(0.L), power(1.L);
  for (int k = 0; k < 25; ++k) {
    sum += (k % 2 == 0 ? a(k) : -a(k)) * power;
    power *= x;
  }
  return sum;
}

struct Reference {
  Dual A, B, C, D, E, F;

  explicit Reference(const Dual& x) {
    A = alternating(x, [](int k) { return 1.L / factorial(2 * k + 1); });
    B = alternating(x, [](int k) { return 1.L / factorial(2 * k + 2); });
    C = alternating(x, [](int k) { return 1.L / factorial(2 * k + 3); });
    E = alternating(x, [](int k) { return 1.L / factorial(2 * k + 4); });
    // 3C − B is summed term by term, because the terms of x⁰ cancel.
    F = alternating(x, [](int k) { return static_cast<Long>(k + 1) / factorial(2 * k + 5); });
    // With h = θ/2: D = (sin h / h − cos h) / (4 h² sin h / h), numerator and denominator as series in h² = x/4.
    const Dual h2 = x / 4.L;
    D = alternating(h2, [](int k) { return static_cast<Long>(2 * k + 2) / factorial(2 * k + 3); }) /
        (4.L * alternating(h2, [](int k) { return 1.L / factorial(2 * k + 1); }));
  }
};

using Six = std::array<double, 6>;  // of A, B, C, D, E, F

struct Errors {
  Six value{}, derivative{};
  void include(const Errors& e) {
    for (std::size_t i = 0; i < 6; ++i) {
      value[i] = std::max(value[i], e.value[i]);
      derivative[i] = std::max(derivative[i], e.derivative[i]);
    }
  }
  void expect_below(const Six& values, const Six& derivatives) const {
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_LE(value[i], values[i]) << "ABCDEF"[i];
      EXPECT_LE(derivative[i], derivatives[i]) << "derivative of "
                                               << "ABCDEF"[i];
    }
  }
};

/// Returns the relative errors of the coefficients and of their derivatives with respect to θ². The error of A is
/// absolute, because A vanishes at π.
Errors errors_at(double theta2) {
  const Reference exact(Dual(static_cast<Long>(theta2), 0));
  const AngleCoefficients<double> got(theta2);
  const AngleCoefficients<ceres::Jet<double, 1>> dual(ceres::Jet<double, 1>(theta2, 0));
  const auto relative = [](double a, Long b) { return static_cast<double>(std::abs((static_cast<Long>(a) - b) / b)); };
  Errors e;
  e.value = {relative(got.A, exact.A.a), relative(got.B, exact.B.a), relative(got.C, exact.C.a),
             relative(got.D, exact.D.a), relative(got.E, exact.E.a), relative(got.F, exact.F.a)};
  e.value[0] *= static_cast<double>(std::abs(exact.A.a));
  e.derivative = {relative(dual.A.v[0], exact.A.v[0]), relative(dual.B.v[0], exact.B.v[0]),
                  relative(dual.C.v[0], exact.C.v[0]), relative(dual.D.v[0], exact.D.v[0]),
                  relative(dual.E.v[0], exact.E.v[0]), relative(dual.F.v[0], exact.F.v[0])};
  return e;
}

constexpr double kThreshold = AngleCoefficients<double>::kSeriesBelow;

TEST(AngleCoefficients, AreAccurateBelowTheThreshold) {
  Errors e = errors_at(0.);
  for (double theta = 1e-12; theta * theta < kThreshold; theta *= 1.01) e.include(errors_at(theta * theta));
  e.include(errors_at(std::nextafter(kThreshold, 0.)));
  // Values are accurate to rounding. The series are truncated for the values, so the derivatives miss a larger term at
  // the threshold, for example 6 x⁵/15! against 1/120 for C.
  e.expect_below({5e-16, 5e-16, 2e-15, 1e-15, 1e-15, 1e-15}, {1e-14, 5e-15, 1e-12, 1e-12, 1e-12, 1e-12});
}

TEST(AngleCoefficients, AreAccurateAboveTheThreshold) {
  Errors e = errors_at(kThreshold);
  for (double theta = std::sqrt(kThreshold); theta < M_PI; theta += 1e-3) e.include(errors_at(theta * theta));
  for (const double to_pi : {1e-3, 1e-6, 1e-9, 0.}) e.include(errors_at((M_PI - to_pi) * (M_PI - to_pi)));
  // Cancellation is worst just above the threshold, where 1 − A = 0.041, 1 − θ/2 cot θ/2 = 0.021, 1/2 − B = 0.010 and
  // 3C − B = 0.0042. The last one also carries the error of C. The derivatives lose the same number of digits again.
  e.expect_below({5e-16, 1e-15, 1e-14, 2e-14, 4e-14, 1e-12}, {1e-14, 5e-14, 1.5e-12, 1e-11, 1e-11, 3e-10});
}

// Each coefficient enters a matrix multiplied by a power of θ (Jl: 1, θ², θ²; Q: θ², θ³). The product is accurate to
// the last place of the largest entry of the matrix.
TEST(AngleCoefficients, ProductsWithPowersOfThetaAreAccurate) {
  for (double theta = 1e-3; theta < M_PI; theta += 1e-3) {
    const double x = theta * theta;
    const Reference exact(Dual(static_cast<Long>(x), 0));
    const AngleCoefficients<double> got(x);
    const auto error = [](double a, const Dual& b, double power) {
      return power * static_cast<double>(std::abs(static_cast<Long>(a) - b.a));
    };
    EXPECT_LE(error(got.A, exact.A, 1.), 5e-16) << theta;
    EXPECT_LE(error(got.B, exact.B, theta), 5e-16) << theta;
    EXPECT_LE(error(got.C, exact.C, x), 1e-15) << theta;
    EXPECT_LE(error(got.D, exact.D, x), 1e-15) << theta;
    EXPECT_LE(error(got.E, exact.E, x), 1e-15) << theta;
    EXPECT_LE(error(got.F, exact.F, 2. * x * theta), 2e-15) << theta;
  }
}

// Between the last double of the series and the first of the closed form, the coefficients change only by their errors.
// Their true change over one unit in the last place is below 1e-17.
TEST(AngleCoefficients, AreContinuousAtTheThreshold) {
  const AngleCoefficients<double> below(std::nextafter(kThreshold, 0.)), above(kThreshold);
  EXPECT_NEAR(above.A / below.A, 1., 1e-15);
  EXPECT_NEAR(above.B / below.B, 1., 1e-15);
  EXPECT_NEAR(above.C / below.C, 1., 1e-14);
  EXPECT_NEAR(above.D / below.D, 1., 2e-14);
  EXPECT_NEAR(above.E / below.E, 1., 4e-14);
  EXPECT_NEAR(above.F / below.F, 1., 1e-12);
}

// The textbook form (1 + cos θ) / (2θ sin θ) is 0/0 at π; this form gives 1/π².
TEST(AngleCoefficients, InverseIsFiniteAtPi) {
  EXPECT_NEAR(AngleCoefficients<double>(M_PI * M_PI).D, 1. / (M_PI * M_PI), 1e-16);
}

}  // namespace
}  // namespace tandem
