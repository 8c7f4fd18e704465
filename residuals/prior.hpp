#pragma once

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/log_curvature.hpp>
#include <tandem/residuals/residual.hpp>
#include <tandem/residuals/residual_functions.hpp>

namespace tandem {

/// Prior on a state [units of the group's tangent]:  e = Log(Z⁻¹ X).
template <LieGroup G>
struct Prior {
  static constexpr std::string_view name = "prior";
  static constexpr int dim = G::dof;
  static constexpr bool linear = is_vector_space<G>;
  using States = std::tuple<G>;

  G z;  ///< prior mean

  auto fields() { return std::tie(z); }

  template <Over<G> X>
  void operator()(const X& x, Rows<dim, X>& r, RowsBy<dim, X>* J = nullptr) const {
    r = (z.template cast<typename X::Scalar>().inverse() * x).Log();
    if (J) *J = X::Jr_inverse(r);
  }

  void curvature(const G& x, const Vector<dim>& w, Matrix<G::dof, G::dof>& H) const requires HasExpCurvature<G> {
    const typename G::Tangent e = (z.inverse() * x).Log();
    const typename G::Jacobian J = G::Jr_inverse(e);
    H = detail::LogCurvature<G>(e, J.transpose() * w)(J, J);
  }
};

// Instantiated in prior.cpp.
namespace detail {
extern template struct FunctionsOf<Prior<SE3>>;
extern template struct FunctionsOf<Prior<SE2>>;
extern template struct FunctionsOf<Prior<SO3>>;
extern template struct FunctionsOf<Prior<SO2>>;
extern template struct FunctionsOf<Prior<Rn<1>>>;
extern template struct FunctionsOf<Prior<Rn<2>>>;
extern template struct FunctionsOf<Prior<Rn<3>>>;
extern template struct FunctionsOf<Prior<Rn<6>>>;
}  // namespace detail

}  // namespace tandem
