#pragma once

#include <tandem/lie/operations.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/carried_twist_curvature.hpp>
#include <tandem/residuals/ornstein_uhlenbeck.hpp>
#include <tandem/residuals/residual.hpp>
#include <tandem/residuals/residual_functions.hpp>

namespace tandem {

/// Body-frame twist over three consecutive states; each component decays to a mean μ with its own time constant τ
/// [units of the group's tangent, e.g. m and rad]:
///
///   δ1 = T1 ⊖ T0,  δ2 = dt2 (μ + φ (δ1/dt1 − μ)),  e = T2 ⊖ (T1 ⊕ δ2),   φ = exp(−h/τ),  h = (dt1 + dt2)/2
///
/// The mean twist over an interval approximates the twist at its middle. Its deviation u = ϖ − μ is an
/// Ornstein–Uhlenbeck process, observed again h seconds later. This process gives the decay φ and the noise
///
///   Var e = dt2² σ² τ/2 (1 − exp(−2h/τ)),   σ: root spectral density of the twist noise [m s^-3/2, rad s^-3/2]
///
/// For τ = ∞ the residual is ConstantTwist; the noise equals its dt2 Σ̄ if states are 1 s apart. At shorter intervals
/// this twist changes less between states, whereas the noise of ConstantTwist allows larger changes.
///
/// Given only the mean over the first interval, the mean over the second has for τ = ∞ the variance σ² (dt1 + dt2)/3.
/// The noises of neighbouring triples are then correlated by 1/4, which independent residuals ignore. This noise covers
/// the time from middle to middle of the intervals, so the noises of a chain add up to that of the process.
template <LieGroup G>
struct DampedTwist {
  static constexpr std::string_view name = "damped twist";
  static constexpr int dim = G::dof;
  using States = std::tuple<G, G, G>;

  double dt1, dt2;       ///< t1 − t0 and t2 − t1 [s], both > 0
  Vector<G::dof> decay;  ///< φ of each component, in [0, 1]
  Vector<G::dof> mean;   ///< μ [units of the tangent per s]

  auto fields() { return std::tie(dt1, dt2, decay, mean); }

  /// Constructs the residual from time constants τ [s], > 0, possibly infinite.
  static DampedTwist over(double dt1, double dt2, const Vector<G::dof>& time_constants,
                          const Vector<G::dof>& mean = Vector<G::dof>::Zero()) {
    const double h = 0.5 * (dt1 + dt2);
    return {dt1, dt2, time_constants.unaryExpr([h](double tau) { return OrnsteinUhlenbeck{tau}.decay(h); }), mean};
  }

  /// Returns √Var e of each component for σ = 1. The noise is Gaussian(sigmas).scaled(noise_scale(…)).
  static Vector<G::dof> noise_scale(double dt1, double dt2, const Vector<G::dof>& time_constants) {
    const double h = 0.5 * (dt1 + dt2);
    return time_constants.unaryExpr(
        [=](double tau) { return dt2 * std::sqrt(OrnsteinUhlenbeck{tau}.unit_variance(h)); });
  }

  template <Over<G> X>
  void operator()(const X& t0, const X& t1, const X& t2, Rows<dim, X>& r, RowsBy<dim, X>* J0 = nullptr,
                  RowsBy<dim, X>* J1 = nullptr, RowsBy<dim, X>* J2 = nullptr) const {
    using S = typename X::Scalar;
    using Diagonal = Vector<G::dof, S>;
    const Diagonal gain = this->gain().template cast<S>(), drift = this->drift().template cast<S>();
    const typename X::Tangent d1 = (t0.inverse() * t1).Log(), d2 = gain.cwiseProduct(d1) + drift;
    const X back = X::Exp(-d2);
    r = (back * t1.inverse() * t2).Log();
    if (!J0 && !J1 && !J2) return;
    const InverseJacobians<X> at_r(r);
    if (J0 || J1) {  // chain rule through T̂2 = T1 ⊕ δ2; ∂e/∂T̂2 = −Jl⁻¹(e)
      const InverseJacobians<X> at_d1(d1);
      const typename X::Jacobian by_d1 = -multiply<X>(at_r.left, X::Jr(d2)) * gain.asDiagonal();
      if (J0) J0->noalias() = -by_d1 * at_d1.left;  // dense: different decays destroy the block structure
      if (J1) {
        *J1 = -multiply<X>(at_r.left, back.Ad());
        J1->noalias() += by_d1 * at_d1.right;
      }
    }
    if (J2) *J2 = at_r.right;
  }

  void curvature(const G& t0, const G& t1, const G& t2, const Vector<dim>& w,
                 Matrix<3 * G::dof, 3 * G::dof>& H) const requires HasExpCurvature<G> {
    detail::curvature_of_carried_twist<G, false>(t0, t1, t2, gain(), drift(), w, H);
  }

 private:
  Vector<G::dof> gain() const { return dt2 / dt1 * decay; }
  Vector<G::dof> drift() const { return dt2 * (mean - decay.cwiseProduct(mean)); }
};

// Instantiated in damped_twist.cpp.
namespace detail {
extern template struct FunctionsOf<DampedTwist<SE3>>;
}  // namespace detail

}  // namespace tandem
