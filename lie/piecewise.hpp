#pragma once

namespace tandem::detail {

/// below() where x < limit, else above(): a function that is given by two expressions, of one number or of several side by side
/// (see Batch).
template <class S, class Below, class Above>
[[gnu::always_inline]] inline auto piecewise(const S& x, double limit, Below below, Above above) -> decltype(below()) {
  if (x < limit) return below();
  return above();
}

}  // namespace tandem::detail
