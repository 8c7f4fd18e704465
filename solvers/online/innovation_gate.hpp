#pragma once

#include <optional>

#include <tandem/solvers/fixed_lag/fixed_lag.hpp>

namespace tandem::detail {

/// Returns the normalised innovation of a measurement: the largest |νᵢ| / √Sᵢᵢ over the first `rows` rows of its
/// residual ν. S = J P Jᵀ + R, where R is the noise of the measurement and P the covariance of its variables without
/// it. `block` must have been added after the last update(), relinearize() or extend() of `lag`. Returns infinity if ν
/// or its square is not finite, and nothing if there is no covariance.
std::optional<double> normalized_innovation(const FixedLag& lag, const Block& block, Eigen::Index rows);

/// Returns whether the cost of the block is finite at the current values.
bool has_finite_cost(const Problem& problem, const Block& block);

}  // namespace tandem::detail
