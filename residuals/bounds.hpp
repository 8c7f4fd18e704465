#pragma once

#include <limits>

#include <tandem/lie/types.hpp>

namespace tandem {

/// Lower and upper bounds of the N rows of a hard residual, in the residual's units; ±infinity where there is none.
template <int N>
struct Bounds {
  Vector<N> lower, upper;
};

/// The same for all rows of whatever residual they are given to.
struct UniformBounds {
  double lower, upper;

  template <int N>
  operator Bounds<N>() const {
    return {Vector<N>::Constant(lower), Vector<N>::Constant(upper)};
  }
};

inline UniformBounds equal_to(double value) { return {value, value}; }               ///< every row
inline UniformBounds between(double lower, double upper) { return {lower, upper}; }  ///< every row, inclusive
inline UniformBounds at_least(double lower) { return {lower, std::numeric_limits<double>::infinity()}; }
inline UniformBounds at_most(double upper) { return {-std::numeric_limits<double>::infinity(), upper}; }

}  // namespace tandem
