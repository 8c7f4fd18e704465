#pragma once

#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Orientation measured by a compass or an attitude sensor on the body [rad]:  e = Log((R_z R_bs⁻¹)⁻¹ R). The error is
/// along the body axes. Assign large standard deviations to the axes that the sensor does not measure. Source: Groves
/// 2013, §6.1, with the error on SO(3) as in Solà et al. 2018.
struct Heading {
  static constexpr std::string_view name = "heading";
  static constexpr int dim = 3;
  using States = std::tuple<SE3>;

  SO3 measured;  ///< R_z, sensor in the world
  SO3 mount{};   ///< R_bs, sensor in the body

  auto fields() { return std::tie(measured, mount); }

  template <Over<SE3> X>
  void operator()(const X& x, Rows<3, X>& r, RowsBy<3, X>* J = nullptr) const {
    using S = typename X::Scalar;
    using Rotation = BasicSO3<S>;
    r = ((mount * measured.inverse()).template cast<S>() * x.rotation()).Log();
    if (J) *J << Matrix<3, 3, S>::Zero(), Rotation::Jr_inverse(r);
  }
};

}  // namespace tandem
