#pragma once

#include <cmath>
#include <optional>

#include <tandem/studies/live/track_records.hpp>
#include <tandem/studies/scenario/frame.hpp>

namespace tandem {

/// A standard deviation of a position [m] as lines and files have it: infinite where nothing has observed it yet, whose
/// number, out of what a window takes for no information, would mean nothing.
inline double told_sigma(double sigma) {
  constexpr double kUnobserved = 1e4;
  return sigma < kUnobserved ? sigma : HUGE_VAL;
}
inline std::optional<double> told_sigma(const std::optional<double>& sigma) {
  return sigma ? std::optional(told_sigma(*sigma)) : std::nullopt;
}

/// The same of each axis of a covariance along those of the chaser's body in files.
inline Vector<3> told_sigmas(const Frame& frame, const Matrix<3, 3>& covariance) {
  return frame.body(sigmas(covariance)).cwiseAbs().unaryExpr([](double sigma) { return told_sigma(sigma); });
}

}  // namespace tandem
