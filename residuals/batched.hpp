#pragma once

#include <array>
#include <cstddef>

#include <tandem/lie/sek3.hpp>

// By their names alone: every pool reads this, and would be compiled anew with each of them.
namespace tandem {
template <LieGroup G>
struct RelativePose;
template <LieGroup G>
struct ConstantTwist;
}  // namespace tandem

namespace tandem::detail {

/// How many blocks are evaluated at once, side by side in vectors (Batch).
inline constexpr int kBatch = 4;

/// Residuals that are: the same code as for one, compiled for wider vectors (batched.cpp), to the same values but for
/// rounding. None by itself.
template <class R>
struct Batched {
  static constexpr bool exists = false;
};

/// Of kBatch blocks of residual R, of so many states: their residuals; of each state in turn, its values in these blocks; to kBatch times the rows, and, of each
/// state in turn, to kBatch times its Jacobian, by columns.
template <class R, int kArity>
struct BatchedInSpace {
  static constexpr bool exists = true;
  using States = std::array<std::array<const SE3*, kBatch>, std::size_t(kArity)>;

  static void linearize(const std::array<const R*, kBatch>& residual, const States& x, double* r,
                        const std::array<double*, std::size_t(kArity)>& J);
  /// The rows alone, to the last bit the same.
  static void evaluate(const std::array<const R*, kBatch>& residual, const States& x, double* r);
  /// Their second derivatives, each contracted with its six of `w`: to kBatch times R's curvature, by columns.
  static void curvature(const std::array<const R*, kBatch>& residual, const States& x, const double* w, double* H);
};

template <>
struct Batched<RelativePose<SE3>> : BatchedInSpace<RelativePose<SE3>, 2> {};
template <>
struct Batched<ConstantTwist<SE3>> : BatchedInSpace<ConstantTwist<SE3>, 3> {};

}  // namespace tandem::detail
