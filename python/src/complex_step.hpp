#pragma once

#include <string>

#include "arrays.hpp"

namespace tandem::python {

/// Steps of right perturbations, for Jacobians.
inline constexpr double kDifferenceStep = 1e-6, kComplexStep = 1e-30;

/// Compares a column of a Jacobian by a complex step with central differences. `step` is the column times kComplexStep.
/// Throws ResidualError if they disagree, for example because the function drops the imaginary part. Returns false if a
/// kink or an undefined row prevents the comparison.
bool compare_complex_step(const std::string& name, std::size_t state, int entry, const Numbers& step,
                          const Numbers& rows, const Numbers& ahead, const Numbers& behind);

}  // namespace tandem::python
