#pragma once

#include <array>
#include <bit>

#include <tandem/lie/operations.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/log_curvature.hpp>
#include <tandem/residuals/residual.hpp>
#include <tandem/residuals/residual_functions.hpp>

namespace tandem {

/// Components of a body twist ξ = [ν; ω]; combine them with |.
enum class TwistAxes : unsigned { surge = 1, sway = 2, heave = 4, roll_rate = 8, pitch_rate = 16, yaw_rate = 32 };
constexpr TwistAxes operator|(TwistAxes a, TwistAxes b) {
  return static_cast<TwistAxes>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}
inline constexpr TwistAxes surge = TwistAxes::surge, sway = TwistAxes::sway, heave = TwistAxes::heave,
                           roll_rate = TwistAxes::roll_rate, pitch_rate = TwistAxes::pitch_rate,
                           yaw_rate = TwistAxes::yaw_rate;

/// Selected components of the mean body twist between two poses [m/s, rad/s]: rows of Log(X0⁻¹ X1)/dt. `sway | heave`
/// equal to zero is the non-holonomic constraint; bounds on surge and yaw rate are limits. The axes are part of the
/// type, because they determine the dimension: TwistComponents<SE3, sway | heave>{dt}.
template <LieGroup G, TwistAxes axes>
struct TwistComponents {
  static constexpr std::string_view name = "twist components";
  static constexpr int dim = std::popcount(static_cast<unsigned>(axes));
  using States = std::tuple<G, G>;

  double dt;  ///< t1 − t0 [s], > 0

  auto fields() { return std::tie(dt); }

  template <Over<G> X>
  void operator()(const X& x0, const X& x1, Rows<dim, X>& r, RowsBy<dim, X>* J0 = nullptr,
                  RowsBy<dim, X>* J1 = nullptr) const {
    const double per_second = 1.0 / dt;
    const typename X::Tangent d = (x0.inverse() * x1).Log();
    for (int i = 0; i < dim; ++i) r[i] = per_second * d[rows[i]];
    if (!J0 && !J1) return;
    const InverseJacobians<X> at_d(d);
    if (J0)
      for (int i = 0; i < dim; ++i) J0->row(i) = -per_second * at_d.left.row(rows[i]);
    if (J1)
      for (int i = 0; i < dim; ++i) J1->row(i) = per_second * at_d.right.row(rows[i]);
  }

  void curvature(const G& x0, const G& x1, const Vector<dim>& w,
                 Matrix<2 * G::dof, 2 * G::dof>& H) const requires HasExpCurvature<G> {
    typename G::Tangent all = G::Tangent::Zero();
    for (int i = 0; i < dim; ++i) all[rows[i]] = w[i] / dt;
    const G E = x0.inverse() * x1;
    const typename G::Tangent d = E.Log();
    const InverseJacobians<G> at_d(d);
    const typename G::Tangent gradient = at_d.right.transpose() * all;
    detail::curvature_of_between<G>(E, d, gradient, gradient, -at_d.left, at_d.right, H);
  }

 private:
  /// Rows of the group's tangent for the selected axes.
  static constexpr std::array<int, dim> rows = [] {
    constexpr bool planar = Over<G, BasicSE2<typename G::Scalar>>;
    constexpr bool spatial = Over<G, BasicSE3<typename G::Scalar>>;
    static_assert(planar || spatial, "TwistComponents supports SE2 and SE3 only");
    constexpr unsigned all = planar ? 0b100011u : 0b111111u;
    static_assert((static_cast<unsigned>(axes) & ~all) == 0, "SE2 has surge, sway and yaw rate only");
    std::array<int, dim> chosen{};
    int n = 0;
    for (int axis = 0; axis < 6; ++axis)
      if (static_cast<unsigned>(axes) >> axis & 1u) chosen[n++] = planar && axis == 5 ? 2 : axis;
    return chosen;
  }();
};

// Instantiated in twist_components.cpp.
namespace detail {
extern template struct FunctionsOf<TwistComponents<SE3, sway | heave>>;
}  // namespace detail

}  // namespace tandem
