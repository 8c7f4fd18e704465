#pragma once

#include <tandem/lie/operations.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

// Instantiated in interpolated.cpp.
extern template SE3 interpolate(const SE3&, const SE3&, const double&, SE3::Jacobian*, SE3::Jacobian*);
extern template SE2 interpolate(const SE2&, const SE2&, const double&, SE2::Jacobian*, SE2::Jacobian*);
extern template R3 interpolate(const R3&, const R3&, const double&, R3::Jacobian*, R3::Jacobian*);
extern template Rn<2> interpolate(const Rn<2>&, const Rn<2>&, const double&, Rn<2>::Jacobian*, Rn<2>::Jacobian*);

/// A residual R of chaser and target at an instant between the keyframes 0 and 1, for example because of sensor
/// latency. R is evaluated at
///
///   C = C0 ⊕ s (C1 ⊖ C0),  T = T0 ⊕ s (T1 ⊖ T0)
///
/// that is, with a constant twist between the keyframes. Values of s outside [0, 1] extrapolate. States: C0, C1, T0,
/// T1.
template <class R>
requires(std::tuple_size_v<typename R::States> == 2) struct Interpolated {
  using Chaser = std::tuple_element_t<0, typename R::States>;
  using Target = std::tuple_element_t<1, typename R::States>;

  static constexpr std::string_view name = R::name;
  static constexpr int dim = R::dim;
  using States = std::tuple<Chaser, Chaser, Target, Target>;

  R residual;
  double s;  ///< (t − t0) / (t1 − t0)

  auto fields() { return std::tie(residual, s); }

  template <Over<Chaser> C, Over<Target> T>
  void operator()(const C& c0, const C& c1, const T& t0, const T& t1, Rows<dim, C>& r, RowsBy<dim, C>* Jc0 = nullptr,
                  RowsBy<dim, C>* Jc1 = nullptr, RowsBy<dim, T>* Jt0 = nullptr, RowsBy<dim, T>* Jt1 = nullptr) const {
    typename C::Jacobian c_by_0, c_by_1;
    typename T::Jacobian t_by_0, t_by_1;
    RowsBy<dim, C> by_c;
    RowsBy<dim, T> by_t;
    const C c = interpolate(c0, c1, typename C::Scalar(s), Jc0 ? &c_by_0 : nullptr, Jc1 ? &c_by_1 : nullptr);
    const T t = interpolate(t0, t1, typename T::Scalar(s), Jt0 ? &t_by_0 : nullptr, Jt1 ? &t_by_1 : nullptr);
    if (Jc0 || Jc1 || Jt0 || Jt1)
      residual(c, t, r, Jc0 || Jc1 ? &by_c : nullptr, Jt0 || Jt1 ? &by_t : nullptr);
    else
      residual(c, t, r);
    if (Jc0) Jc0->noalias() = by_c * c_by_0;
    if (Jc1) Jc1->noalias() = by_c * c_by_1;
    if (Jt0) Jt0->noalias() = by_t * t_by_0;
    if (Jt1) Jt1->noalias() = by_t * t_by_1;
  }
};
template <class R>
Interpolated(const R&, double) -> Interpolated<R>;

}  // namespace tandem
