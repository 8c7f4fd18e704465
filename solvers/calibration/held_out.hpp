#pragma once

#include <span>
#include <string>
#include <vector>

#include <tandem/solvers/calibration/cross_validation.hpp>

namespace tandem::detail {

inline constexpr const char* kHeldOut = "held-out measurements";  // what is stopped

/// Leaves a fold's measurements out, by noise 10⁵ times their own. `noise` gets what they had.
void leave_out(std::span<Problem* const> problems, const std::vector<LeftOut>& fold, std::vector<Gaussian>& noise);

/// Solves all that are left. False: one could not be, and why. Throws Stopped.
bool solve_all(std::span<Problem* const> problems, const CalibrationOptions& options, std::string& why);

/// Residuals, covariances and likelihoods of what is scored of a fold, the f-th, at the problems' solution; `noise`: what its
/// measurements have. Throws Stopped.
std::vector<LeftOutPrediction> predictions(std::span<Problem* const> problems, const std::vector<LeftOut>& fold,
                                           std::size_t f, const std::vector<Gaussian>& noise, const Stop& stop);

/// How much likelier what is scored of a fold is by `b` than by `a`, in the logarithm.
double gain_of(const std::vector<LeftOutPrediction>& a, const std::vector<LeftOutPrediction>& b);

/// The standard error of the sum of the folds' gains, by how they differ.
double error_of_sum(const std::vector<double>& gains);

}  // namespace tandem::detail
