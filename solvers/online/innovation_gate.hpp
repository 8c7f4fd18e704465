#pragma once

#include <optional>

#include <tandem/solvers/fixed_lag/fixed_lag.hpp>

namespace tandem::detail {

/// Normalised innovation of a measurement with the residual ν of covariance S = J P Jᵀ + R. R is the noise of the
/// measurement, and P the covariance of its variables without it.
struct Innovation {
  double sigmas;                   ///< largest |νᵢ| / √Sᵢᵢ
  double nis;                      ///< νᵀ S⁻¹ ν
  Eigen::Index rows;               ///< rows of ν that count
  Eigen::VectorXd standardised{};  ///< νᵢ / √Sᵢᵢ; empty if ν is not finite
};

/// Returns the normalised innovation of the first `rows` rows of a measurement. `block` must have been added after the
/// last update(), relinearize() or extend() of `lag`. Returns infinity if ν or its square is not finite, and nothing if
/// there is no covariance.
std::optional<Innovation> normalized_innovation(const FixedLag& lag, const Block& block, Eigen::Index rows);

/// Returns whether the cost of the block is finite at the current values.
bool has_finite_cost(const Problem& problem, const Block& block);

}  // namespace tandem::detail
