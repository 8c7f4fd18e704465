#pragma once

namespace tandem::detail {

/// Returns below() if x < limit, otherwise above(). The overload for Batch selects in each lane.
template <class S, class Below, class Above>
[[gnu::always_inline]] inline auto piecewise(const S& x, double limit, Below below, Above above) -> decltype(below()) {
  if (x < limit) return below();
  return above();
}

}  // namespace tandem::detail
