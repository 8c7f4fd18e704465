#pragma once

#include <filesystem>

#include <tandem/studies/estimation/estimate.hpp>

namespace tandem {

/// Writes what was estimated, numbers to the last digit, all in the scenario's frame; a field that does not exist is
/// empty. Throws Error.
///
///     chaser.tum, target.tum            t x y z qx qy qz qw
///     chaser_full.csv, target_full.csv  t, pose, body twist (mean between neighbouring keyframes, or the model's own),
///                                       covariance c11 … c66, row by row: of right perturbations, x y z [m], then
///                                       rotation [rad], body axes; of a target that is a point 3 × 3, world axes
///     errors.csv                        per keyframe: against the truth, and 3 σ bounds, of the relative pose: position
///                                       along the chaser's axes, rotation about the target's
///     weights.csv                       measurements that a robust loss gave a weight below kDownWeighted
///     held_out.csv                      when measurements were held out: residual and σ of its prediction, row by row
///     summary.json                      see report.hpp
void write_results(const Estimate& estimate, const std::filesystem::path& folder);

}  // namespace tandem
