#pragma once

#include <tandem/lie/operations.hpp>
#include <tandem/residuals/carried_twist_curvature.hpp>
#include <tandem/residuals/ornstein_uhlenbeck.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// A body-frame twist over three consecutive states, each component of which decays to a mean μ with a time constant τ
/// of its own [units of the group's tangent, e.g. m and rad]:
///
///   δ1 = T1 ⊖ T0,  δ2 = dt2 (μ + φ (δ1/dt1 − μ)),  e = T2 ⊖ (T1 ⊕ δ2),   φ = exp(−h/τ),  h = (dt1 + dt2)/2
///
/// The mean twist over an interval stands for the twist at its middle, an Ornstein–Uhlenbeck process u = ϖ − μ that is
/// seen h seconds later again: what it keeps is φ, and the noise of e is, exactly of that process,
///
///   Var e = dt2² σ² τ/2 (1 − exp(−2h/τ)),   σ the root spectral density of what disturbs the twist [m s^-3/2, rad s^-3/2]
///
/// (Given the mean over the first interval alone, the mean over the second has for τ = ∞ the variance
/// σ² (dt1 + dt2)/3; but neighbouring triples share noise, by a correlation of 1/4, which independent residuals leave
/// out: taken from middle to middle their noises add up to the process's own.) With τ = ∞ it is ConstantTwist, whose
/// noise dt2 Σ̄ is this one where states are 1 s apart; where they are closer, this twist changes less from one to the
/// next, not more.
template <LieGroup G>
struct DampedTwist {
  static constexpr std::string_view name = "damped twist";
  static constexpr int dim = G::dof;
  using States = std::tuple<G, G, G>;

  double dt1, dt2;      ///< t1 − t0 and t2 − t1 [s], both > 0
  Vector<G::dof> kept;  ///< φ of each component, in [0, 1]
  Vector<G::dof> mean;  ///< μ [units of the tangent per s]

  /// By time constants τ [s], > 0, also infinite.
  static DampedTwist over(double dt1, double dt2, const Vector<G::dof>& time_constants,
                          const Vector<G::dof>& mean = Vector<G::dof>::Zero()) {
    const double h = 0.5 * (dt1 + dt2);
    return {dt1, dt2, time_constants.unaryExpr([h](double tau) { return OrnsteinUhlenbeck{tau}.kept(h); }), mean};
  }

  /// √Var e of each component for σ = 1: Gaussian(sigmas).scaled(spread(…)).
  static Vector<G::dof> spread(double dt1, double dt2, const Vector<G::dof>& time_constants) {
    const double h = 0.5 * (dt1 + dt2);
    return time_constants.unaryExpr([=](double tau) { return dt2 * std::sqrt(OrnsteinUhlenbeck{tau}.gathered(h)); });
  }

  template <Over<G> X>
  void operator()(const X& t0, const X& t1, const X& t2, Rows<dim, X>& r, RowsBy<dim, X>* J0 = nullptr,
                  RowsBy<dim, X>* J1 = nullptr, RowsBy<dim, X>* J2 = nullptr) const {
    using S = typename X::Scalar;
    using Diagonal = Vector<G::dof, S>;
    const Diagonal share = this->share().template cast<S>(), drift = this->drift().template cast<S>();
    const typename X::Tangent d1 = (t0.inverse() * t1).Log(), d2 = share.cwiseProduct(d1) + drift;
    const X back = X::Exp(-d2);
    r = (back * t1.inverse() * t2).Log();
    if (!J0 && !J1 && !J2) return;
    const InverseJacobians<X> at_r(r);
    if (J0 || J1) {  // through T̂2, whose Jacobian is −Jl⁻¹(e)
      const InverseJacobians<X> at_d1(d1);
      const typename X::Jacobian by_d1 = -multiply<X>(at_r.left, X::Jr(d2)) * share.asDiagonal();
      if (J0) J0->noalias() = -by_d1 * at_d1.left;  // dense: components that decay apart leave no structure
      if (J1) {
        *J1 = -multiply<X>(at_r.left, back.Ad());
        J1->noalias() += by_d1 * at_d1.right;
      }
    }
    if (J2) *J2 = at_r.right;
  }

  void curvature(const G& t0, const G& t1, const G& t2, const Vector<dim>& w,
                 Matrix<3 * G::dof, 3 * G::dof>& H) const requires HasExpCurvature<G> {
    detail::curvature_of_carried_twist<G, false>(t0, t1, t2, share(), drift(), w, H);
  }

 private:
  Vector<G::dof> share() const { return dt2 / dt1 * kept; }
  Vector<G::dof> drift() const { return dt2 * (mean - kept.cwiseProduct(mean)); }
};

}  // namespace tandem
