#pragma once

#include <cmath>
#include <optional>

#include <tandem/studies/online/track_records.hpp>
#include <tandem/studies/scenario/frame.hpp>

namespace tandem {

/// A position counts as unobserved from this standard deviation [m] on: the first limit is for the present position,
/// the second for predictions, whose uncertainty grows with time. The window's prior on unobserved positions has a
/// standard deviation of 1e6 m.
inline constexpr double kUnobserved = 1e4, kUnobservedAhead = 3e5;

/// Returns the standard deviation of a position [m] as printed and written: infinite if no measurement observes it.
inline double reported_sigma(double sigma, double unobserved = kUnobserved) {
  return sigma < unobserved ? sigma : HUGE_VAL;
}
inline std::optional<double> reported_sigma(const std::optional<double>& sigma) {
  return sigma ? std::optional(reported_sigma(*sigma)) : std::nullopt;
}

/// Returns reported_sigma() of a covariance along each axis of the chaser's body, in the axes of the scenario's files.
inline Vector<3> reported_sigmas(const Frame& frame, const Matrix<3, 3>& covariance, double unobserved = kUnobserved) {
  return frame.body(sigmas(covariance)).cwiseAbs().unaryExpr([unobserved](double sigma) {
    return reported_sigma(sigma, unobserved);
  });
}

}  // namespace tandem
