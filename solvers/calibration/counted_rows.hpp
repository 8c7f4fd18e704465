#pragma once

#include <tandem/residuals/loss.hpp>

namespace tandem {

/// What so many rows of normal noise count for under a robust loss: E[ρ'(s) s], s = χ² of `rows` degrees of freedom; all
/// of them without a loss. Scales found where Σ ρ'(s) s is that are right for noise that is normal but for outliers (Huber
/// 1964, proposal 2), while the density exp(−½ρ) of a redescending loss has no integral and would shrink them. Student's t
/// is a density, of which all rows count.
///
/// `taken`: the share of the noise's variance that estimated states have taken up, in [0, 1): what is left of a residual r is
/// smaller by it, and stands for r² + taken · rows.
double counted_rows(const Loss& loss, int rows, double taken = 0);

}  // namespace tandem
