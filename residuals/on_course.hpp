#pragma once

#include <tandem/lie/operations.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// How a target on a steady course moves in t seconds at a speed of s: Exp(t [s 0 … 0]), straight ahead.
template <LieGroup G>
G way_on_course(double t, const typename G::Scalar& s) {
  typename G::Tangent way = G::Tangent::Zero();
  way[0] = t * s;
  return G::Exp(way);
}

/// A residual of chaser and target when the target keeps one heading and one speed over a whole run: R over (C, T) at
///   T = T0 Exp(t [s 0 … 0])
/// reads the target's first pose T0 and its speed s [m/s] instead, t [s] after the first.
template <class R>
struct OnCourse {
  using Chaser = std::tuple_element_t<0, typename R::States>;
  using Target = std::tuple_element_t<1, typename R::States>;
  using Speed = BasicRn<1, typename Target::Scalar>;
  static constexpr std::string_view name = R::name;
  static constexpr int dim = R::dim;
  using States = std::tuple<Chaser, Target, Speed>;

  R residual;
  double t;  ///< s

  template <Over<Chaser> C, Over<Target> T, Over<Speed> V>
  void operator()(const C& c, const T& t0, const V& s, Rows<dim, C>& r, RowsBy<dim, C>* Jc = nullptr,
                  RowsBy<dim, T>* J0 = nullptr, RowsBy<dim, V>* Js = nullptr) const {
    const T step = way_on_course<T>(t, s.vector()[0]);
    RowsBy<dim, T> Jt;
    residual(c, t0 * step, r, Jc, J0 || Js ? &Jt : nullptr);
    if (J0) J0->noalias() = Jt * step.inverse().Ad();
    if (Js) *Js = t * Jt.template leftCols<1>();  // Jr along the way is the identity
  }
};
template <class R>
OnCourse(const R&, double) -> OnCourse<R>;

}  // namespace tandem
