#pragma once

#include <tuple>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/residuals/parabolic_motion.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

namespace detail {

/// Returns x translated by d [m] along the world axes.
template <LieGroup X, class V>
X moved(const X& x, const V& d) {
  if constexpr (requires { x.rotation(); }) {
    return X(x.rotation(), x.translation() + d);
  } else {
    return X(x.vector() + d);
  }
}
/// Returns the derivative of the right perturbation of x with respect to d.
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

/// Chaser and target as a miscalibrated sensor sees them (see Miscalibrated), for any measurement.
template <LieGroup C, LieGroup T, LieGroup M>
struct ApparentStates {
  using S = typename C::Scalar;

  ParabolicMotion<C> chaser_then;  ///< C(t − τ)
  ParabolicMotion<T> target_then;  ///< T(t − τ)
  C chaser;                        ///< C(t − τ) A
  T target;                        ///< T'

  /// Derivatives of `chaser` and `target`, set if `wanted`.
  typename C::Jacobian chaser_by_chaser_then;
  typename T::Jacobian target_by_target_then;
  Matrix<T::dof, C::dof, S> target_by_chaser_then;
  Matrix<C::dof, M::dof, S> chaser_by_turn;
  Vector<T::dof, S> target_by_scale;

  ApparentStates(const typename C::template Rebind<double>& B, const Vector<C::point_dim>& beacon,
                 const NeighbourGaps& gaps, const C& c, const C& c_before, const C& c_after, const T& t,
                 const T& t_before, const T& t_after, const S& s, const M& turn, const S& delay, bool wanted);
};
template <LieGroup C, LieGroup T, LieGroup M>
ApparentStates<C, T, M>::ApparentStates(const typename C::template Rebind<double>& B,
                                        const Vector<C::point_dim>& beacon, const NeighbourGaps& gaps, const C& c,
                                        const C& c_before, const C& c_after, const T& t, const T& t_before,
                                        const T& t_after, const S& s, const M& turn, const S& delay, bool wanted)
    : chaser_then(gaps, c, c_before, c_after, -delay, wanted), target_then(gaps, t, t_before, t_after, -delay, wanted) {
  constexpr int n = C::point_dim;
  const C mount = B.template cast<S>(), turned = mount * C(turn, Vector<n, S>::Zero()) * mount.inverse();
  const Vector<n, S> sensor = mount.translation(), marker = beacon.template cast<S>();
  const Vector<n, S> sight = target_then.at.act(marker) - chaser_then.at.act(sensor);
  chaser = chaser_then.at * turned;
  target = moved(target_then.at, Vector<n, S>(s * sight));
  if (!wanted) return;
  const Matrix<T::dof, n, S> move = by_move(target_then.at);
  chaser_by_chaser_then = turned.inverse().Ad();
  target_by_chaser_then = -s * move * chaser_then.at.act_jacobian(sensor);
  target_by_target_then = T::Jacobian::Identity() + s * move * target_then.at.act_jacobian(marker);
  target_by_scale = move * sight;
  chaser_by_turn = mount.Ad().template rightCols<M::dof>();
}
// Instantiated in miscalibrated.cpp.
extern template struct ParabolicMotion<SE3>;
extern template struct ParabolicMotion<SE2>;
extern template struct ParabolicMotion<R3>;
extern template struct ParabolicMotion<Rn<2>>;
extern template struct ApparentStates<SE3, SE3, SO3>;
extern template struct ApparentStates<SE3, R3, SO3>;
extern template struct ApparentStates<SE2, SE2, SO2>;
extern template struct ApparentStates<SE2, Rn<2>, SO2>;

}  // namespace detail

/// A residual f(C, T) = h − z of a target sensor on the chaser, with calibration errors as states:
///
///   e = f(C(t − τ) A, T') + b,   A = B M B⁻¹,   T' = T(t − τ) translated by s (t(T F) − t(C B)), both at t − τ
///
/// The bias b has the rows and units of f. The scale factor error s stretches the distance to the target. The
/// misalignment M is a rotation on the mount B, and τ is the age of the measurement at the time t [s]. ParabolicMotion
/// interpolates the states around t from the keyframes before and after. The measurement may also be some seconds later
/// than t (`time_since_states`). States: C and T, each at t, before and after; then b, s, M, τ. With b = s = τ = 0 and
/// M = I it equals f.
template <class R>
struct Miscalibrated {
  using Chaser = std::tuple_element_t<0, typename R::States>;
  using Target = std::tuple_element_t<1, typename R::States>;
  using Turn = std::remove_cvref_t<decltype(std::declval<Chaser>().rotation())>;

  static constexpr std::string_view name = R::name;
  static constexpr int dim = R::dim;
  using States = std::tuple<Chaser, Chaser, Chaser, Target, Target, Target, Rn<dim>, Rn<1>, Turn, Rn<1>>;

  R residual;
  Chaser B{};                                                            ///< sensor in the chaser's body
  Vector<Chaser::point_dim> beacon = Vector<Chaser::point_dim>::Zero();  ///< t(F) [m], in the target's body
  NeighbourGaps gaps{};
  double time_since_states = 0;  ///< time from t to the measurement [s]

  auto fields() { return std::tie(residual, B, beacon, gaps, time_since_states); }

  template <Over<Chaser> C, Over<Target> T, Over<Rn<dim>> E, Over<Rn<1>> F, Over<Turn> M>
  void operator()(const C& c, const C& c_before, const C& c_after, const T& t, const T& t_before, const T& t_after,
                  const E& bias, const F& scale, const M& turn, const F& delay, Rows<dim, C>& r,
                  RowsBy<dim, C>* Jc = nullptr, RowsBy<dim, C>* Jc_before = nullptr, RowsBy<dim, C>* Jc_after = nullptr,
                  RowsBy<dim, T>* Jt = nullptr, RowsBy<dim, T>* Jt_before = nullptr, RowsBy<dim, T>* Jt_after = nullptr,
                  RowsBy<dim, E>* Jbias = nullptr, RowsBy<dim, F>* Jscale = nullptr, RowsBy<dim, M>* Jturn = nullptr,
                  RowsBy<dim, F>* Jdelay = nullptr) const {
    const bool wanted = Jc || Jc_before || Jc_after || Jt || Jt_before || Jt_after || Jscale || Jturn || Jdelay;
    const detail::ApparentStates<C, T, M> at(B, beacon, gaps, c, c_before, c_after, t, t_before, t_after,
                                             scale.vector()[0], turn,
                                             delay.vector()[0] - typename C::Scalar(time_since_states), wanted);
    if (wanted) {
      RowsBy<dim, C> by_chaser;
      RowsBy<dim, T> by_target;
      residual(at.chaser, at.target, r, &by_chaser, &by_target);
      const RowsBy<dim, C> by_chaser_then = by_chaser * at.chaser_by_chaser_then + by_target * at.target_by_chaser_then;
      const RowsBy<dim, T> by_target_then = by_target * at.target_by_target_then;
      set(by_chaser_then, at.chaser_then, Jc, Jc_before, Jc_after);
      set(by_target_then, at.target_then, Jt, Jt_before, Jt_after);
      if (Jscale) Jscale->noalias() = by_target * at.target_by_scale;
      if (Jturn) Jturn->noalias() = by_chaser * at.chaser_by_turn;
      if (Jdelay) *Jdelay = -(by_chaser_then * at.chaser_then.by_time + by_target_then * at.target_then.by_time);
    } else {
      residual(at.chaser, at.target, r);
    }
    r += bias.vector();
    if (Jbias) Jbias->setIdentity();
  }

 private:
  /// Sets the Jacobians with respect to a state and its neighbours from the Jacobian `by` with respect to the
  /// interpolated state.
  template <class J, LieGroup X>
  void set(const J& by, const detail::ParabolicMotion<X>& motion, J* here, J* before, J* after) const {
    if (here) here->noalias() = by * motion.by_here;
    if (before) gaps.before != 0 ? void(before->noalias() = by * motion.by_before) : void(before->setZero());
    if (after) gaps.after != 0 ? void(after->noalias() = by * motion.by_after) : void(after->setZero());
  }
};

}  // namespace tandem
