#pragma once

#include <span>
#include <vector>

#include <tandem/residuals/loss.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>

namespace tandem {

/// Returns the log normalisation constant of a density exp(c − ½ρ) of `rows` whitened rows. It is −rows/2 log 2π for
/// normal noise and for losses that are not densities. For Student's t with ν degrees of freedom and the noise of
/// StudentT(), it is
///   log Γ((ν + rows)/2) − log Γ(ν/2) − rows/2 log(π (ν + rows)).
/// Throws Error if a student_t is not a density: degrees_of_freedom() must be positive.
double log_constant(const Loss& loss, int rows);

/// Returns the degrees of freedom ν of a student_t loss, scale² − rows. It is a density only if ν > 0.
inline double degrees_of_freedom(const Loss& loss, int rows) { return loss.scale * loss.scale - rows; }

/// Returns the expected curvature of −log density, relative to the Gauss-Newton curvature with weight ρ′:
/// (ν + rows)/(ν + rows + 2) for Student's t, else 1.
double expected_curvature(const Loss& loss);

/// Returns the constant part of the log evidence of problems (calibrate()): Σ (log det W + log_constant()) over the
/// measured blocks. If `measured` is empty, sums over all soft blocks, and adds ½ log 2π per unknown.
/// Calibration::log_evidence plus this constant is exact for a linear problem with Gaussian noise, and comparable
/// between problems built from different parameters. Throws Error if `measured` is empty and there are hard blocks.
double log_constants(std::span<Problem* const> problems, const std::vector<MeasuredBlock>& measured);

}  // namespace tandem
