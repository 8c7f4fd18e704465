#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::detail {

/// The damping of Levenberg–Marquardt steps, a multiple of the Hessian's diagonal, by Nielsen's rule (1999): it falls by
/// how well the model foretold a step's gain, and grows ever faster while steps are refused.
struct Damping {
  double value;
  double least;          ///< it falls to
  double least_refused;  ///< it grows from
  double growth;         ///< at the first refusal, and
  double acceleration;   ///< how much more at each further one
  double next_growth = growth;

  /// After a step that gained `ratio` of what the model foretold.
  void accept(double ratio) {
    value = std::max(least, value * std::max(0.1, 1 - std::pow(2 * ratio - 1, 3)));
    next_growth = growth;
  }
  void refuse() {
    value = std::max(value, least_refused) * next_growth;
    next_growth *= acceleration;
  }
};

/// What damping adds to the diagonal of the matrix that is factorised. An unknown that nothing curves still gets a
/// pivot, and then no step. `scale` is the cost's curvature of the unknown, `diagonal` that of the whole matrix.
inline double damping_shift(double damping, double scale, double diagonal) {
  return diagonal > 0 ? std::max(damping * scale, std::numeric_limits<double>::min()) : 1.0;
}

}  // namespace tandem::detail
