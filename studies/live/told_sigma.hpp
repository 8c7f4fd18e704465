#pragma once

#include <cmath>
#include <optional>

#include <tandem/studies/live/track_records.hpp>
#include <tandem/studies/scenario/frame.hpp>

namespace tandem {

/// What a standard deviation [m] has to be below for something to have observed it: of a position now, and of one that is
/// predicted, which may be far off though known. A window takes a million for no information.
inline constexpr double kUnobserved = 1e4, kUnobservedAhead = 3e5;

/// A standard deviation of a position [m] as lines and files have it: infinite where nothing has observed it yet, whose
/// number would mean nothing.
inline double told_sigma(double sigma, double unobserved = kUnobserved) {
  return sigma < unobserved ? sigma : HUGE_VAL;
}
inline std::optional<double> told_sigma(const std::optional<double>& sigma) {
  return sigma ? std::optional(told_sigma(*sigma)) : std::nullopt;
}

/// The same of each axis of a covariance along those of the chaser's body in files.
inline Vector<3> told_sigmas(const Frame& frame, const Matrix<3, 3>& covariance, double unobserved = kUnobserved) {
  return frame.body(sigmas(covariance)).cwiseAbs().unaryExpr([unobserved](double sigma) {
    return told_sigma(sigma, unobserved);
  });
}

}  // namespace tandem
