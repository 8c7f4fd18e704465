#pragma once

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Measured world position of an antenna on the body [m]:  e = p + R l − z. Source: Groves 2013, §14.3 (loosely coupled
/// position with a lever arm).
struct Gps {
  static constexpr std::string_view name = "GPS";
  static constexpr int dim = 3;
  using States = std::tuple<SE3>;

  Vector<3> position;                   ///< m, in the world
  Vector<3> lever = Vector<3>::Zero();  ///< antenna in the body [m]

  auto fields() { return std::tie(position, lever); }

  template <Over<SE3> X>
  void operator()(const X& x, Rows<3, X>& r, RowsBy<3, X>* J = nullptr) const {
    using S = typename X::Scalar;
    const Vector<3, S> l = lever.template cast<S>();
    r = x.act(l) - position.template cast<S>();
    if (J) *J = x.act_jacobian(l);
  }
};

}  // namespace tandem
