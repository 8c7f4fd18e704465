#pragma once

#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/lie/exp_curvature.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/residual.hpp>
#include <tandem/residuals/residual_functions.hpp>

namespace tandem {

/// Roll and pitch of a body that floats level [rad]: the first two rows of Log(Rᵀ Rz(ψ)), ψ = atan2(R10, R00). The
/// Jacobian includes the dependence on ψ. Throws UndefinedResidualError at pitch ±90°, where the residual is undefined.
/// Source: Baxter & Teran Espinoza 2025, §V-A, eqs. 9-14 (roll-pitch prior of Mode A).
template <LieGroup G = SE3>
requires(G::point_dim == 3 &&
         (Over<G, BasicSO3<typename G::Scalar>> || requires(const G& x) { x.rotation(); })) struct RollPitch {
  static constexpr std::string_view name = "roll-pitch";
  static constexpr int dim = 2;
  using States = std::tuple<G>;

  auto fields() { return std::tie(); }

  template <Over<G> X>
  void operator()(const X& x, Rows<2, X>& r, RowsBy<2, X>* J = nullptr) const {
    using S = typename X::Scalar;
    using Rotation = BasicSO3<S>;
    using std::sqrt;
    const Rotation& rotation = rotation_of(x);
    const Matrix<3, 3, S> R = rotation.matrix();
    const S cos_pitch2 = R(0, 0) * R(0, 0) + R(1, 0) * R(1, 0);
    if (cos_pitch2 < 1e-16)
      throw UndefinedResidualError(
          "roll-pitch: undefined at a pitch of ±90 degrees, where heading is undefined; use another initial guess");
    // Rz(ψ) from half angles: computes the larger of cos(ψ/2) and sin(ψ/2) first, which avoids cancellation.
    const S cos_pitch = sqrt(cos_pitch2), c = R(0, 0) / cos_pitch, s = R(1, 0) / cos_pitch;
    const bool ahead = c > 0.;
    const S larger = sqrt(0.5 * (ahead ? S(1. + c) : S(1. - c))), smaller = 0.5 * s / larger;
    const Rotation level = Rotation::from_unit({ahead ? larger : smaller, S(0.), S(0.), ahead ? smaller : larger});
    const Vector<3, S> e = (rotation.inverse() * level).Log();
    r = e.template head<2>();
    if (J) {
      Matrix<3, 3, S> by_rotation = -Rotation::Jl_inverse(e);
      const Vector<3, S> by_psi = Rotation::Jr_inverse(e).col(2);
      const Vector<3, S> psi_by_rotation(S(0.), R(2, 1) / cos_pitch2, R(2, 2) / cos_pitch2);
      by_rotation += by_psi * psi_by_rotation.transpose();
      J->setZero();
      J->template rightCols<3>() = by_rotation.template topRows<2>();
    }
  }

  /// For a perturbation θ of R and E = Rᵀ Rz(ψ): e = Log(E Exp(a) Exp(b)), a = −Eᵀ θ, b = ẑ (ψ' θ + ½ θᵀ ψ'' θ). The
  /// Hessian is the sum of the contributions of Log, of the product term ½ a × b and of ψ''. For roll φ and pitch p, E
  /// = Rx(−φ) Ry(−p).
  void curvature(const G& x, const Vector<2>& w, Matrix<G::dof, G::dof>& H) const {
    const Matrix<3, 3> R = rotation_of(x).matrix();
    const double cos_pitch = std::hypot(R(0, 0), R(1, 0)), sin_pitch = -R(2, 0);
    const double cos_roll = R(2, 2) / cos_pitch, sin_roll = R(2, 1) / cos_pitch;
    const Vector<3> up(0.0, sin_roll, cos_roll), side(0.0, cos_roll, -sin_roll);  // body axes without pitch
    const SO3 level = SO3::Exp(Vector<3>(0.0, 0.0, std::atan2(R(1, 0), R(0, 0)))), E = rotation_of(x).inverse() * level;
    const Vector<3> e = E.Log();
    const Matrix<3, 3> at_e = SO3::Jr_inverse(e);
    const Vector<3> lambda = at_e.topRows<2>().transpose() * w, slope = up / cos_pitch;  // ψ'

    Matrix<3, 3> by_rotation = -E.inverse().matrix();
    by_rotation.row(2) += slope.transpose();
    const Matrix<3, 3> J = at_e * by_rotation;
    const Vector<3> product = E.act(Vector<3>::UnitZ().cross(lambda));
    Matrix<3, 3> half = (-0.5 * product) * slope.transpose();  // the sum with its transpose enters the Hessian
    half += (lambda[2] / cos_pitch) * side * (0.5 * Vector<3>::UnitX() + (sin_pitch / cos_pitch) * up).transpose();
    H.setZero();
    H.template bottomRightCorner<3, 3>() =
        half + half.transpose() - J.transpose() * ExpCurvature<SO3>::hessian(e, lambda) * J;
  }

 private:
  template <class S>
  static const BasicSO3<S>& rotation_of(const BasicSO3<S>& R) {
    return R;
  }
  template <int K, class S>
  static decltype(auto) rotation_of(const BasicSEK3<K, S>& X) {
    return X.rotation();
  }
};

// Instantiated in roll_pitch.cpp.
namespace detail {
extern template struct FunctionsOf<RollPitch<SE3>>;
}  // namespace detail

}  // namespace tandem
