#pragma once

#include <cmath>

#include <tandem/lie/lie_group.hpp>

namespace tandem {

/// Planar rotations, stored as a unit complex number. Tangent: the angle [rad].
template <class S>
class BasicSO2 {
 public:
  static constexpr int dof = 1, matrix_size = 2, point_dim = 2;
  using Scalar = S;
  using Tangent = Vector<1, S>;
  using Jacobian = Matrix<1, 1, S>;
  using AlgebraMatrix = Matrix<2, 2, S>;
  template <class Other>
  using Rebind = BasicSO2<Other>;

  BasicSO2() = default;
  explicit BasicSO2(const S& angle) {
    using std::cos, std::sin;
    c_ = cos(angle);
    s_ = sin(angle);
  }

  static BasicSO2 identity() { return {}; }
  /// Constructs a rotation from the cosine and sine of its angle, without normalising them.
  static BasicSO2 from_unit(const S& c, const S& s) { return BasicSO2(c, s); }
  static BasicSO2 Exp(const Tangent& v) { return BasicSO2(v[0]); }
  Tangent Log() const { return Tangent(angle()); }

  /// Angle in (−π, π].
  S angle() const {
    using std::atan2;
    return atan2(s_, c_);
  }
  const S& cos_angle() const { return c_; }
  const S& sin_angle() const { return s_; }

  BasicSO2 inverse() const { return BasicSO2(c_, -s_); }
  BasicSO2 operator*(const BasicSO2& y) const { return BasicSO2(c_ * y.c_ - s_ * y.s_, c_ * y.s_ + s_ * y.c_); }
  Vector<2, S> act(const Vector<2, S>& p) const { return {c_ * p[0] - s_ * p[1], s_ * p[0] + c_ * p[1]}; }
  AlgebraMatrix matrix() const { return (AlgebraMatrix() << c_, -s_, s_, c_).finished(); }

  Jacobian Ad() const { return Jacobian::Identity(); }
  static Jacobian Jl(const Tangent&) { return Jacobian::Identity(); }
  static Jacobian Jr(const Tangent&) { return Jacobian::Identity(); }
  static Jacobian Jl_inverse(const Tangent&) { return Jacobian::Identity(); }
  static Jacobian Jr_inverse(const Tangent&) { return Jacobian::Identity(); }

  /// Returns the matrix of the Lie bracket, which is zero.
  static Jacobian ad(const Tangent&) { return Jacobian::Zero(); }

  static S angle(const Tangent& v) { return v[0] < 0. ? S(-v[0]) : v[0]; }
  static AlgebraMatrix hat(const Tangent& v) { return (AlgebraMatrix() << S(0.), -v[0], v[0], S(0.)).finished(); }
  static Tangent vee(const AlgebraMatrix& m) { return Tangent(m(1, 0)); }

  /// Returns ∂(R p)/∂δ, 2 × 1.
  Matrix<2, 1, S> act_jacobian(const Vector<2, S>& p) const {
    const Vector<2, S> q = act(p);
    return {-q[1], q[0]};
  }
  Matrix<2, 2, S> act_point_jacobian() const { return matrix(); }

  template <class T>
  BasicSO2<T> cast() const {
    return BasicSO2<T>(T(c_), T(s_));
  }

 private:
  template <class>
  friend class BasicSO2;
  BasicSO2(const S& c, const S& s) : c_(c), s_(s) {}

  S c_{1.}, s_{0.};
};

using SO2 = BasicSO2<double>;  ///< rotations of the plane [rad]
static_assert(LieGroup<SO2>);

}  // namespace tandem
