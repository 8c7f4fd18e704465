#include "complex_step.hpp"

#include <algorithm>
#include <cmath>

#include "python_error.hpp"

namespace tandem::python {

bool compare_complex_step(const std::string& name, std::size_t state, int entry, const Numbers& step,
                          const Numbers& rows, const Numbers& ahead, const Numbers& behind) {
  bool compared = true;
  for (py::ssize_t i = 0; i < step.size(); ++i) {
    const double forward = (ahead.data()[i] - rows.data()[i]) / kDifferenceStep;
    const double backward = (rows.data()[i] - behind.data()[i]) / kDifferenceStep;
    const double by_complex = step.data()[i] / kComplexStep, difference = 0.5 * (forward + backward);
    const double rounding = 1e-8 * std::abs(rows.data()[i]);
    const double size = std::max(std::abs(by_complex), std::abs(difference));
    if (!(std::abs(forward - backward) <= 1e-3 * size + rounding)) {
      compared = false;
      continue;
    }
    if (std::abs(by_complex - difference) <= 1e-2 * size + rounding) continue;
    raise("ResidualError", name + ": the derivative by entry " + std::to_string(entry) + " of state " +
                               std::to_string(state) + " is " + std::string(py::str(py::float_(by_complex))) +
                               " by a complex step but " + std::string(py::str(py::float_(difference))) +
                               " by differences; np.linalg.norm, abs, max, float and .real drop the imaginary part: "
                               "avoid them, or choose jacobian=\"difference\"");
  }
  return compared;
}

}  // namespace tandem::python
