#pragma once

#include <tandem/residuals/residual.hpp>

namespace tandem {

/// A state known beforehand [units of the group's tangent]:  e = Log(Z⁻¹ X).
template <LieGroup G>
struct Prior {
  static constexpr std::string_view name = "prior";
  static constexpr int dim = G::dof;
  using States = std::tuple<G>;

  G z;  ///< what is known

  template <Over<G> X>
  void operator()(const X& x, Rows<dim, X>& r, RowsBy<dim, X>* J = nullptr) const {
    r = (z.template cast<typename X::Scalar>().inverse() * x).Log();
    if (J) *J = X::Jr_inverse(r);
  }
};

}  // namespace tandem
