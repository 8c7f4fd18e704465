#pragma once

#include <cmath>
#include <numbers>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/residuals/sensor_frame.hpp>

namespace tandem {

/// Field of view of a sensor with gradual limits. At `range`, and at `half_angle` off the axis, a fix has a probability
/// of one half.
struct FieldOfView {
  double range = 9.0;                        ///< m
  double range_fade = 1.0;                   ///< Width of the transition at the range [m].
  double half_angle = std::numbers::pi / 4;  ///< Angle from the x axis of the sensor frame [rad].
  double cosine_fade = 0.05;                 ///< Width of the transition in the cosine of the angle.
  SE3 B{};                                   ///< Sensor in the body of its carrier.
  Vector<3> beacon = Vector<3>::Zero();      ///< Observed point in the target's body [m].

  auto fields() { return std::tie(range, range_fade, half_angle, cosine_fade, B, beacon); }
};

/// Soft visibility of a target; zero where a fix is certain (dimensionless, smooth everywhere):
///
///   e = g √(−ln P),   P = ℓ((range − ρ)/range_fade) ℓ((p_x/ρ − cos half_angle)/cosine_fade),   ℓ(s) = 1/(1 + exp(−s))
///
/// with p = t((C B)⁻¹ (T F)) and ρ = √(‖p‖² + ε²), ε = 1 cm. P is the probability of a fix. Let g² be twice the
/// information of a fix [nats]. Then ½ e² is an upper bound on the expected loss of information, because −ln P ≥ 1 − P.
/// The bound is tight for P near 1. Unlike 1 − P, it keeps a gradient out of sight: it grows with the distance beyond
/// the range and with the angle off the axis. States: pose of the sensor's carrier, pose of the target, g.
struct Visibility {
  static constexpr std::string_view name = "unseen";
  static constexpr int dim = 1;
  static constexpr double kRounding = 0.01;  ///< ε [m]
  using States = std::tuple<SE3, SE3, Rn<1>>;

  FieldOfView sight{};

  auto fields() { return std::tie(sight); }

  /// Returns P and fills dP/dp if `by_p` is not null.
  template <class S>
  S probability(const Vector<3, S>& p, Matrix<1, 3, S>* by_p = nullptr) const {
    using std::exp;
    const S P = exp(-minus_log_probability(p, by_p));
    if (by_p) *by_p *= -P;
    return P;
  }

  template <Over<SE3> C, Over<SE3> T, Over<Rn<1>> G>
  void operator()(const C& c, const T& t, const G& g, Rows<1, C>& r, RowsBy<1, C>* Jc = nullptr,
                  RowsBy<1, T>* Jt = nullptr, RowsBy<1, G>* Jg = nullptr) const {
    using S = typename C::Scalar;
    using std::sqrt;
    S root(0.0);
    const auto measure = [&](const Vector<3, S>& p, Matrix<1, 3, S>* by_p) {
      root = sqrt(minus_log_probability(p, by_p));
      // If P rounds to 1, the derivative is zero.
      if (by_p) *by_p *= root > S(0.0) ? S(0.5) * g.vector()[0] / root : S(0.0);
      return Rows<1, C>(g.vector()[0] * root);
    };
    observe<1>(c, t, sight.B, sight.beacon, measure, r, Jc, Jt);
    if (Jg) (*Jg)(0, 0) = root;
  }

 private:
  /// Returns −ln P and fills its derivative if `by_p` is not null.
  template <class S>
  S minus_log_probability(const Vector<3, S>& p, Matrix<1, 3, S>* by_p) const {
    using std::exp;
    using std::log1p;
    using std::sqrt;
    const S distance = sqrt(p.squaredNorm() + S(kRounding * kRounding)), along = p[0] / distance;
    const S within = (S(sight.range) - distance) / S(sight.range_fade);
    const S aside = (along - S(std::cos(sight.half_angle))) / S(sight.cosine_fade);
    const auto minus_log = [](const S& s) {  // −ln ℓ(s), without overflow
      return s > S(0.0) ? log1p(exp(-s)) : log1p(exp(s)) - s;
    };
    if (by_p) {
      const auto complement = [](const S& s) {  // 1 − ℓ(s) = −d(minus_log)/ds
        return s > S(0.0) ? exp(-s) / (S(1.0) + exp(-s)) : S(1.0) / (S(1.0) + exp(s));
      };
      const Matrix<1, 3, S> by_distance = p.transpose() / distance;
      Matrix<1, 3, S> by_along = -along * by_distance;
      by_along(0, 0) += S(1.0);
      *by_p = complement(within) / S(sight.range_fade) * by_distance -
              complement(aside) / (S(sight.cosine_fade) * distance) * by_along;
    }
    return minus_log(within) + minus_log(aside);
  }
};

}  // namespace tandem
