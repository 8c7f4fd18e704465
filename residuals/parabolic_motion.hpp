#pragma once

#include <tuple>

#include <tandem/lie/operations.hpp>

namespace tandem {

/// Time from a keyframe to its neighbours [s, positive]; 0 if there is no neighbour.
struct NeighbourGaps {
  double before = 0, after = 0;

  auto fields() { return std::tie(before, after); }
};

namespace detail {

/// State at time s relative to a keyframe, interpolated from the states X₋, X, X₊ at the keyframe before, at it and
/// after it:
///
///   Y(s) = X ⊕ (a(s) (X₋ ⊖ X) + b(s) (X₊ ⊖ X))
///
/// a and b are the parabolas that are 1 at their own neighbour and 0 at the other two instants. A constant twist is
/// reproduced exactly, and so is a constant acceleration in the tangent space at X. With one neighbour the twist is
/// constant; without neighbours Y = X.
///
/// Both neighbours are used because s may be estimated (a time offset). Between two states interpolation averages their
/// noise; beyond them it amplifies the noise. With a single neighbour, the cost would therefore fall as s moves out of
/// the interval between the two states. The parabola gives noise equal weights on both sides.
template <LieGroup X>
struct ParabolicMotion {
  using S = typename X::Scalar;
  using Jacobian = typename X::Jacobian;

  X at;
  /// Derivatives, set if `wanted`: with respect to X, to each existing neighbour, and to s.
  Jacobian by_here, by_before, by_after;
  typename X::Tangent by_time = X::Tangent::Zero();

  ParabolicMotion(const NeighbourGaps& gaps, const X& here, const X& before, const X& after, const S& s, bool wanted);
};
template <LieGroup X>
ParabolicMotion<X>::ParabolicMotion(const NeighbourGaps& gaps, const X& here, const X& before, const X& after,
                                    const S& s, bool wanted)
    : at(here) {
  const double p = gaps.before, q = gaps.after;
  if (p == 0 && q == 0) {
    if (wanted) by_here.setIdentity();
    return;
  }
  const S a = p == 0 ? S(0.) : q == 0 ? S(-s / p) : S(s * (s - q) / (p * (p + q)));
  const S b = q == 0 ? S(0.) : p == 0 ? S(s / q) : S(s * (s + p) / (q * (p + q)));
  typename X::Tangent back = X::Tangent::Zero(), on = X::Tangent::Zero();
  if (p != 0) back = minus(before, here);
  if (q != 0) on = minus(after, here);
  const typename X::Tangent step = a * back + b * on;
  const X moved = X::Exp(step);
  at = here * moved;
  if (!wanted) return;
  const S a_by_s = p == 0 ? S(0.) : q == 0 ? S(-1 / p) : S((S(2.) * s - q) / (p * (p + q)));
  const S b_by_s = q == 0 ? S(0.) : p == 0 ? S(1 / q) : S((S(2.) * s + p) / (q * (p + q)));
  const Jacobian by_step = X::Jr(step);
  by_time = by_step * (a_by_s * back + b_by_s * on);
  by_here = moved.inverse().Ad();
  if (p != 0) {
    const InverseJacobians<X> of(back);
    const Jacobian K = a * by_step;
    by_here -= multiply<X>(K, of.left);
    by_before = multiply<X>(K, of.right);
  }
  if (q != 0) {
    const InverseJacobians<X> of(on);
    const Jacobian K = b * by_step;
    by_here -= multiply<X>(K, of.left);
    by_after = multiply<X>(K, of.right);
  }
}

}  // namespace detail
}  // namespace tandem
