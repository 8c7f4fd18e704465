#pragma once

#include <optional>

#include <tandem/solvers/online/fixed_lag.hpp>

namespace tandem::detail {

/// How far a measurement is from what is expected of it, in standard deviations of that difference: the largest
/// |νᵢ| / √Sᵢᵢ of the first `rows` rows of its residual ν, S = J P Jᵀ + R with R the measurement's noise and P the
/// covariance of the variables it reads without it.
/// `block` has just been added, after lag's last update, relinearize() or extend(). Infinite where ν is not finite, or its square is
/// not; nothing when there is no covariance.
std::optional<double> innovation_sigmas(const FixedLag& lag, const Block& block, Eigen::Index rows);

/// Whether the block's cost is a finite number at the variables' values.
bool has_finite_cost(const Problem& problem, const Block& block);

}  // namespace tandem::detail
