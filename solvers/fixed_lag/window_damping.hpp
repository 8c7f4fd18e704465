#pragma once

#include <algorithm>

#include <Eigen/Core>

#include <tandem/solvers/damped_step.hpp>

namespace tandem::detail {

/// Information that is added to an unobservable unknown. If only a combination of unknowns is unobservable, such as the
/// heading of a target with position measurements only, it is relative to the diagonal entry. The value is far above
/// rounding; it is that of a standard deviation of 10⁶.
inline constexpr double kMinInformation = 1e-12;

inline constexpr double kCovarianceDamping = 1e-10;  ///< more would change the covariance visibly

/// Damping of the solves of a window, which start near the solution.
class WindowDamping : public Damping {
 public:
  explicit WindowDamping(double initial) : Damping{initial, initial, 1e-6, 10, 4} {}

  /// Increases the damping after a factorization that failed.
  void increase() { value = 100 * std::max(value, 1e-12); }
  void reset() { value = min_value; }
  /// Returns whether a step with this damping counts as undamped.
  bool is_undamped() const { return value <= std::max(1e-4, min_value); }
  bool changes_covariance() const { return value > std::max(kCovarianceDamping, min_value); }
  /// Sets the additions to the diagonal of the Hessian, of which `scale` are the entries.
  void set_shift(const Eigen::VectorXd& scale, Eigen::VectorXd& shift) const {
    for (Eigen::Index i = 0; i < shift.size(); ++i)
      shift[i] = scale[i] > 0 ? damping_shift(value, scale[i], scale[i], scale[i]) : kMinInformation;
  }
};

}  // namespace tandem::detail
