#pragma once

#include <tandem/residuals/relative_pose.hpp>

namespace tandem {

/// Measured rotation of one body's frame in another's [rad]:  e = Log(Z⁻¹ (R_x B)⁻¹ (R_y F)), where R are the rotations
/// of the poses. It is the orientation part of RelativePose, for a noise or a robust loss separate from that of the
/// position.
template <LieGroup G = SE3>
requires requires { typename G::Rotation; }
struct RelativeRotation {
  using Rotation = typename G::Rotation;

  static constexpr std::string_view name = "relative rotation";
  static constexpr int dim = Rotation::dof;
  using States = std::tuple<G, G>;

  Rotation z;    ///< rotation of the frame R_y F in the frame R_x B
  Rotation B{};  ///< sensor in the body x
  Rotation F{};  ///< marker in the body y

  auto fields() { return std::tie(z, B, F); }

  template <Over<G> X>
  void operator()(const X& x, const X& y, Rows<dim, X>& r, RowsBy<dim, X>* Jx = nullptr,
                  RowsBy<dim, X>* Jy = nullptr) const {
    typename X::Rotation::Jacobian by_x, by_y;
    RelativePose<Rotation>{z, B, F}(x.rotation(), y.rotation(), r, Jx ? &by_x : nullptr, Jy ? &by_y : nullptr);
    if (Jx) *Jx << Matrix<dim, X::dof - dim, typename X::Scalar>::Zero(), by_x;
    if (Jy) *Jy << Matrix<dim, X::dof - dim, typename X::Scalar>::Zero(), by_y;
  }

  void curvature(const G& x, const G& y, const Vector<dim>& w,
                 Matrix<2 * G::dof, 2 * G::dof>& H) const requires HasExpCurvature<Rotation> {
    Matrix<2 * dim, 2 * dim> of_rotations;
    RelativePose<Rotation>{z, B, F}.curvature(x.rotation(), y.rotation(), w, of_rotations);
    H.setZero();
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j)
        H.template block<dim, dim>((i + 1) * G::dof - dim, (j + 1) * G::dof - dim) =
            of_rotations.template block<dim, dim>(i * dim, j * dim);
  }
};

}  // namespace tandem
