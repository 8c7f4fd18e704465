#pragma once

#include <cmath>
#include <tuple>

#include <tandem/lie/error.hpp>
#include <tandem/lie/types.hpp>

namespace tandem {

namespace detail {

template <int N>
const Vector<N>& checked_nonzero(const Vector<N>& v) {
  if (!v.allFinite() || v.isZero(0.0)) throw BadInputError("direction: the vector must be finite and nonzero");
  return v;
}

}  // namespace detail

/// Measured direction in the sensor frame, in space (N = 3) or in the plane (N = 2), with the angular difference to
/// another direction.
template <int N>
class Direction;

/// Direction in space: a unit vector z and a basis E = [e1 e2] of the tangent plane of the unit sphere S² at z. The
/// unit vectors e1 and e2 point in the directions of increasing azimuth a (from x towards y) and elevation b (from the
/// xy-plane towards z):
///
///   z = [cos a cos b; sin a cos b; sin b],  e1 = [−sin a; cos a; 0],  e2 = [−cos a sin b; −sin a sin b; cos b]
///
/// A small e1 component is thus an arc: the change of azimuth times the cosine of the elevation. A direction along ±z
/// has azimuth 0.
template <>
class Direction<3> {
 public:
  Direction() : Direction(0.0, 0.0) {}
  /// Constructs a direction from angles [rad]. Throws Error if one is not finite.
  Direction(double azimuth, double elevation) {
    if (!std::isfinite(azimuth) || !std::isfinite(elevation))
      throw BadInputError("direction: azimuth and elevation must be finite; remove the measurement");
    const double ca = std::cos(azimuth), sa = std::sin(azimuth), cb = std::cos(elevation), sb = std::sin(elevation);
    unit_ << ca * cb, sa * cb, sb;
    axes_ << -sa, -ca * sb, ca, -sa * sb, 0.0, cb;
  }
  /// Constructs the direction of v, of any length. Throws Error if v is zero or not finite.
  explicit Direction(const Vector<3>& v)
      : Direction(std::atan2(detail::checked_nonzero(v)[1], v[0]), std::atan2(v[2], std::hypot(v[0], v[1]))) {}

  const Vector<3>& unit() const { return unit_; }
  /// Returns [e1 e2].
  const Matrix<3, 2>& axes() const { return axes_; }
  auto fields() { return std::tie(unit_, axes_); }

  /// Returns Log on S² of the direction of p ≠ 0 at this direction, along e1 and e2 [rad], of length 0 to π. Fills its
  /// derivative with respect to p if `by_p` is not null. Throws Error if p points within 1e-8 rad of the opposite
  /// direction, where Log is not unique.
  ///
  ///   y = Eᵀ p,  w = zᵀ p,  s = ‖y‖:   e = (θ/s) y,  θ = atan2(s, w),  for p of any length
  template <class S>
  Vector<2, S> log(const Vector<3, S>& p, Matrix<2, 3, S>* by_p = nullptr) const {
    using std::atan2, std::sqrt;
    const Vector<2, S> y = axes_.transpose() * p;
    const S w = unit_.dot(p), s2 = y.squaredNorm(), w2 = w * w;
    S scale, curvature;  // θ/s, and d(θ/s)/ds / s
    if (w > 0. && s2 < kSeriesBelow * w2) {
      const S x = s2 / w2;
      scale = (1. + x * (-1. / 3 + x * (1. / 5 + x * (-1. / 7 + x * (1. / 9))))) / w;
      curvature = (-2. / 3 + x * (4. / 5 + x * (-6. / 7 + x * (8. / 9 + x * (-10. / 11))))) / (w * w2);
    } else {
      if (s2 < 1e-16 * w2)
        throw UndefinedResidualError(
            "bearing: undefined if the target is opposite to the measured direction; use a closer initial guess");
      const S s = sqrt(s2);
      scale = atan2(s, w) / s;
      curvature = (w / (s2 + w2) - scale) / s2;
    }
    if (by_p) {
      const Vector<2, S> by_w = y / (-(s2 + w2));
      Matrix<2, 2, S> by_y = (curvature * y) * y.transpose();
      by_y(0, 0) += scale;
      by_y(1, 1) += scale;
      *by_p = by_y * axes_.transpose() + by_w * unit_.transpose();
    }
    return scale * y;
  }

 private:
  /// Series replace the closed forms below this value of tan²θ (truncation error below 1e-16).
  static constexpr double kSeriesBelow = 1e-3;

  Vector<3> unit_;
  Matrix<3, 2> axes_;
};

/// Direction in the plane: an angle from x towards y [rad].
template <>
class Direction<2> {
 public:
  Direction() : Direction(0.0) {}
  /// Throws Error if the angle is not finite.
  Direction(double angle) : unit_(std::cos(angle), std::sin(angle)) {
    if (!std::isfinite(angle)) throw BadInputError("direction: the angle must be finite; remove the measurement");
  }
  /// Constructs the direction of v, of any length. Throws Error if v is zero or not finite.
  explicit Direction(const Vector<2>& v) : Direction(std::atan2(detail::checked_nonzero(v)[1], v[0])) {}

  const Vector<2>& unit() const { return unit_; }
  auto fields() { return std::tie(unit_); }

  /// Returns the angle from this direction to the direction of p ≠ 0 [rad], in (−π, π]. Fills its derivative with
  /// respect to p if `by_p` is not null.
  template <class S>
  Vector<1, S> log(const Vector<2, S>& p, Matrix<1, 2, S>* by_p = nullptr) const {
    using std::atan2;
    if (by_p) *by_p = Matrix<1, 2, S>(-p[1], p[0]) / p.squaredNorm();
    return Vector<1, S>(atan2(unit_[0] * p[1] - unit_[1] * p[0], unit_[0] * p[0] + unit_[1] * p[1]));
  }

 private:
  Vector<2> unit_;
};

}  // namespace tandem
