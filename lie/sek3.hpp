#pragma once

#include <tandem/lie/so3.hpp>

namespace tandem {

/// SE_K(3): a rotation R and K vectors that rotate with it. K = 1 is the pose group SE(3); K = 2 is the group SE₂(3) of
/// extended poses (position and velocity). Tangent: [ρ_1; …; ρ_K; θ], ρ in m (or m/s), θ in rad. matrix() is [R t_1 …
/// t_K; 0 I].
template <int K, class S>
class BasicSEK3 {
 public:
  static constexpr int dof = 3 * K + 3, matrix_size = 3 + K, point_dim = 3;
  using Scalar = S;
  using Tangent = Vector<dof, S>;
  using Jacobian = Matrix<dof, dof, S>;
  using AlgebraMatrix = Matrix<matrix_size, matrix_size, S>;
  using Rotation = BasicSO3<S>;
  using Columns = Matrix<3, K, S>;
  template <class Other>
  using Rebind = BasicSEK3<K, Other>;

  BasicSEK3() : t_(Columns::Zero()) {}
  BasicSEK3(const Rotation& R, const Columns& t) : R_(R), t_(t) {}

  static BasicSEK3 identity() { return {}; }

  static BasicSEK3 Exp(const Tangent& v) {
    const Vector<3, S> theta = v.template tail<3>();
    return BasicSEK3(Rotation::Exp(theta), Rotation::Jl(theta) * columns(v));
  }
  Tangent Log() const;

  const Rotation& rotation() const { return R_; }
  /// Position [m].
  Vector<3, S> translation() const { return t_.col(0); }
  /// Velocity in the world frame [m/s].
  Vector<3, S> velocity() const requires(K == 2) { return t_.col(1); }
  AlgebraMatrix matrix() const {
    AlgebraMatrix M = AlgebraMatrix::Identity();
    M.template topLeftCorner<3, 3>() = R_.matrix();
    M.template topRightCorner<3, K>() = t_;
    return M;
  }

  BasicSEK3 inverse() const {
    const Rotation Ri = R_.inverse();
    return BasicSEK3(Ri, Ri.matrix() * -t_);
  }
  BasicSEK3 operator*(const BasicSEK3& y) const { return BasicSEK3(R_ * y.R_, R_.matrix() * y.t_ + t_); }
  /// Returns R p + t_1.
  Vector<3, S> act(const Vector<3, S>& p) const { return R_.act(p) + t_.col(0); }

  Jacobian Ad() const {
    const Matrix<3, 3, S> R = R_.matrix();
    Jacobian A = diagonal(R);
    for (int k = 0; k < K; ++k) A.template block<3, 3>(3 * k, 3 * K).noalias() = skew(t_.col(k)) * R;
    return A;
  }

  /// Returns [Jl(θ) Q(ρ, θ); 0 Jl(θ)], with one Q for each ρ_k (Barfoot 2017, eq. 7.85).
  static Jacobian Jl(const Tangent& v);
  static Jacobian Jr(const Tangent& v) { return Jl(-v); }

  /// Returns [Jl⁻¹ −Jl⁻¹ Q Jl⁻¹; 0 Jl⁻¹].
  static Jacobian Jl_inverse(const Tangent& v);
  static Jacobian Jr_inverse(const Tangent& v) { return Jl_inverse(-v); }

  /// Returns the Jacobian of Exp (or its inverse) at −v from the same Jacobian at v, e.g. Jr(v) from Jl(v). Transposes
  /// every 3 × 3 block, since Q(−ρ, −θ) = Q(ρ, θ)ᵀ.
  static Jacobian opposite(const Jacobian& J) {
    Jacobian T = diagonal(J.template topLeftCorner<3, 3>().transpose());
    for (int k = 0; k < K; ++k) T.template block<3, 3>(3 * k, 3 * K) = J.template block<3, 3>(3 * k, 3 * K).transpose();
    return T;
  }
  /// Returns a b, where a and b have the block form [D O; 0 D]: Jacobians of Exp, their inverses, Ad or ad.
  static Jacobian product(const Jacobian& a, const Jacobian& b);

  /// Returns the matrix of the Lie bracket, [[θ]× [ρ]×; 0 [θ]×]: hat(ad(v) w) = hat(v) hat(w) − hat(w) hat(v).
  static Jacobian ad(const Tangent& v) {
    Jacobian A = diagonal(skew(v.template tail<3>()));
    for (int k = 0; k < K; ++k) A.template block<3, 3>(3 * k, 3 * K) = skew(v.template segment<3>(3 * k));
    return A;
  }

  static S angle(const Tangent& v) { return v.template tail<3>().norm(); }
  static AlgebraMatrix hat(const Tangent& v) {
    AlgebraMatrix M = AlgebraMatrix::Zero();
    M.template topLeftCorner<3, 3>() = skew(v.template tail<3>());
    M.template topRightCorner<3, K>() = columns(v);
    return M;
  }
  static Tangent vee(const AlgebraMatrix& m) {
    Tangent v;
    for (int k = 0; k < K; ++k) v.template segment<3>(3 * k) = m.template block<3, 1>(0, 3 + k);
    v.template tail<3>() = Rotation::vee(m.template topLeftCorner<3, 3>());
    return v;
  }

  /// Returns ∂(R p + t_1)/∂δ = [R 0 −R [p]×], 3 × dof.
  Matrix<3, dof, S> act_jacobian(const Vector<3, S>& p) const {
    Matrix<3, dof, S> J = Matrix<3, dof, S>::Zero();
    J.template leftCols<3>() = R_.matrix();
    J.template rightCols<3>() = R_.act_jacobian(p);
    return J;
  }
  Matrix<3, 3, S> act_point_jacobian() const { return R_.matrix(); }

  template <class T>
  BasicSEK3<K, T> cast() const {
    if constexpr (std::constructible_from<BasicSEK3<K, T>, const BasicSEK3&>) {
      return BasicSEK3<K, T>(*this);
    } else {
      return BasicSEK3<K, T>(R_.template cast<T>(), t_.template cast<T>());
    }
  }

 private:
  static Columns columns(const Tangent& v) {
    Columns t;
    for (int k = 0; k < K; ++k) t.col(k) = v.template segment<3>(3 * k);
    return t;
  }

  static Jacobian diagonal(const Matrix<3, 3, S>& M) {
    Jacobian J = Jacobian::Zero();
    for (int k = 0; k <= K; ++k) J.template block<3, 3>(3 * k, 3 * k) = M;
    return J;
  }

  /// Barfoot 2017, eq. 7.86b, with P = [ρ]× and W = [θ]×. The identities (PW)ᵀ = WP and W³ = −θ²W save products.
  static Matrix<3, 3, S> Q(const Vector<3, S>& rho, const Vector<3, S>& theta, const AngleCoefficients<S>& k);

  Rotation R_;
  Columns t_;
};

template <int K, class S>
auto BasicSEK3<K, S>::Log() const -> Tangent {
  const Vector<3, S> theta = R_.Log();
  const Columns rho = Rotation::Jl_inverse(theta) * t_;
  Tangent v;
  for (int k = 0; k < K; ++k) v.template segment<3>(3 * k) = rho.col(k);
  v.template tail<3>() = theta;
  return v;
}

template <int K, class S>
auto BasicSEK3<K, S>::Jl(const Tangent& v) -> Jacobian {
  const Vector<3, S> theta = v.template tail<3>();
  const AngleCoefficients<S> k(theta.squaredNorm());
  Jacobian J = diagonal(Rotation::polynomial(theta, k.B, k.C));
  for (int i = 0; i < K; ++i) {
    const Vector<3, S> rho = v.template segment<3>(3 * i);
    J.template block<3, 3>(3 * i, 3 * K) = Q(rho, theta, k);
  }
  return J;
}

template <int K, class S>
auto BasicSEK3<K, S>::Jl_inverse(const Tangent& v) -> Jacobian {
  const Vector<3, S> theta = v.template tail<3>();
  const AngleCoefficients<S> k(theta.squaredNorm());
  const Matrix<3, 3, S> Ji = Rotation::polynomial(theta, S(-0.5), k.D);
  Jacobian J = diagonal(Ji);
  for (int i = 0; i < K; ++i) {
    const Vector<3, S> rho = v.template segment<3>(3 * i);
    const Matrix<3, 3, S> QJi = Q(rho, theta, k) * Ji;
    J.template block<3, 3>(3 * i, 3 * K).noalias() = -Ji * QJi;
  }
  return J;
}

template <int K, class S>
auto BasicSEK3<K, S>::product(const Jacobian& a, const Jacobian& b) -> Jacobian {
  const Matrix<3, 3, S> Da = a.template topLeftCorner<3, 3>(), Db = b.template topLeftCorner<3, 3>();
  Jacobian c = diagonal(Da * Db);
  for (int k = 0; k < K; ++k) {
    auto block = c.template block<3, 3>(3 * k, 3 * K);
    block.noalias() = Da * b.template block<3, 3>(3 * k, 3 * K);
    block.noalias() += a.template block<3, 3>(3 * k, 3 * K) * Db;
  }
  return c;
}

template <int K, class S>
Matrix<3, 3, S> BasicSEK3<K, S>::Q(const Vector<3, S>& rho, const Vector<3, S>& theta, const AngleCoefficients<S>& k) {
  const Matrix<3, 3, S> P = skew(rho), W = skew(theta);
  const S c = theta.dot(rho);
  // W P = ρ θᵀ − c I,  P W = θ ρᵀ − c I,  W P W = −c W;  W² = θ θᵀ − θ² I
  const Matrix<3, 3, S> WP = rho * theta.transpose() - c * Matrix<3, 3, S>::Identity();
  const Matrix<3, 3, S> W2 = theta * theta.transpose() - theta.squaredNorm() * Matrix<3, 3, S>::Identity();
  const Matrix<3, 3, S> W2P = W * WP;
  Matrix<3, 3, S> M = 0.5 * P;
  M += k.C * (WP + WP.transpose() - c * W);
  M += k.E * (W2P - W2P.transpose() + 3. * c * W);
  M -= (2. * c * k.F) * W2;  // W P W² + W² P W = −2c W²
  return M;
}

template <class S>
using BasicSE3 = BasicSEK3<1, S>;
template <class S>
using BasicSE23 = BasicSEK3<2, S>;
using SE3 = BasicSE3<double>;    ///< poses in space, δ = [ρ; θ] [m, rad]
using SE23 = BasicSE23<double>;  ///< position, velocity and rotation, in this order
static_assert(LieGroup<SE3> && LieGroup<SE23>);

// Instantiated once, in sek3.cpp, to reduce compile time.
extern template class BasicSEK3<1, double>;
extern template class BasicSEK3<2, double>;

}  // namespace tandem
