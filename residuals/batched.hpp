#pragma once

#include <array>
#include <cstddef>

#include <tandem/lie/sek3.hpp>

// Forward declarations only: every pool includes this header and would otherwise be recompiled whenever one of these
// residuals changes.
namespace tandem {
template <LieGroup G>
struct RelativePose;
template <LieGroup G>
struct ConstantTwist;
}  // namespace tandem

namespace tandem::detail {

/// Number of blocks that are evaluated at once, one in each lane of a Batch.
inline constexpr int kBatch = 4;

/// Residuals with a batched evaluation; the primary template has none. The residual's own code is compiled for wider
/// vectors in batched.cpp. Results equal those of single evaluation up to rounding.
template <class R>
struct Batched {
  static constexpr bool exists = false;
};

/// Evaluates kBatch blocks of residual R, which has 6 rows and reads kArity poses. x[s][i] is state s of block i.
/// Outputs hold the values of one block after the other, matrices by columns.
template <class R, int kArity>
struct BatchedSE3 {
  static constexpr bool exists = true;
  using States = std::array<std::array<const SE3*, kBatch>, std::size_t(kArity)>;

  /// Computes the residuals `r` and, for each state s, the Jacobians `J[s]`.
  static void linearize(const std::array<const R*, kBatch>& residual, const States& x, double* r,
                        const std::array<double*, std::size_t(kArity)>& J);
  /// Computes the residuals only, bitwise equal to those of linearize().
  static void evaluate(const std::array<const R*, kBatch>& residual, const States& x, double* r);
  /// Computes R's curvature of each block, contracted with the block's six entries of `w`.
  static void curvature(const std::array<const R*, kBatch>& residual, const States& x, const double* w, double* H);
};

template <>
struct Batched<RelativePose<SE3>> : BatchedSE3<RelativePose<SE3>, 2> {};
template <>
struct Batched<ConstantTwist<SE3>> : BatchedSE3<ConstantTwist<SE3>, 3> {};

}  // namespace tandem::detail
