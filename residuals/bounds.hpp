#pragma once

#include <limits>
#include <tuple>

#include <tandem/lie/types.hpp>

namespace tandem {

/// Lower and upper bounds on the N rows of a hard residual, in its units. ±infinity means unbounded.
template <int N>
struct Bounds {
  Vector<N> lower, upper;

  auto fields() { return std::tie(lower, upper); }
};

/// Equal bounds on all rows of a residual of any dimension.
struct UniformBounds {
  double lower, upper;

  template <int N>
  operator Bounds<N>() const {
    return {Vector<N>::Constant(lower), Vector<N>::Constant(upper)};
  }
};

inline UniformBounds equal_to(double value) { return {value, value}; }
inline UniformBounds between(double lower, double upper) { return {lower, upper}; }  ///< inclusive
inline UniformBounds at_least(double lower) { return {lower, std::numeric_limits<double>::infinity()}; }
inline UniformBounds at_most(double upper) { return {-std::numeric_limits<double>::infinity(), upper}; }

}  // namespace tandem
