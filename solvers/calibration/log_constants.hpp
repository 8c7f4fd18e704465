#pragma once

#include <span>
#include <vector>

#include <tandem/residuals/loss.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>

namespace tandem {

/// What the logarithm of a density of so many whitened rows has beside −½ρ: −rows/2 log 2π of the normal one, also where a
/// loss is no density; of Student's t with ν degrees of freedom, under the noise of StudentT(),
///   log Γ((ν + rows)/2) − log Γ(ν/2) − rows/2 log(π (ν + rows)).
/// Throws Error where a student_t is no density, its scale² being no more than its rows.
double log_constant(const Loss& loss, int rows);

/// The degrees of freedom ν of a student_t, scale² − rows; below or at zero it is no density.
inline double degrees_of_freedom(const Loss& loss, int rows) { return loss.scale * loss.scale - rows; }

/// What the curvature of a density's logarithm is on average, by that which its weights ρ′ give: of Student's t
/// (ν + rows)/(ν + rows + 2), else 1.
double expected_curvature(const Loss& loss);

/// What the logarithm of problems' evidence (calibrate()) has beside that of their factors: Σ log det W + log_constant() of
/// what is measured, beliefs being divided by their integral; of all soft blocks, each a density, where nothing is said to be,
/// with that of the states, rows/2 log 2π. With it the evidence of a problem that is linear, its noise Gaussian, is exact, and
/// that of problems built by different parameters compares. Throws Error on hard blocks where nothing is said to be measured.
double log_constants(std::span<Problem* const> problems, const std::vector<MeasuredBlock>& measured);

}  // namespace tandem
