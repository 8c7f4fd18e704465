#pragma once

#include <utility>

#include <tandem/problem/function_ref.hpp>

namespace tandem::detail {

inline constexpr double kFall = 2.0;  // of the log evidence, beyond which a factor is told from another (95 %, χ²/2)
inline constexpr double kWidest = 2.31;  // of a logarithm: what is told to a factor of 10 either way at worst, is told

/// The log evidence along one factor's logarithm, and its slope there; −∞ where it is no number.
struct Along {
  double value, slope;
};

/// Between which logarithms of a factor the data speak no clearer than kFall against it; infinite where no bound ends them
/// near enough to tell anything, or the evidence has become level. Looked for from `from` on, with `here`, in strides that
/// begin with `first_reach`; `bound`: the largest logarithm either way.
std::pair<double, double> flat_range(double from, const Along& here, double first_reach, double bound,
                                     FunctionRef<Along(double)> elsewhere);

}  // namespace tandem::detail
