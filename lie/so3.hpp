#pragma once

#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include <tandem/lie/coefficients.hpp>
#include <tandem/lie/lie_group.hpp>

namespace tandem {

/// Returns [v]×, the matrix of the cross product with v.
template <class Derived>
Matrix<3, 3, typename Derived::Scalar> skew(const Eigen::MatrixBase<Derived>& v) {
  using S = typename Derived::Scalar;
  return (Matrix<3, 3, S>() << S(0.), -v[2], v[1], v[2], S(0.), -v[0], -v[1], v[0], S(0.)).finished();
}

/// Rotations in space, stored as a unit Hamilton quaternion. Tangent: the rotation vector [rad].
template <class S>
class BasicSO3 {
 public:
  static constexpr int dof = 3, matrix_size = 3, point_dim = 3;
  using Scalar = S;
  using Tangent = Vector<3, S>;
  using Jacobian = Matrix<3, 3, S>;
  using AlgebraMatrix = Matrix<3, 3, S>;
  using Quaternion = Eigen::Quaternion<S>;
  template <class Other>
  using Rebind = BasicSO3<Other>;

  /// Series replace the closed forms below this value of θ² in Exp and |vec|² in Log (truncation error below 1e-16).
  static constexpr double kSeriesBelow = 1e-3;

  BasicSO3() : q_(S(1.), S(0.), S(0.), S(0.)) {}
  /// Normalises `q`.
  explicit BasicSO3(const Quaternion& q) : q_(q.normalized()) {}
  /// `R` is a rotation matrix.
  explicit BasicSO3(const Matrix<3, 3, S>& R) : q_(R) { q_.normalize(); }

  static BasicSO3 identity() { return {}; }
  /// Constructs a rotation from a unit quaternion without normalising it.
  static BasicSO3 from_unit(const Quaternion& q) {
    BasicSO3 X;
    X.q_ = q;
    return X;
  }

  static BasicSO3 Exp(const Tangent& v) {
    const S theta2 = v.squaredNorm();
    const auto series = [&]() -> std::array<S, 2> {
      const S x = 0.25 * theta2;
      return {1. + x * (-1. / 2 + x * (1. / 24 + x * (-1. / 720 + x * (1. / 40320)))),
              0.5 + x * (-1. / 12 + x * (1. / 240 + x * (-1. / 10080 + x * (1. / 725760))))};
    };
    const auto closed = [&]() -> std::array<S, 2> {
      using std::cos, std::sin, std::sqrt;
      const S theta = sqrt(theta2);
      return {cos(0.5 * theta), sin(0.5 * theta) / theta};
    };
    const auto [w, scale] = detail::piecewise(theta2, kSeriesBelow, series, closed);  // cos(θ/2), sin(θ/2)/θ
    BasicSO3 X;
    X.q_ = Quaternion(w, scale * v[0], scale * v[1], scale * v[2]);
    return X;
  }

  /// Returns the rotation vector, of length at most π. At exactly π both signs are valid.
  Tangent Log() const {
    const S n2 = q_.vec().squaredNorm();
    const auto signed_as_w = [&](const S& x) {
      return detail::piecewise(
          q_.w(), 0.0, [&] { return S(-x); }, [&] { return x; });
    };
    const S w = signed_as_w(q_.w());
    const auto series = [&]() -> S {
      const S x = n2 / (w * w);
      return 2. / w * (1. + x * (-1. / 3 + x * (1. / 5 + x * (-1. / 7 + x * (1. / 9)))));
    };
    const auto closed = [&]() -> S {
      using std::atan2, std::sqrt;
      const S n = sqrt(n2);
      return 2. * atan2(n, w) / n;
    };
    // θ / |vec| with θ = 2 atan2(|vec|, |w|) is accurate from 0 to π.
    return signed_as_w(detail::piecewise(n2, kSeriesBelow, series, closed)) * q_.vec();
  }

  const Quaternion& quaternion() const { return q_; }
  Matrix<3, 3, S> matrix() const { return q_.toRotationMatrix(); }

  BasicSO3 inverse() const {
    BasicSO3 X;
    X.q_ = q_.conjugate();
    return X;
  }
  BasicSO3 operator*(const BasicSO3& y) const {
    BasicSO3 X;
    X.q_ = q_ * y.q_;
    return X;
  }
  Vector<3, S> act(const Vector<3, S>& p) const { return q_ * p; }

  Jacobian Ad() const { return matrix(); }

  static Jacobian Jl(const Tangent& v) {
    const AngleCoefficients<S> k(v.squaredNorm());
    return polynomial(v, k.B, k.C);
  }
  static Jacobian Jr(const Tangent& v) { return Jl(-v); }
  static Jacobian Jl_inverse(const Tangent& v) {
    const AngleCoefficients<S> k(v.squaredNorm());
    return polynomial(v, S(-0.5), k.D);
  }
  static Jacobian Jr_inverse(const Tangent& v) { return Jl_inverse(-v); }

  /// Returns the Jacobian of Exp (or its inverse) at −v from the same Jacobian at v, e.g. Jr(v) from Jl(v).
  static Jacobian opposite(const Jacobian& J) { return J.transpose(); }

  /// Returns the matrix of the Lie bracket: hat(ad(v) w) = hat(v) hat(w) − hat(w) hat(v).
  static Jacobian ad(const Tangent& v) { return skew(v); }

  static S angle(const Tangent& v) { return v.norm(); }
  static AlgebraMatrix hat(const Tangent& v) { return skew(v); }
  static Tangent vee(const AlgebraMatrix& m) { return {m(2, 1), m(0, 2), m(1, 0)}; }

  /// Returns ∂(R p)/∂δ = −R [p]×, 3 × 3.
  Matrix<3, 3, S> act_jacobian(const Vector<3, S>& p) const { return matrix() * skew(S(-1.) * p); }
  Matrix<3, 3, S> act_point_jacobian() const { return matrix(); }

  template <class T>
  BasicSO3<T> cast() const {
    if constexpr (std::constructible_from<BasicSO3<T>, const BasicSO3&>) {
      return BasicSO3<T>(*this);
    } else {
      return BasicSO3<T>::from_unit(q_.template cast<T>());
    }
  }

  /// Returns I + a [v]× + b [v]×²: Jl for (a, b) = (B, C), its inverse for (−1/2, D).
  static Jacobian polynomial(const Tangent& v, const S& a, const S& b) {
    const S xx = b * v[0] * v[0], yy = b * v[1] * v[1], zz = b * v[2] * v[2];
    const S xy = b * v[0] * v[1], xz = b * v[0] * v[2], yz = b * v[1] * v[2];
    const S x = a * v[0], y = a * v[1], z = a * v[2];
    Jacobian J;
    J << 1. - yy - zz, xy - z, xz + y,  //
        xy + z, 1. - xx - zz, yz - x,   //
        xz - y, yz + x, 1. - xx - yy;
    return J;
  }

 private:
  template <class>
  friend class BasicSO3;
  Quaternion q_;
};

using SO3 = BasicSO3<double>;  ///< rotations of space [rad]
static_assert(LieGroup<SO3>);

}  // namespace tandem
