#pragma once

#include <cmath>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// First-order Gauss–Markov process of a systematic error b with standard deviation σ and time constant τ [units of b]:
///
///   e = b₁ − φ b₀,   φ = exp(−Δt / τ),   with standard deviation σ √(1 − φ²)
///
/// Source: Gelb 1974, Applied Optimal Estimation, §2.2.
template <int N>
struct GaussMarkov {
  static constexpr std::string_view name = "Gauss-Markov";
  static constexpr int dim = N;
  static constexpr bool linear = true;
  using States = std::tuple<Rn<N>, Rn<N>>;

  double decay;  ///< φ, in [0, 1)

  auto fields() { return std::tie(decay); }

  /// Constructs the residual for two errors dt [s] apart.
  static GaussMarkov after(double dt, double time_constant) { return {std::exp(-dt / time_constant)}; }
  /// Returns the standard deviation of e for σ = 1.
  double noise_scale() const { return std::sqrt(1 - decay * decay); }
  /// Returns the expected b₁ given b₀.
  Rn<N> expected(const Rn<N>& b0) const { return Rn<N>(Vector<N>(decay * b0.vector())); }

  template <Over<Rn<N>> B>
  void operator()(const B& b0, const B& b1, Rows<dim, B>& r, RowsBy<dim, B>* J0 = nullptr,
                  RowsBy<dim, B>* J1 = nullptr) const {
    using S = typename B::Scalar;
    r = b1.vector() - S(decay) * b0.vector();
    if (J0) *J0 = -S(decay) * RowsBy<dim, B>::Identity();
    if (J1) J1->setIdentity();
  }
};

}  // namespace tandem
