#pragma once

#include <cmath>
#include <tuple>

#include <tandem/lie/error.hpp>
#include <tandem/lie/types.hpp>

namespace tandem {

namespace detail {

template <int N>
const Vector<N>& pointing(const Vector<N>& v) {
  if (!v.allFinite() || v.isZero(0.0)) throw Error("direction: a vector points nowhere unless it is finite and not 0");
  return v;
}

}  // namespace detail

/// A measured direction in the sensor's frame, in space or in the plane, and how far from it another one points.
template <int N>
class Direction;

/// In space: a unit vector z and the tangent plane of the unit sphere S² there, whose axes E = [e1 e2] point where
/// azimuth (from x towards y) and elevation (from the xy-plane towards z) grow, both of length one:
///
///   z = [cos a cos b; sin a cos b; sin b],  e1 = [−sin a; cos a; 0],  e2 = [−cos a sin b; −sin a sin b; cos b]
///
/// A small e1 component is therefore the change of azimuth times the cosine of the elevation, an arc. Of a vector along
/// ±z the azimuth is taken as 0.
template <>
class Direction<3> {
 public:
  Direction() : Direction(0.0, 0.0) {}
  /// Angles in rad. Throws Error when one is not finite.
  Direction(double azimuth, double elevation) {
    if (!std::isfinite(azimuth) || !std::isfinite(elevation))
      throw Error("direction: azimuth and elevation must be finite; leave the measurement out");
    const double ca = std::cos(azimuth), sa = std::sin(azimuth), cb = std::cos(elevation), sb = std::sin(elevation);
    unit_ << ca * cb, sa * cb, sb;
    axes_ << -sa, -ca * sb, ca, -sa * sb, 0.0, cb;
  }
  /// Along v, of any length. Throws Error when it is zero or not finite.
  explicit Direction(const Vector<3>& v)
      : Direction(std::atan2(detail::pointing(v)[1], v[0]), std::atan2(v[2], std::hypot(v[0], v[1]))) {}

  const Vector<3>& unit() const { return unit_; }
  /// e1 and e2, the columns.
  const Matrix<3, 2>& axes() const { return axes_; }
  auto fields() { return std::tie(unit_, axes_); }

  /// Log on S² of the direction of p ≠ 0 at this one, along e1 and e2 [rad], of length 0 to π; and its derivative by p.
  /// Throws Error where p points within 1e-8 rad of the opposite direction, to which all ways are equally long.
  ///
  ///   y = Eᵀ p,  w = zᵀ p,  s = ‖y‖:   e = (θ/s) y,  θ = atan2(s, w),  whatever the length of p
  template <class S>
  Vector<2, S> log(const Vector<3, S>& p, Matrix<2, 3, S>* by_p = nullptr) const {
    using std::atan2, std::sqrt;
    const Matrix<2, 3, S> Et = axes_.transpose().template cast<S>();
    const Vector<3, S> z = unit_.template cast<S>();
    const Vector<2, S> y = Et * p;
    const S w = z.dot(p), s2 = y.squaredNorm(), w2 = w * w;
    S scale, curvature;  // θ/s, and its derivative by s over s
    if (w > 0. && s2 < kSeriesBelow * w2) {
      const S x = s2 / w2;
      scale = (1. + x * (-1. / 3 + x * (1. / 5 + x * (-1. / 7 + x * (1. / 9))))) / w;
      curvature = (-2. / 3 + x * (4. / 5 + x * (-6. / 7 + x * (8. / 9 + x * (-10. / 11))))) / (w * w2);
    } else {
      if (s2 < 1e-16 * w2)
        throw Error("bearing: undefined for a target opposite to the measured direction; start with the two closer");
      const S s = sqrt(s2);
      scale = atan2(s, w) / s;
      curvature = (w / (s2 + w2) - scale) / s2;
    }
    if (by_p) {
      const Vector<2, S> by_w = y / (-(s2 + w2));
      Matrix<2, 2, S> by_y = (curvature * y) * y.transpose();
      by_y(0, 0) += scale;
      by_y(1, 1) += scale;
      *by_p = by_y * Et + by_w * z.transpose();
    }
    return scale * y;
  }

 private:
  /// Below this tan²θ series replace the closed forms (truncation below 1e-16).
  static constexpr double kSeriesBelow = 1e-3;

  Vector<3> unit_;
  Matrix<3, 2> axes_;
};

/// In the plane: an angle from x towards y [rad].
template <>
class Direction<2> {
 public:
  Direction() : Direction(0.0) {}
  /// Throws Error when the angle is not finite.
  Direction(double angle) : unit_(std::cos(angle), std::sin(angle)) {
    if (!std::isfinite(angle)) throw Error("direction: the angle must be finite; leave the measurement out");
  }
  /// Along v, of any length. Throws Error when it is zero or not finite.
  explicit Direction(const Vector<2>& v) : Direction(std::atan2(detail::pointing(v)[1], v[0])) {}

  const Vector<2>& unit() const { return unit_; }
  auto fields() { return std::tie(unit_); }

  /// The angle from this direction to that of p ≠ 0 [rad], in (−π, π]; and its derivative by p.
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
