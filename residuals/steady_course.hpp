#pragma once

#include <tandem/lie/operations.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Returns the motion of a target that moves straight ahead at speed s [m/s] for t seconds: Exp(t [s 0 … 0]).
template <LieGroup G>
G steady_course_motion(double t, const typename G::Scalar& s) {
  typename G::Tangent way = G::Tangent::Zero();
  way[0] = t * s;
  return G::Exp(way);
}

/// A residual R of chaser and target (C, T) for a target with constant heading and speed over the whole run:
///   T = T0 Exp(t [s 0 … 0])
/// The states are C, the target's first pose T0 and its speed s [m/s]; t [s] is the time since the first pose.
template <class R>
struct SteadyCourse {
  using Chaser = std::tuple_element_t<0, typename R::States>;
  using Target = std::tuple_element_t<1, typename R::States>;
  using Speed = BasicRn<1, typename Target::Scalar>;
  static constexpr std::string_view name = R::name;
  static constexpr int dim = R::dim;
  using States = std::tuple<Chaser, Target, Speed>;

  R residual;
  double t;  ///< time since the first pose [s]

  auto fields() { return std::tie(residual, t); }

  template <Over<Chaser> C, Over<Target> T, Over<Speed> V>
  void operator()(const C& c, const T& t0, const V& s, Rows<dim, C>& r, RowsBy<dim, C>* Jc = nullptr,
                  RowsBy<dim, T>* J0 = nullptr, RowsBy<dim, V>* Js = nullptr) const {
    const T step = steady_course_motion<T>(t, s.vector()[0]);
    RowsBy<dim, T> Jt;
    residual(c, t0 * step, r, Jc, J0 || Js ? &Jt : nullptr);
    if (J0) J0->noalias() = Jt * step.inverse().Ad();
    if (Js) *Js = t * Jt.template leftCols<1>();  // Jr in the direction of motion is the identity
  }
};
template <class R>
SteadyCourse(const R&, double) -> SteadyCourse<R>;

}  // namespace tandem
