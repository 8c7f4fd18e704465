#pragma once

#include <tandem/residuals/loss.hpp>

namespace tandem {

/// Returns the number of rows that a robust loss counts out of `rows` with normal noise: E[ρ′(s) s] for s distributed
/// as χ² with `rows` degrees of freedom. It is the mean of what a block adds to the derivative of the evidence
/// (calibrate()). Without a loss, and for Student's t, all rows count.
///
/// Requiring Σ ρ′(s) s to equal this number gives the right scale for normal noise with outliers (Huber 1964, proposal
/// 2). The density exp(−½ρ) would not: for a redescending loss its integral is infinite.
///
/// `leverage` in [0, 1) is the share of the noise variance that the estimated states absorb. The remaining residual is
/// smaller by it, and log det H adds (ρ′(s) + ρ″(s) s) · leverage · rows.
double counted_rows(const Loss& loss, int rows, double leverage = 0);

}  // namespace tandem
