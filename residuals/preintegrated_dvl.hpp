#pragma once

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Displacement between two keyframes, along the body axes at the first one [m]:  e = t(X0⁻¹ X1) − Δp̃. The measurement
/// Δp̃ = Σ ΔR̃ v dt integrates the velocities of a Doppler velocity log with the rotation of a gyroscope (see
/// DvlPreintegrator). The rotation increments are those of Forster et al. 2017.
struct PreintegratedDvl {
  static constexpr std::string_view name = "preintegrated DVL";
  static constexpr int dim = 3;
  using States = std::tuple<SE3, SE3>;

  Vector<3> displacement;  ///< m, along the body axes at X0

  auto fields() { return std::tie(displacement); }

  template <Over<SE3> X>
  void operator()(const X& x0, const X& x1, Rows<3, X>& r, RowsBy<3, X>* J0 = nullptr,
                  RowsBy<3, X>* J1 = nullptr) const {
    using S = typename X::Scalar;
    const X between = x0.inverse() * x1;
    const Vector<3, S> way = between.translation();
    r = way - displacement.template cast<S>();
    if (J0) *J0 << -Matrix<3, 3, S>::Identity(), skew(way);
    if (J1) *J1 << between.rotation().matrix(), Matrix<3, 3, S>::Zero();
  }
};

}  // namespace tandem
