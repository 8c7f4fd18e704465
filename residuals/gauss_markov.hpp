#pragma once

#include <cmath>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// An error that is forgotten with a time constant τ, a first-order Gauss–Markov process of standard deviation σ:
///   e = b₁ − φ b₀,   φ = exp(−Δt / τ),   of standard deviation σ √(1 − φ²)   [units of the error].
/// Source: Gelb 1974, Applied Optimal Estimation, §2.2.
template <int N>
struct GaussMarkov {
  static constexpr std::string_view name = "Gauss-Markov";
  static constexpr int dim = N;
  static constexpr bool linear = true;
  using States = std::tuple<Rn<N>, Rn<N>>;

  double kept;  ///< φ, in [0, 1)

  static GaussMarkov after(double dt, double time_constant) { return {std::exp(-dt / time_constant)}; }
  /// Times σ: the standard deviation of e.
  double spread() const { return std::sqrt(1 - kept * kept); }
  /// Where b₀ leads.
  Rn<N> expected(const Rn<N>& b0) const { return Rn<N>(Vector<N>(kept * b0.vector())); }

  template <Over<Rn<N>> B>
  void operator()(const B& b0, const B& b1, Rows<dim, B>& r, RowsBy<dim, B>* J0 = nullptr,
                  RowsBy<dim, B>* J1 = nullptr) const {
    using S = typename B::Scalar;
    r = b1.vector() - S(kept) * b0.vector();
    if (J0) *J0 = -S(kept) * RowsBy<dim, B>::Identity();
    if (J1) J1->setIdentity();
  }
};

}  // namespace tandem
