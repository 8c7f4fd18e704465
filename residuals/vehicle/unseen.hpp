#pragma once

#include <cmath>
#include <numbers>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/residuals/sensor_frame.hpp>

namespace tandem {

/// Within which a sensor, a camera mostly, sees a target, and how gradually it ceases to: at the range, and at the half
/// angle off its axis, half of the fixes come.
struct Sight {
  double range = 9.0;                        ///< m
  double range_fade = 1.0;                   ///< m
  double half_angle = std::numbers::pi / 4;  ///< about x of the sensor's frame [rad]
  double cosine_fade = 0.05;                 ///< of the cosine of the angle off the axis
  SE3 B{};                                   ///< sensor in the body that carries it
  Vector<3> beacon = Vector<3>::Zero();      ///< what is seen, in the target's body [m]
};

/// How far a target is from being seen:
///
///   e = g √(−ln P),   P = ℓ((range − ρ)/range_fade) ℓ((p_x/ρ − cos half_angle)/cosine_fade),   ℓ(s) = 1/(1 + exp(−s)),
///
/// p = t((C B)⁻¹ (T F)), ρ = √(‖p‖² + ε²), ε = 1 cm. P is the probability of a fix; with g² = 2 nats of what a fix would
/// tell, ½ e² bounds what is expected to be missed of that from above, since −ln P ≥ 1 − P, closely where P is nearly 1.
/// Unlike 1 − P it keeps its slope out of sight: it grows as the distance beyond the range does, and as the cosine falls.
/// No units. It is smooth everywhere, the sensor itself included.
/// States: the pose of what carries the sensor, the target's pose, g.
struct Unseen {
  static constexpr std::string_view name = "unseen";
  static constexpr int dim = 1;
  static constexpr double kRounding = 0.01;  ///< ε [m]
  using States = std::tuple<SE3, SE3, Rn<1>>;

  Sight sight{};

  /// P, and dP/dp where it is asked for.
  template <class S>
  S probability(const Vector<3, S>& p, Matrix<1, 3, S>* by_p = nullptr) const {
    using std::exp;
    const S P = exp(-surprise(p, by_p));
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
      root = sqrt(surprise(p, by_p));
      // P = 1 to all digits: flat
      if (by_p) *by_p *= root > S(0.0) ? S(0.5) * g.vector()[0] / root : S(0.0);
      return Rows<1, C>(g.vector()[0] * root);
    };
    observe<1>(c, t, sight.B, sight.beacon, measure, r, Jc, Jt);
    if (Jg) (*Jg)(0, 0) = root;
  }

 private:
  /// −ln P and its derivative.
  template <class S>
  S surprise(const Vector<3, S>& p, Matrix<1, 3, S>* by_p) const {
    using std::exp;
    using std::log1p;
    using std::sqrt;
    const S distance = sqrt(p.squaredNorm() + S(kRounding * kRounding)), along = p[0] / distance;
    const S within = (S(sight.range) - distance) / S(sight.range_fade);
    const S aside = (along - S(std::cos(sight.half_angle))) / S(sight.cosine_fade);
    const auto minus_log = [](const S& s) {  // of ℓ(s), s of either sign
      return s > S(0.0) ? log1p(exp(-s)) : log1p(exp(s)) - s;
    };
    if (by_p) {
      const auto complement = [](const S& s) {  // 1 − ℓ(s), minus_log's slope but for its sign
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
