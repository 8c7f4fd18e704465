#pragma once

#include <tuple>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/residuals/motion_about.hpp>
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

/// What becomes of chaser and target before such a sensor (see Miscalibrated) reads them, whatever it measures.
template <LieGroup C, LieGroup T, LieGroup M>
struct Displaced {
  using S = typename C::Scalar;

  MotionAbout<C> then;  ///< C(t − τ)
  MotionAbout<T> seen;  ///< T(t − τ)
  C chaser;             ///< C(t − τ) A
  T target;             ///< T'

  /// Derivatives of these two, where they are wanted.
  typename C::Jacobian chaser_by_then;
  typename T::Jacobian target_by_seen;
  Matrix<T::dof, C::dof, S> target_by_then;
  Matrix<C::dof, M::dof, S> chaser_by_turn;
  Vector<T::dof, S> target_by_scale;

  Displaced(const typename C::template Rebind<double>& B, const Vector<C::point_dim>& beacon, const Neighbours& apart,
            const C& c, const C& c_before, const C& c_after, const T& t, const T& t_before, const T& t_after,
            const S& s, const M& turn, const S& delay, bool wanted);
};
template <LieGroup C, LieGroup T, LieGroup M>
Displaced<C, T, M>::Displaced(const typename C::template Rebind<double>& B, const Vector<C::point_dim>& beacon,
                              const Neighbours& apart, const C& c, const C& c_before, const C& c_after, const T& t,
                              const T& t_before, const T& t_after, const S& s, const M& turn, const S& delay,
                              bool wanted)
    : then(apart, c, c_before, c_after, -delay, wanted), seen(apart, t, t_before, t_after, -delay, wanted) {
  constexpr int n = C::point_dim;
  const C mount = B.template cast<S>(), turned = mount * C(turn, Vector<n, S>::Zero()) * mount.inverse();
  const Vector<n, S> sensor = mount.translation(), marker = beacon.template cast<S>();
  const Vector<n, S> sight = seen.at.act(marker) - then.at.act(sensor);
  chaser = then.at * turned;
  target = moved(seen.at, Vector<n, S>(s * sight));
  if (!wanted) return;
  const Matrix<T::dof, n, S> move = by_move(seen.at);
  chaser_by_then = turned.inverse().Ad();
  target_by_then = -s * move * then.at.act_jacobian(sensor);
  target_by_seen = T::Jacobian::Identity() + s * move * seen.at.act_jacobian(marker);
  target_by_scale = move * sight;
  chaser_by_turn = mount.Ad().template rightCols<M::dof>();
}
// Compiled once, in miscalibrated.cpp.
extern template struct MotionAbout<SE3>;
extern template struct MotionAbout<SE2>;
extern template struct MotionAbout<R3>;
extern template struct MotionAbout<Rn<2>>;
extern template struct Displaced<SE3, SE3, SO3>;
extern template struct Displaced<SE3, R3, SO3>;
extern template struct Displaced<SE2, SE2, SO2>;
extern template struct Displaced<SE2, Rn<2>, SO2>;

}  // namespace detail

/// A residual f(C, T) = h − z of a sensor on a chaser that observes a target, by a sensor that is not as it was taken to be:
///
///   e = f(C(t − τ) A, T') + b,   A = B M B⁻¹,   T' = T(t − τ) moved by s (t(T F) − t(C B)),   both at t − τ
///
/// It is turned by M on its mount B, a rotation; it sees the target 1 + s times as far away as it is, in the same
/// direction; its measurement is older by τ [s] than t; and z has b too much, in f's rows and units. How both move about t
/// is told by keyframes before and after (MotionAbout); so it may have been measured some seconds later than t. States: C and
/// T at t, before and after, then b, s, M, τ. With b = s = τ = 0, M = I it is f.
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
  Neighbours apart{};
  double later = 0;  ///< s, than the states at t

  template <Over<Chaser> C, Over<Target> T, Over<Rn<dim>> E, Over<Rn<1>> F, Over<Turn> M>
  void operator()(const C& c, const C& c_before, const C& c_after, const T& t, const T& t_before, const T& t_after,
                  const E& bias, const F& scale, const M& turn, const F& delay, Rows<dim, C>& r,
                  RowsBy<dim, C>* Jc = nullptr, RowsBy<dim, C>* Jc_before = nullptr, RowsBy<dim, C>* Jc_after = nullptr,
                  RowsBy<dim, T>* Jt = nullptr, RowsBy<dim, T>* Jt_before = nullptr, RowsBy<dim, T>* Jt_after = nullptr,
                  RowsBy<dim, E>* Jbias = nullptr, RowsBy<dim, F>* Jscale = nullptr, RowsBy<dim, M>* Jturn = nullptr,
                  RowsBy<dim, F>* Jdelay = nullptr) const {
    const bool wanted = Jc || Jc_before || Jc_after || Jt || Jt_before || Jt_after || Jscale || Jturn || Jdelay;
    const detail::Displaced<C, T, M> at(B, beacon, apart, c, c_before, c_after, t, t_before, t_after, scale.vector()[0],
                                        turn, delay.vector()[0] - typename C::Scalar(later), wanted);
    if (wanted) {
      RowsBy<dim, C> by_chaser;
      RowsBy<dim, T> by_target;
      residual(at.chaser, at.target, r, &by_chaser, &by_target);
      const RowsBy<dim, C> by_then = by_chaser * at.chaser_by_then + by_target * at.target_by_then;
      const RowsBy<dim, T> by_seen = by_target * at.target_by_seen;
      set(by_then, at.then, Jc, Jc_before, Jc_after);
      set(by_seen, at.seen, Jt, Jt_before, Jt_after);
      if (Jscale) Jscale->noalias() = by_target * at.target_by_scale;
      if (Jturn) Jturn->noalias() = by_chaser * at.chaser_by_turn;
      if (Jdelay) *Jdelay = -(by_then * at.then.by_time + by_seen * at.seen.by_time);
    } else {
      residual(at.chaser, at.target, r);
    }
    r += bias.vector();
    if (Jbias) Jbias->setIdentity();
  }

 private:
  /// The Jacobians by a state and its neighbours, from that by where it was.
  template <class J, LieGroup X>
  void set(const J& by, const detail::MotionAbout<X>& motion, J* here, J* before, J* after) const {
    if (here) here->noalias() = by * motion.by_here;
    if (before) apart.before != 0 ? void(before->noalias() = by * motion.by_before) : void(before->setZero());
    if (after) apart.after != 0 ? void(after->noalias() = by * motion.by_after) : void(after->setZero());
  }
};

}  // namespace tandem
