#pragma once

#include <tandem/lie/coefficients.hpp>
#include <tandem/lie/so2.hpp>

namespace tandem {

/// Planar poses. Tangent: [ρ_x; ρ_y; θ] in m and rad.
template <class S>
class BasicSE2 {
 public:
  static constexpr int dof = 3, matrix_size = 3, point_dim = 2;
  using Scalar = S;
  using Tangent = Vector<3, S>;
  using Jacobian = Matrix<3, 3, S>;
  using AlgebraMatrix = Matrix<3, 3, S>;
  using Rotation = BasicSO2<S>;
  template <class Other>
  using Rebind = BasicSE2<Other>;

  BasicSE2() : t_(Vector<2, S>::Zero()) {}
  BasicSE2(const Rotation& R, const Vector<2, S>& t) : R_(R), t_(t) {}

  static BasicSE2 identity() { return {}; }

  static BasicSE2 Exp(const Tangent& v) {
    const AngleCoefficients<S> k(v[2] * v[2]);
    return BasicSE2(Rotation(v[2]), V(v[2], k) * v.template head<2>());
  }
  Tangent Log() const {
    const S theta = R_.angle();
    const AngleCoefficients<S> k(theta * theta);
    const Vector<2, S> rho = V_inverse(theta, k) * t_;
    return {rho[0], rho[1], theta};
  }

  const Rotation& rotation() const { return R_; }
  /// Position [m].
  const Vector<2, S>& translation() const { return t_; }
  AlgebraMatrix matrix() const {
    AlgebraMatrix M = AlgebraMatrix::Identity();
    M.template topLeftCorner<2, 2>() = R_.matrix();
    M.template topRightCorner<2, 1>() = t_;
    return M;
  }

  BasicSE2 inverse() const {
    const Rotation Ri = R_.inverse();
    return BasicSE2(Ri, -Ri.act(t_));
  }
  BasicSE2 operator*(const BasicSE2& y) const { return BasicSE2(R_ * y.R_, R_.act(y.t_) + t_); }
  Vector<2, S> act(const Vector<2, S>& p) const { return R_.act(p) + t_; }

  Jacobian Ad() const {
    Jacobian A = Jacobian::Identity();
    A.template topLeftCorner<2, 2>() = R_.matrix();
    A(0, 2) = t_[1];
    A(1, 2) = -t_[0];
    return A;
  }

  /// Returns the left Jacobian (Solà et al. 2018, eq. 163), with coefficients that are accurate at θ = 0.
  static Jacobian Jl(const Tangent& v) {
    const AngleCoefficients<S> k(v[2] * v[2]);
    Jacobian J = Jacobian::Identity();
    J.template topLeftCorner<2, 2>() = V(v[2], k);
    J.template topRightCorner<2, 1>() = last_column(v, k);
    return J;
  }
  static Jacobian Jr(const Tangent& v) { return Jl(-v); }
  static Jacobian Jl_inverse(const Tangent& v) {
    const AngleCoefficients<S> k(v[2] * v[2]);
    const Matrix<2, 2, S> Vi = V_inverse(v[2], k);
    Jacobian J = Jacobian::Identity();
    J.template topLeftCorner<2, 2>() = Vi;
    J.template topRightCorner<2, 1>() = -Vi * last_column(v, k);
    return J;
  }
  static Jacobian Jr_inverse(const Tangent& v) { return Jl_inverse(-v); }

  /// Returns the matrix of the Lie bracket: hat(ad(v) w) = hat(v) hat(w) − hat(w) hat(v).
  static Jacobian ad(const Tangent& v) {
    return (Jacobian() << S(0.), -v[2], v[1], v[2], S(0.), -v[0], S(0.), S(0.), S(0.)).finished();
  }

  static S angle(const Tangent& v) { return v[2] < 0. ? S(-v[2]) : v[2]; }
  static AlgebraMatrix hat(const Tangent& v) {
    AlgebraMatrix M = AlgebraMatrix::Zero();
    M.template topLeftCorner<2, 2>() = Rotation::hat(v.template tail<1>());
    M.template topRightCorner<2, 1>() = v.template head<2>();
    return M;
  }
  static Tangent vee(const AlgebraMatrix& m) { return {m(0, 2), m(1, 2), m(1, 0)}; }

  /// Returns ∂(R p + t)/∂δ, 2 × 3.
  Matrix<2, 3, S> act_jacobian(const Vector<2, S>& p) const {
    Matrix<2, 3, S> J;
    J.template leftCols<2>() = R_.matrix();
    J.col(2) = R_.act_jacobian(p);
    return J;
  }
  Matrix<2, 2, S> act_point_jacobian() const { return R_.matrix(); }

  template <class T>
  BasicSE2<T> cast() const {
    if constexpr (std::constructible_from<BasicSE2<T>, const BasicSE2&>) {
      return BasicSE2<T>(*this);
    } else {
      return BasicSE2<T>(R_.template cast<T>(), t_.template cast<T>());
    }
  }

 private:
  static Matrix<2, 2, S> V(const S& theta, const AngleCoefficients<S>& k) {
    return (Matrix<2, 2, S>() << k.A, -theta * k.B, theta * k.B, k.A).finished();
  }
  static Matrix<2, 2, S> V_inverse(const S& theta, const AngleCoefficients<S>& k) {
    const S a = 1. - theta * theta * k.D, b = 0.5 * theta;
    return (Matrix<2, 2, S>() << a, b, -b, a).finished();
  }
  static Vector<2, S> last_column(const Tangent& v, const AngleCoefficients<S>& k) {
    return {v[2] * k.C * v[0] + k.B * v[1], v[2] * k.C * v[1] - k.B * v[0]};
  }

  Rotation R_;
  Vector<2, S> t_;
};

using SE2 = BasicSE2<double>;  ///< poses in the plane, δ = [ρ; θ] [m, rad]
static_assert(LieGroup<SE2>);

}  // namespace tandem
