#pragma once

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Measured world height of a sensor on the body [m], negative below the surface:  e = (p + R l)·e_z − z. For a
/// pressure sensor, z is minus the depth. Source: Groves 2013, Principles of GNSS, Inertial, and Multisensor Integrated
/// Navigation Systems, §6.2, with a lever arm.
struct Depth {
  static constexpr std::string_view name = "depth";
  static constexpr int dim = 1;
  using States = std::tuple<SE3>;

  double z;                             ///< m, upwards
  Vector<3> lever = Vector<3>::Zero();  ///< sensor in the body [m]

  auto fields() { return std::tie(z, lever); }

  Vector<1> reading() const { return Vector<1>(z); }

  template <Over<SE3> X>
  void operator()(const X& x, Rows<1, X>& r, RowsBy<1, X>* J = nullptr) const {
    using S = typename X::Scalar;
    const Vector<3, S> l = lever.template cast<S>();
    r[0] = x.act(l).z() - S(z);
    if (J) *J = x.act_jacobian(l).template bottomRows<1>();
  }
};

}  // namespace tandem
