#pragma once

#include <tandem/lie/lie_group.hpp>

namespace tandem {

/// R^N under addition, for points, velocities and biases. matrix() is [I x; 0 1].
template <int N, class S>
class BasicRn {
 public:
  static constexpr int dof = N, matrix_size = N + 1, point_dim = N;
  using Scalar = S;
  using Tangent = Vector<N, S>;
  using Jacobian = Matrix<N, N, S>;
  using AlgebraMatrix = Matrix<N + 1, N + 1, S>;
  template <class Other>
  using Rebind = BasicRn<N, Other>;

  BasicRn() : x_(Tangent::Zero()) {}
  explicit BasicRn(const Tangent& x) : x_(x) {}

  static BasicRn identity() { return {}; }
  static BasicRn Exp(const Tangent& v) { return BasicRn(v); }
  const Tangent& vector() const { return x_; }
  /// Returns the vector itself. Points and poses thus have the same interface for their position.
  const Tangent& translation() const { return x_; }
  Tangent Log() const { return x_; }

  BasicRn inverse() const { return BasicRn(-x_); }
  BasicRn operator*(const BasicRn& y) const { return BasicRn(x_ + y.x_); }
  Tangent act(const Tangent& p) const { return p + x_; }
  AlgebraMatrix matrix() const {
    AlgebraMatrix M = AlgebraMatrix::Identity();
    M.template topRightCorner<N, 1>() = x_;
    return M;
  }

  Jacobian Ad() const { return Jacobian::Identity(); }
  static Jacobian Jl(const Tangent&) { return Jacobian::Identity(); }
  static Jacobian Jr(const Tangent&) { return Jacobian::Identity(); }
  static Jacobian Jl_inverse(const Tangent&) { return Jacobian::Identity(); }
  static Jacobian Jr_inverse(const Tangent&) { return Jacobian::Identity(); }

  /// Returns the matrix of the Lie bracket, which is zero.
  static Jacobian ad(const Tangent&) { return Jacobian::Zero(); }

  static S angle(const Tangent&) { return S(0.); }
  static AlgebraMatrix hat(const Tangent& v) {
    AlgebraMatrix M = AlgebraMatrix::Zero();
    M.template topRightCorner<N, 1>() = v;
    return M;
  }
  static Tangent vee(const AlgebraMatrix& m) { return m.template topRightCorner<N, 1>(); }

  Jacobian act_jacobian(const Tangent&) const { return Jacobian::Identity(); }
  Jacobian act_point_jacobian() const { return Jacobian::Identity(); }

  template <class T>
  BasicRn<N, T> cast() const {
    return BasicRn<N, T>(x_.template cast<T>());
  }

 private:
  Tangent x_;
};

template <int N>
using Rn = BasicRn<N, double>;
using R2 = Rn<2>;
using R3 = Rn<3>;
static_assert(LieGroup<R2> && LieGroup<R3>);

/// True for groups that are vector spaces.
template <class G>
inline constexpr bool is_vector_space = false;
template <int N, class S>
inline constexpr bool is_vector_space<BasicRn<N, S>> = true;

}  // namespace tandem
