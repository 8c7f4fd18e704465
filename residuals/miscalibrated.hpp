#pragma once

#include <tuple>

#include <tandem/lie/operations.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/residuals/interpolated.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

namespace detail {

/// Moves x by d [m] along the world's axes.
template <LieGroup X, class V>
X moved(const X& x, const V& d) {
  if constexpr (requires { x.rotation(); }) {
    return X(x.rotation(), x.translation() + d);
  } else {
    return X(x.vector() + d);
  }
}
/// What the right perturbation of x is by such a move.
template <LieGroup X>
Matrix<X::dof, X::point_dim, typename X::Scalar> by_move(const X& x) {
  Matrix<X::dof, X::point_dim, typename X::Scalar> P = Matrix<X::dof, X::point_dim, typename X::Scalar>::Zero();
  if constexpr (requires { x.rotation(); }) {
    P.template topRows<X::point_dim>() = x.rotation().inverse().matrix();
  } else {
    P.setIdentity();
  }
  return P;
}

}  // namespace detail

/// A residual f(C, T) = h − z of a sensor on a chaser that observes a target, by a sensor that is not as it was taken to be:
///
///   e = f(C(t − τ) A, T') + b,   A = B M B⁻¹,   T' = T(t − τ) moved by s (t(T F) − t(C B)),   both at t − τ
///
/// It is turned by M on its mount B, a rotation; it sees the target 1 + s times as far away as it is, in the same
/// direction; its measurement is older by τ [s] than t; and z has b too much, in f's rows and units. Motion is at a constant
/// twist from t to another instant, t + dt: X(t − τ) = X ⊕ −τ/dt (X_other ⊖ X), which extrapolates elsewhere.
/// States: C and T at t and at t + dt, then b, s, M, τ. With b = s = τ = 0, M = I it is f.
template <class R>
struct Miscalibrated {
  using Chaser = std::tuple_element_t<0, typename R::States>;
  using Target = std::tuple_element_t<1, typename R::States>;
  using Turn = std::remove_cvref_t<decltype(std::declval<Chaser>().rotation())>;

  static constexpr std::string_view name = R::name;
  static constexpr int dim = R::dim;
  using States = std::tuple<Chaser, Chaser, Target, Target, Rn<dim>, Rn<1>, Turn, Rn<1>>;

  R residual;
  Chaser B{};                                                            ///< sensor in the chaser's body
  Vector<Chaser::point_dim> beacon = Vector<Chaser::point_dim>::Zero();  ///< t(F) [m], in the target's body
  double dt = -1;                                                        ///< s, not 0

  template <Over<Chaser> C, Over<Target> T, Over<Rn<dim>> E, Over<Rn<1>> F, Over<Turn> M>
  void operator()(const C& c, const C& c_other, const T& t, const T& t_other, const E& bias, const F& scale,
                  const M& turn, const F& delay, Rows<dim, C>& r, RowsBy<dim, C>* Jc = nullptr,
                  RowsBy<dim, C>* Jc_other = nullptr, RowsBy<dim, T>* Jt = nullptr, RowsBy<dim, T>* Jt_other = nullptr,
                  RowsBy<dim, E>* Jbias = nullptr, RowsBy<dim, F>* Jscale = nullptr, RowsBy<dim, M>* Jturn = nullptr,
                  RowsBy<dim, F>* Jdelay = nullptr) const {
    using S = typename C::Scalar;
    constexpr int n = Chaser::point_dim;
    const bool wanted = Jc || Jc_other || Jt || Jt_other || Jscale || Jturn || Jdelay;
    const S way = delay.vector()[0] / S(-dt), s = scale.vector()[0];
    typename C::Jacobian c_by_c, c_by_other;
    typename T::Jacobian t_by_t, t_by_other;
    const C then = interpolate(c, c_other, way, wanted ? &c_by_c : nullptr, wanted ? &c_by_other : nullptr);
    const T seen = interpolate(t, t_other, way, wanted ? &t_by_t : nullptr, wanted ? &t_by_other : nullptr);

    const C mount = B.template cast<S>(), turned = mount * C(turn, Vector<n, S>::Zero()) * mount.inverse();
    const Vector<n, S> sensor = mount.translation(), marker = beacon.template cast<S>();
    const Vector<n, S> sight = seen.act(marker) - then.act(sensor);
    const C chaser = then * turned;
    const T target = detail::moved(seen, Vector<n, S>(s * sight));
    if (wanted) {
      RowsBy<dim, C> by_chaser;
      RowsBy<dim, T> by_target;
      residual(chaser, target, r, &by_chaser, &by_target);
      const Matrix<dim, n, S> by_move = by_target * detail::by_move(seen);
      const RowsBy<dim, C> by_then = by_chaser * turned.inverse().Ad() - s * by_move * then.act_jacobian(sensor);
      const RowsBy<dim, T> by_seen = by_target + s * by_move * seen.act_jacobian(marker);
      if (Jc) Jc->noalias() = by_then * c_by_c;
      if (Jc_other) Jc_other->noalias() = by_then * c_by_other;
      if (Jt) Jt->noalias() = by_seen * t_by_t;
      if (Jt_other) Jt_other->noalias() = by_seen * t_by_other;
      if (Jscale) Jscale->noalias() = by_move * sight;
      if (Jturn) Jturn->noalias() = by_chaser * mount.Ad().template rightCols<Turn::dof>();
      if (Jdelay) *Jdelay = (by_then * minus(c_other, c) + by_seen * minus(t_other, t)) / S(-dt);
    } else {
      residual(chaser, target, r);
    }
    r += bias.vector();
    if (Jbias) Jbias->setIdentity();
  }
};

}  // namespace tandem
