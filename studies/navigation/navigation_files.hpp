#pragma once

#include <filesystem>

#include <tandem/studies/navigation/navigation_report.hpp>

namespace tandem {

/// Writes what was navigated, numbers to the last digit, all in the scenario's frame; a field that does not exist is empty.
/// Throws Error.
///
///     chaser.tum       t x y z qx qy qz qw
///     chaser_full.csv  t, pose, velocity along the world's axes, biases of accelerometer and gyroscope along the
///                      sensor's; covariance of the pose c11 … c66, row by row: of right perturbations, x y z [m], then
///                      rotation [rad], body axes; standard deviations of velocity and biases
///     errors.csv       per keyframe, against the truth, estimate minus truth, and 3 σ bounds: position and velocity
///                      along the world's axes, attitude about the body's; normalised errors squared
///     weights.csv      measurements that a robust loss gave a weight below kDownWeighted
///     summary.json     see navigation_report.hpp
void write_navigation(const NavigationStudy& study, const std::filesystem::path& folder);

}  // namespace tandem
