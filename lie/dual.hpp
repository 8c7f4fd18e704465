#pragma once

#include <cmath>
#include <compare>
#include <limits>

#include <Eigen/Core>

namespace tandem {

/// Dual number for forward automatic differentiation: a value and its derivatives in N directions. Arithmetic and the
/// functions below apply the chain rule, comparisons compare the values. The default constructor leaves the numbers
/// uninitialised.
///
/// As the scalar of SO3, SE2 and SE_K(3), a Dual selects the specialisations in dual_groups.hpp, which differentiate in
/// the tangent space. With `kPlain`, the groups differentiate the numbers that they store.
///
/// Derivatives are those of the formula. They are infinite or NaN if the formula is not differentiable, such as sqrt at
/// 0. The derivative of abs() at 0 is 1.
template <int N, bool kPlain = false>
struct Dual {
  static_assert(N > 0);
  /// Derivatives. If their number is odd, a zero is appended, so that all are computed in vector registers.
  using Partials = Eigen::Array<double, N + N % 2, 1>;

  double a;    ///< value
  Partials v;  ///< derivatives

  Dual() = default;
  Dual(double value) : a(value), v(Partials::Zero()) {}  // NOLINT: implicit, a constant
  template <class V>
  Dual(double value, const Eigen::ArrayBase<V>& partials) : a(value), v(partials) {}
  /// Returns the independent variable of direction i.
  static Dual variable(double value, int i) {
    Dual x(value);
    x.v[i] = 1.0;
    return x;
  }
  explicit Dual(const Dual<N, !kPlain>& x) : a(x.a), v(x.v) {}

  friend Dual operator+(const Dual& x, const Dual& y) { return {x.a + y.a, x.v + y.v}; }
  friend Dual operator+(const Dual& x, double y) { return {x.a + y, x.v}; }
  friend Dual operator+(double x, const Dual& y) { return {x + y.a, y.v}; }
  friend Dual operator-(const Dual& x, const Dual& y) { return {x.a - y.a, x.v - y.v}; }
  friend Dual operator-(const Dual& x, double y) { return {x.a - y, x.v}; }
  friend Dual operator-(double x, const Dual& y) { return {x - y.a, -y.v}; }
  friend Dual operator*(const Dual& x, const Dual& y) { return {x.a * y.a, x.a * y.v + y.a * x.v}; }
  friend Dual operator*(const Dual& x, double y) { return {x.a * y, y * x.v}; }
  friend Dual operator*(double x, const Dual& y) { return {x * y.a, x * y.v}; }
  friend Dual operator/(const Dual& x, const Dual& y) {
    const double by = 1.0 / y.a, value = x.a / y.a;
    return {value, by * (x.v - value * y.v)};
  }
  friend Dual operator/(const Dual& x, double y) { return {x.a / y, (1.0 / y) * x.v}; }
  friend Dual operator/(double x, const Dual& y) {
    const double value = x / y.a;
    return {value, (-value / y.a) * y.v};
  }
  Dual operator+() const { return *this; }
  Dual operator-() const { return {-a, -v}; }
  Dual& operator+=(const Dual& y) { return *this = *this + y; }
  Dual& operator-=(const Dual& y) { return *this = *this - y; }
  Dual& operator*=(const Dual& y) { return *this = *this * y; }
  Dual& operator/=(const Dual& y) { return *this = *this / y; }

  friend bool operator==(const Dual& x, const Dual& y) { return x.a == y.a; }
  friend std::partial_ordering operator<=>(const Dual& x, const Dual& y) { return x.a <=> y.a; }

  friend Dual abs(const Dual& x) { return x.a < 0.0 ? -x : x; }
  friend Dual sqrt(const Dual& x) {
    const double root = std::sqrt(x.a);
    return {root, (0.5 / root) * x.v};
  }
  friend Dual cbrt(const Dual& x) {
    const double root = std::cbrt(x.a);
    return {root, (1.0 / (3.0 * root * root)) * x.v};
  }
  friend Dual exp(const Dual& x) {
    const double value = std::exp(x.a);
    return {value, value * x.v};
  }
  friend Dual expm1(const Dual& x) { return {std::expm1(x.a), std::exp(x.a) * x.v}; }
  friend Dual log(const Dual& x) { return {std::log(x.a), (1.0 / x.a) * x.v}; }
  friend Dual log1p(const Dual& x) { return {std::log1p(x.a), (1.0 / (1.0 + x.a)) * x.v}; }
  friend Dual sin(const Dual& x) { return {std::sin(x.a), std::cos(x.a) * x.v}; }
  friend Dual cos(const Dual& x) { return {std::cos(x.a), -std::sin(x.a) * x.v}; }
  friend Dual tan(const Dual& x) {
    const double value = std::tan(x.a);
    return {value, (1.0 + value * value) * x.v};
  }
  friend Dual asin(const Dual& x) { return {std::asin(x.a), (1.0 / std::sqrt(1.0 - x.a * x.a)) * x.v}; }
  friend Dual acos(const Dual& x) { return {std::acos(x.a), (-1.0 / std::sqrt(1.0 - x.a * x.a)) * x.v}; }
  friend Dual atan(const Dual& x) { return {std::atan(x.a), (1.0 / (1.0 + x.a * x.a)) * x.v}; }
  friend Dual atan2(const Dual& y, const Dual& x) {
    const double by = 1.0 / (x.a * x.a + y.a * y.a);
    return {std::atan2(y.a, x.a), (by * x.a) * y.v - (by * y.a) * x.v};
  }
  friend Dual sinh(const Dual& x) { return {std::sinh(x.a), std::cosh(x.a) * x.v}; }
  friend Dual cosh(const Dual& x) { return {std::cosh(x.a), std::sinh(x.a) * x.v}; }
  friend Dual tanh(const Dual& x) {
    const double value = std::tanh(x.a);
    return {value, (1.0 - value * value) * x.v};
  }
  friend Dual hypot(const Dual& x, const Dual& y) {
    const double value = std::hypot(x.a, y.a);
    return {value, (x.a / value) * x.v + (y.a / value) * y.v};
  }
  friend Dual pow(const Dual& x, double y) {
    return {std::pow(x.a, y), (y == 0.0 ? 0.0 : y * std::pow(x.a, y - 1.0)) * x.v};
  }
  friend Dual pow(const Dual& x, const Dual& y) {
    const double value = std::pow(x.a, y.a);
    return {value, (y.a * std::pow(x.a, y.a - 1.0)) * x.v + (value * std::log(x.a)) * y.v};
  }
  friend Dual pow(double x, const Dual& y) {
    const double value = std::pow(x, y.a);
    return {value, (value * std::log(x)) * y.v};
  }
  friend bool isfinite(const Dual& x) { return std::isfinite(x.a) && x.v.allFinite(); }
  friend bool isnan(const Dual& x) { return std::isnan(x.a) || x.v.isNaN().any(); }
};

}  // namespace tandem

namespace Eigen {

template <int N, bool kPlain>
struct NumTraits<tandem::Dual<N, kPlain>> : GenericNumTraits<tandem::Dual<N, kPlain>> {
  using Real = tandem::Dual<N, kPlain>;
  using NonInteger = Real;
  using Literal = double;
  using Nested = Real;
  static double epsilon() { return NumTraits<double>::epsilon(); }
  static double dummy_precision() { return NumTraits<double>::dummy_precision(); }
  static double highest() { return NumTraits<double>::highest(); }
  static double lowest() { return NumTraits<double>::lowest(); }
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 0,
    ReadCost = N,
    AddCost = N,
    MulCost = 2 * N
  };
};

template <int N, bool kPlain, class Op>
struct ScalarBinaryOpTraits<tandem::Dual<N, kPlain>, double, Op> {
  using ReturnType = tandem::Dual<N, kPlain>;
};
template <int N, bool kPlain, class Op>
struct ScalarBinaryOpTraits<double, tandem::Dual<N, kPlain>, Op> {
  using ReturnType = tandem::Dual<N, kPlain>;
};

}  // namespace Eigen
