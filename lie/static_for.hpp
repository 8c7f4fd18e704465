#pragma once

#include <utility>

namespace tandem::detail {

/// Calls f.template operator()<I>() for I = 0 … N−1.
template <int N, class F>
constexpr void static_for(F&& f) {
  [&]<int... I>(std::integer_sequence<int, I...>) { (f.template operator()<I>(), ...); }
  (std::make_integer_sequence<int, N>{});
}

}  // namespace tandem::detail
