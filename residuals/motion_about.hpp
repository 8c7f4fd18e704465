#pragma once

#include <tandem/lie/operations.hpp>

namespace tandem {

/// How far the keyframes before and after another are from it [s, positive]; 0: there is none.
struct Neighbours {
  double before = 0, after = 0;
};

namespace detail {

/// Where a state that was X₋, X, X₊ at a keyframe before, at it and after it is an instant s later,
///
///   Y(s) = X ⊕ (a(s) (X₋ ⊖ X) + b(s) (X₊ ⊖ X)),
///
/// a, b the parabolas that are 1 at their own of the three instants and 0 at the others: a constant twist is kept, and so is
/// a constant acceleration as far as X's tangent space tells. With one neighbour the motion is at a constant twist to it;
/// without any, X stands. From both sides, and not from one, for the sake of s when it is estimated: read along the line
/// through one neighbour, noise is weighed down between the two and up beyond, so that the cost of X falls as s moves out
/// of [X₋, X]; the parabola weighs it down as much on either side.
template <LieGroup X>
struct MotionAbout {
  using S = typename X::Scalar;
  using Jacobian = typename X::Jacobian;

  X at;
  /// Derivatives, where they are wanted: by X, and by a neighbour that there is; by s.
  Jacobian by_here, by_before, by_after;
  typename X::Tangent by_time = X::Tangent::Zero();

  MotionAbout(const Neighbours& apart, const X& here, const X& before, const X& after, const S& s, bool wanted);
};
template <LieGroup X>
MotionAbout<X>::MotionAbout(const Neighbours& apart, const X& here, const X& before, const X& after, const S& s,
                            bool wanted)
    : at(here) {
  const double p = apart.before, q = apart.after;
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
