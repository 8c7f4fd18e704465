#pragma once

#include <array>

#include <tandem/lie/dual.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>

namespace tandem {

namespace detail {

/// Element of G that depends on N variables ε: X(ε) = X̄ Exp(D ε) to first order. Products, inverses, Exp and Log apply
/// the closed-form Jacobians of G to D. This takes a fraction of the time of differentiating the stored numbers, and
/// the derivatives are as accurate as the Jacobians, for rotation angles from 0 to π.
///
/// `Derived` is the specialisation of the group for Dual<N>. `Plain` is the group over dual numbers without this
/// specialisation.
template <class Derived, class G, class Plain, int N>
class DualGroup {
 public:
  static constexpr int dof = G::dof, matrix_size = G::matrix_size, point_dim = G::point_dim;
  using Scalar = Dual<N>;
  using Tangent = Vector<dof, Scalar>;
  using Jacobian = Matrix<dof, dof, Scalar>;
  using AlgebraMatrix = Matrix<matrix_size, matrix_size, Scalar>;
  using Point = Vector<point_dim, Scalar>;
  using Partials = typename Scalar::Partials;
  /// D, one row for each direction of the tangent.
  using Derivatives = Eigen::Array<double, dof, Partials::SizeAtCompileTime, Eigen::RowMajor>;

  /// Returns x ⊕ ε, where ε are the variables from `first` on.
  static Derived perturbed(const G& x, int first) {
    Derived y(x);
    y.D_.setZero();
    for (int i = 0; i < dof; ++i) y.D_(i, first + i) = 1.0;
    y.constant_ = false;
    y.first_ = first;
    return y;
  }
  const G& value() const { return x_; }
  bool is_constant() const { return constant_; }

  static Derived identity() { return {}; }
  static Derived Exp(const Tangent& v) {
    const typename G::Tangent value = values(v);
    Derived y(G::Exp(value));
    y.constant_ = false;
    apply(
        G::Jr(value), [&](int j) { return v[j].v.transpose(); }, y.D_);
    return y;
  }
  Tangent Log() const {
    const typename G::Tangent v = x_.Log();
    if (constant_) return v.template cast<Scalar>();
    Derivatives d;
    apply(G::Jr_inverse(v), d);
    Tangent dual;
    for (int i = 0; i < dof; ++i) dual[i] = {v[i], d.row(i).transpose()};
    return dual;
  }
  Derived inverse() const {
    Derived y(x_.inverse());
    if (constant_) return y;
    y.constant_ = false;
    apply(-x_.Ad(), y.D_);
    return y;
  }
  Derived operator*(const Derived& y) const {
    Derived z(x_ * y.x_);
    z.constant_ = constant_ && y.constant_;
    if (constant_) {
      z.D_ = y.D_;
      z.first_ = y.first_;
    } else {
      apply(y.x_.inverse().Ad(), z.D_);
      if (!y.constant_) z.D_ += y.D_;
    }
    return z;
  }
  Point act(const Point& p) const {
    const Vector<point_dim> value = values(p), moved = x_.act(value);
    // dq = by_p (dp + by_x D dε), where by_x is the derivative of Exp(δ) p. Its zeros save most products.
    const Matrix<point_dim, dof> by_x = G::identity().act_jacobian(value);
    const Matrix<point_dim, point_dim> by_p = x_.act_point_jacobian();
    std::array<Partials, point_dim> inner;
    for (int i = 0; i < point_dim; ++i) {
      inner[i] = p[i].v;
      if (constant_) continue;
      if (first_ >= 0) {
        inner[i].template segment<dof>(first_) += by_x.row(i).transpose().array();
        continue;
      }
      for (int j = 0; j < dof; ++j)
        if (by_x(i, j) != 0.0) inner[i] += by_x(i, j) * D_.row(j).transpose();
    }
    Point q;
    for (int i = 0; i < point_dim; ++i) {
      q[i].a = moved[i];
      q[i].v = by_p(i, 0) * inner[0];
      for (int j = 1; j < point_dim; ++j) q[i].v += by_p(i, j) * inner[j];
    }
    return q;
  }

  // Functions that are rarely differentiated use the plain group.
  AlgebraMatrix matrix() const { return dual(derived().plain().matrix()); }
  Jacobian Ad() const { return dual(derived().plain().Ad()); }
  auto act_jacobian(const Point& p) const { return dual(derived().plain().act_jacobian(plain(p))); }
  auto act_point_jacobian() const { return dual(derived().plain().act_point_jacobian()); }
  static Jacobian Jl(const Tangent& v) { return dual(Plain::Jl(plain(v))); }
  static Jacobian Jr(const Tangent& v) { return dual(Plain::Jr(plain(v))); }
  static Jacobian Jl_inverse(const Tangent& v) { return dual(Plain::Jl_inverse(plain(v))); }
  static Jacobian Jr_inverse(const Tangent& v) { return dual(Plain::Jr_inverse(plain(v))); }
  static Jacobian ad(const Tangent& v) { return dual(Plain::ad(plain(v))); }
  static Scalar angle(const Tangent& v) { return Scalar(Plain::angle(plain(v))); }
  static AlgebraMatrix hat(const Tangent& v) { return dual(Plain::hat(plain(v))); }
  static Tangent vee(const AlgebraMatrix& m) { return dual(Plain::vee(plain(m))); }

 protected:
  DualGroup() : DualGroup(G()) {}
  explicit DualGroup(const G& constant) : x_(constant), constant_(true) {}

  template <class M>
  static auto plain(const M& m) {
    return m.template cast<Dual<N, true>>().eval();
  }
  template <class M>
  static auto dual(const M& m) {
    return m.template cast<Scalar>().eval();
  }
  template <class M>
  static auto values(const M& m) {
    return m.unaryExpr([](const Scalar& x) { return x.a; }).eval();
  }
  /// Sets out = A D.
  void apply(const typename G::Jacobian& A, Derivatives& out) const {
    if (first_ >= 0) {
      out.setZero();
      out.template middleCols<dof>(first_) = A;
    } else {
      apply(
          A, [this](int j) { return D_.row(j); }, out);
    }
  }
  /// Sets out = A d, where row(j) returns row j of d.
  template <class Row>
  static void apply(const typename G::Jacobian& A, const Row& row, Derivatives& out) {
    for (int i = 0; i < dof; ++i) {
      Eigen::Array<double, 1, Partials::SizeAtCompileTime> sum = A(i, i) * row(i);
      for (int j = 0; j < dof; ++j)
        if (j != i && A(i, j) != 0.0) sum += A(i, j) * row(j);
      out.row(i) = sum;
    }
  }
  const Derived& derived() const { return static_cast<const Derived&>(*this); }

  G x_;
  Derivatives D_;  ///< undefined for constants
  bool constant_;
  int first_ = -1;  ///< If ≥ 0, D is the identity in the columns from here on, and zero elsewhere.
};

}  // namespace detail

/// Rotations that depend on N variables; see detail::DualGroup.
template <int N>
class BasicSO3<Dual<N>> : public detail::DualGroup<BasicSO3<Dual<N>>, SO3, BasicSO3<Dual<N, true>>, N> {
  using Base = detail::DualGroup<BasicSO3, SO3, BasicSO3<Dual<N, true>>, N>;

 public:
  using S = Dual<N>;
  using Plain = BasicSO3<Dual<N, true>>;
  using Quaternion = Eigen::Quaternion<S>;
  template <class Other>
  using Rebind = BasicSO3<Other>;

  BasicSO3() = default;
  explicit BasicSO3(const SO3& constant) : Base(constant) {}
  explicit BasicSO3(const Quaternion& q) : BasicSO3(from_unit(q.normalized())) {}
  explicit BasicSO3(const Matrix<3, 3, S>& R) : BasicSO3(Quaternion(R)) {}
  static BasicSO3 from_unit(const Quaternion& q) {
    const Eigen::Quaterniond value(q.w().a, q.x().a, q.y().a, q.z().a);
    BasicSO3 X(SO3::from_unit(value));
    X.constant_ = false;
    for (int i = 0; i < X.D_.cols(); ++i)
      X.D_.col(i) =
          2.0 * (value.conjugate() * Eigen::Quaterniond(q.w().v[i], q.x().v[i], q.y().v[i], q.z().v[i])).vec();
    return X;
  }
  static BasicSO3 from_derivatives(const SO3& x, const typename Base::Derivatives& D) {
    BasicSO3 X(x);
    X.D_ = D;
    X.constant_ = false;
    return X;
  }

  Quaternion quaternion() const {
    const Eigen::Quaterniond& q = this->x_.quaternion();
    Quaternion dual(S(q.w()), S(q.x()), S(q.y()), S(q.z()));
    if (this->constant_) return dual;
    for (int i = 0; i < this->D_.cols(); ++i) {
      const Vector<3> half = 0.5 * this->D_.col(i);
      const Eigen::Quaterniond dq = q * Eigen::Quaterniond(0.0, half.x(), half.y(), half.z());
      dual.w().v[i] = dq.w(), dual.x().v[i] = dq.x(), dual.y().v[i] = dq.y(), dual.z().v[i] = dq.z();
    }
    return dual;
  }
  /// Returns the matrix R, with the derivative R [D ε]×.
  Matrix<3, 3, S> matrix() const {
    const Matrix<3, 3> R = this->x_.matrix();
    if (this->constant_) return R.template cast<S>();
    Matrix<3, 3, S> dual;
    for (int j = 0; j < 3; ++j) {
      const int k = (j + 1) % 3, l = (j + 2) % 3;
      for (int i = 0; i < 3; ++i)
        dual(i, j) = {R(i, j), (R(i, k) * this->D_.row(l) - R(i, l) * this->D_.row(k)).transpose()};
    }
    return dual;
  }
  Plain plain() const { return Plain::from_unit(quaternion().template cast<Dual<N, true>>()); }
  const typename Base::Derivatives& derivatives() const { return this->D_; }
};

/// Planar poses that depend on N variables; see detail::DualGroup.
template <int N>
class BasicSE2<Dual<N>> : public detail::DualGroup<BasicSE2<Dual<N>>, SE2, BasicSE2<Dual<N, true>>, N> {
  using Base = detail::DualGroup<BasicSE2, SE2, BasicSE2<Dual<N, true>>, N>;

 public:
  using S = Dual<N>;
  using Plain = BasicSE2<Dual<N, true>>;
  using Rotation = BasicSO2<S>;
  template <class Other>
  using Rebind = BasicSE2<Other>;

  BasicSE2() = default;
  explicit BasicSE2(const SE2& constant) : Base(constant) {}
  BasicSE2(const Rotation& R, const Vector<2, S>& t)
      : Base(SE2(SO2::from_unit(R.cos_angle().a, R.sin_angle().a), Base::values(t))) {
    this->constant_ = false;
    const S &c = R.cos_angle(), &s = R.sin_angle();
    this->D_.row(0) = (c.a * t[0].v + s.a * t[1].v).transpose();
    this->D_.row(1) = (c.a * t[1].v - s.a * t[0].v).transpose();
    this->D_.row(2) = (c.a * s.v - s.a * c.v).transpose();
  }

  Rotation rotation() const {
    const double c = this->x_.rotation().cos_angle(), s = this->x_.rotation().sin_angle();
    if (this->constant_) return Rotation::from_unit(c, s);
    const auto turn = this->D_.row(2).transpose();
    return Rotation::from_unit(S(c, -s * turn), S(s, c * turn));
  }
  Vector<2, S> translation() const {
    const Vector<2>& t = this->x_.translation();
    if (this->constant_) return t.template cast<S>();
    const double c = this->x_.rotation().cos_angle(), s = this->x_.rotation().sin_angle();
    return {S(t[0], (c * this->D_.row(0) - s * this->D_.row(1)).transpose()),
            S(t[1], (s * this->D_.row(0) + c * this->D_.row(1)).transpose())};
  }
  Plain plain() const { return Plain(rotation().template cast<Dual<N, true>>(), Base::plain(translation())); }
};

/// Poses and extended poses that depend on N variables; see detail::DualGroup.
template <int K, int N>
class BasicSEK3<K, Dual<N>>
    : public detail::DualGroup<BasicSEK3<K, Dual<N>>, BasicSEK3<K, double>, BasicSEK3<K, Dual<N, true>>, N> {
  using Base = detail::DualGroup<BasicSEK3, BasicSEK3<K, double>, BasicSEK3<K, Dual<N, true>>, N>;

 public:
  using S = Dual<N>;
  using Plain = BasicSEK3<K, Dual<N, true>>;
  using Rotation = BasicSO3<S>;
  using Columns = Matrix<3, K, S>;
  template <class Other>
  using Rebind = BasicSEK3<K, Other>;

  BasicSEK3() = default;
  explicit BasicSEK3(const BasicSEK3<K, double>& constant) : Base(constant) {}
  BasicSEK3(const Rotation& R, const Columns& t) : Base(BasicSEK3<K, double>(R.value(), Base::values(t))) {
    this->constant_ = false;
    const Matrix<3, 3> back = R.value().matrix().transpose();
    for (int k = 0; k < K; ++k)
      for (int i = 0; i < 3; ++i)
        this->D_.row(3 * k + i) =
            (back(i, 0) * t(0, k).v + back(i, 1) * t(1, k).v + back(i, 2) * t(2, k).v).transpose();
    if (R.is_constant())
      this->D_.template bottomRows<3>().setZero();
    else
      this->D_.template bottomRows<3>() = R.derivatives();
  }

  Rotation rotation() const {
    if (this->constant_) return Rotation(this->x_.rotation());
    return Rotation::from_derivatives(this->x_.rotation(), this->D_.template bottomRows<3>());
  }
  Vector<3, S> translation() const { return column(0, this->x_.translation()); }
  Vector<3, S> velocity() const requires(K == 2) { return column(1, this->x_.velocity()); }
  Plain plain() const {
    Matrix<3, K, Dual<N, true>> t;
    const Matrix<3, K> values = this->x_.matrix().template topRightCorner<3, K>();
    for (int k = 0; k < K; ++k) t.col(k) = Base::plain(column(k, values.col(k)));
    return Plain(rotation().plain(), t);
  }

 private:
  /// Returns vector k, with the derivative R D_k ε.
  Vector<3, S> column(int k, const Vector<3>& t) const {
    if (this->constant_) return t.template cast<S>();
    const Matrix<3, 3> R = this->x_.rotation().matrix();
    const auto D = this->D_.template middleRows<3>(3 * k);
    Vector<3, S> dual;
    for (int i = 0; i < 3; ++i)
      dual[i] = {t[i], (R(i, 0) * D.row(0) + R(i, 1) * D.row(1) + R(i, 2) * D.row(2)).transpose()};
    return dual;
  }
};

}  // namespace tandem
