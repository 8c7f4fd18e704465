#pragma once

#include <array>

#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/relative_pose.hpp>

namespace tandem::detail {

/// How many blocks are evaluated at once, side by side in vectors (Batch).
inline constexpr int kBatch = 4;

/// Residuals that are: the same code as for one, compiled for wider vectors (batched.cpp), to the same values but for
/// rounding. None by itself.
template <class R>
struct Batched {
  static constexpr bool exists = false;
};

/// Of kBatch blocks: their residuals; of each state in turn, its values in these blocks; to kBatch times the rows, and, of each
/// state in turn, to kBatch times its Jacobian, by columns.
template <class R>
struct BatchedInSpace {
  static constexpr bool exists = true;
  static constexpr int kArity = std::tuple_size_v<typename R::States>;
  using States = std::array<std::array<const SE3*, kBatch>, std::size_t(kArity)>;

  static void linearize(const std::array<const R*, kBatch>& residual, const States& x, double* r,
                        const std::array<double*, std::size_t(kArity)>& J);
  /// The rows alone, to the last bit the same.
  static void evaluate(const std::array<const R*, kBatch>& residual, const States& x, double* r);
  /// Their second derivatives, each contracted with its six of `w`: to kBatch times R's curvature, by columns.
  static void curvature(const std::array<const R*, kBatch>& residual, const States& x, const double* w, double* H);
};

template <>
struct Batched<RelativePose<SE3>> : BatchedInSpace<RelativePose<SE3>> {};
template <>
struct Batched<ConstantTwist<SE3>> : BatchedInSpace<ConstantTwist<SE3>> {};

}  // namespace tandem::detail
