#pragma once

#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include <tandem/lie/inverse_jacobian_product.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/residuals/white_noise_acceleration.hpp>

/// States between keyframes by the interpolation of a motion prior.
namespace tandem {

/// Pose and twist at an instant, as a function of the states that they depend on.
template <LieGroup G>
struct InterpolatedMotion {
  G pose;
  Vector<G::dof> twist;  ///< in the body at the instant [units of the tangent per s]
  /// Jacobian of [pose; twist] with respect to right perturbations of the states, side by side.
  Eigen::MatrixXd jacobian;
  /// Covariance of [pose; twist] if the states are known exactly.
  Matrix<2 * G::dof, 2 * G::dof> bridge = Matrix<2 * G::dof, 2 * G::dof>::Zero();
};

namespace detail {

/// Derivative of Jr(ξ) v with respect to ξ, by central differences.
template <LieGroup G>
typename G::Jacobian derivative_of_Jr_times(const typename G::Tangent& xi, const typename G::Tangent& v) {
  constexpr double h = 1e-6;
  typename G::Jacobian D;
  for (int i = 0; i < G::dof; ++i) {
    const typename G::Tangent step = h * G::Tangent::Unit(i);
    D.col(i) = (G::Jr(xi + step) * v - G::Jr(xi - step) * v) / (2 * h);
  }
  return D;
}

/// Returns the motion at T0 ⊕ ξ. `by_states` are the derivatives of [ξ; ξ̇] with respect to the states, the first of
/// which is T0. `bridge` is the covariance of [ξ; ξ̇].
template <LieGroup G>
InterpolatedMotion<G> motion_at(const G& origin, const typename G::Tangent& xi, const typename G::Tangent& rate,
                                const Eigen::MatrixXd& by_states, const Matrix<2 * G::dof, 2 * G::dof>& bridge,
                                Eigen::Index origin_column) {
  constexpr int n = G::dof;
  const G step = G::Exp(xi);
  const typename G::Jacobian Jr = G::Jr(xi);
  Matrix<2 * n, 2 * n> turn = Matrix<2 * n, 2 * n>::Zero();
  turn.template topLeftCorner<n, n>() = Jr;
  turn.template bottomLeftCorner<n, n>() = derivative_of_Jr_times<G>(xi, rate);
  turn.template bottomRightCorner<n, n>() = Jr;
  InterpolatedMotion<G> motion{origin * step, Jr * rate, turn * by_states, turn * bridge * turn.transpose()};
  motion.jacobian.block(0, origin_column, n, n) += step.inverse().Ad();
  return motion;
}

}  // namespace detail

/// Interpolates with a constant twist between two poses, dt [s] apart, `after` [s] after the first one. States: x0, x1.
/// The prior does not describe the motion between the poses, so `bridge` is zero.
template <LieGroup G>
InterpolatedMotion<G> interpolate_constant_twist(const G& x0, const G& x1, double dt, double after) {
  constexpr int n = G::dof;
  const typename G::Tangent d = minus(x1, x0);
  const InverseJacobians<G> at_d(d);
  Eigen::MatrixXd by(2 * n, 2 * n);
  by << -after / dt * at_d.left, after / dt * at_d.right, -1 / dt * at_d.left, 1 / dt * at_d.right;
  return detail::motion_at<G>(x0, after / dt * d, d / dt, by, Matrix<2 * n, 2 * n>::Zero(), 0);
}

/// Odometry at both ends of an interval and at an instant in it.
template <LieGroup G>
struct OdometryAt {
  G begin, instant, end;
  typename G::Tangent twist;  ///< in the body at the instant [units of the tangent per s]
};

/// Interpolates along odometry between two poses, dt [s] apart, `after` [s] after the first one. The errors of the
/// odometry are a random walk with the root spectral densities `sigma` on the axes of the body. States: x0, x1.
///
/// The path of the odometry is moved to x0. Its misclosure at x1 is distributed linearly in time:
/// T(t) = X0 O0⁻¹ Exp(after/dt · ε) O(t) with ε = Log(O0 X0⁻¹ X1 O1⁻¹), the Brownian bridge. It is exact if the group
/// is Rⁿ. The random walk has no twist, so that of the result is the twist of the odometry plus the mean correction.
template <LieGroup G>
InterpolatedMotion<G> interpolate_along_odometry(const G& x0, const G& x1, const OdometryAt<G>& odometry,
                                                 const Vector<G::dof>& sigma, double dt, double after) {
  constexpr int n = G::dof;
  const double share = after / dt;
  const G misclosure = odometry.begin * x0.inverse() * x1 * odometry.end.inverse();
  const typename G::Tangent correction = misclosure.Log();
  const InverseJacobians<G> at_correction(correction);
  const G corrected = G::Exp(share * correction) * odometry.instant;
  const typename G::Jacobian to_instant = odometry.instant.inverse().Ad();
  InterpolatedMotion<G> motion{x0 * odometry.begin.inverse() * corrected, odometry.twist + to_instant * correction / dt,
                               Eigen::MatrixXd::Zero(2 * n, 2 * n)};
  const typename G::Jacobian by_x0 = -at_correction.left * odometry.begin.Ad();
  const typename G::Jacobian by_x1 = at_correction.right * odometry.end.Ad();
  const typename G::Jacobian of_pose = share * to_instant * G::Jr(share * correction);
  motion.jacobian.block(0, 0, n, n) = of_pose * by_x0 + (odometry.begin.inverse() * corrected).inverse().Ad();
  motion.jacobian.block(0, n, n, n) = of_pose * by_x1;
  motion.jacobian.block(n, 0, n, n) = to_instant * by_x0 / dt;
  motion.jacobian.block(n, n, n, n) = to_instant * by_x1 / dt;
  motion.bridge.diagonal().template head<n>() = sigma.cwiseAbs2() * after * (1 - share);
  return motion;
}

/// Interpolates with WhiteNoiseAcceleration between two poses and twists, dt [s] apart, `after` [s] after the first
/// one. `densities` are the power spectral densities of the acceleration on the axes of the twist. States: x0, w0, x1,
/// w1.
///
/// In the coordinates ξ(t) = Log(T0⁻¹ T(t)), the mean is cubic in time, and the posterior is exact if the group is Rⁿ.
/// Source: Anderson & Barfoot 2015, "Full STEAM ahead", eq. 19, for right perturbations.
template <LieGroup G>
InterpolatedMotion<G> interpolate_white_noise(const G& x0, const Rn<G::dof>& w0, const G& x1, const Rn<G::dof>& w1,
                                              const Vector<G::dof>& densities, double dt, double after) {
  constexpr int n = G::dof;
  using Pair = Matrix<2, 2>;
  const auto transition = [](double t) { return Pair{{1, t}, {0, 1}}; };
  const auto noise = [](double t) { return Pair{{t * t * t / 3, t * t / 2}, {t * t / 2, t}}; };
  const Pair to_end = transition(dt - after);
  const Pair gain = noise(after) * to_end.transpose() * noise(dt).inverse();  // Ψ
  const Pair own = transition(after) - gain * transition(dt);                 // Λ
  const Pair left = noise(after) - gain * to_end * noise(after);

  const typename G::Tangent d = minus(x1, x0);
  typename G::Jacobian by_d;
  const typename G::Tangent rate = Jr_inverse_times<G>(d, w1.vector(), &by_d);
  const InverseJacobians<G> at_d(d);
  const auto mixed = [&](int row) ->
      typename G::Tangent { return own(row, 1) * w0.vector() + gain(row, 0) * d + gain(row, 1) * rate; };
  Eigen::MatrixXd by = Eigen::MatrixXd::Zero(2 * n, 4 * n);
  Matrix<2 * n, 2 * n> bridge = Matrix<2 * n, 2 * n>::Zero();
  for (int row = 0; row < 2; ++row) {
    const typename G::Jacobian of_d = gain(row, 0) * G::Jacobian::Identity() + gain(row, 1) * by_d;
    by.block(row * n, 0, n, n) = -of_d * at_d.left;
    by.block(row * n, n, n, n).diagonal().setConstant(own(row, 1));
    by.block(row * n, 2 * n, n, n) = of_d * at_d.right;
    by.block(row * n, 3 * n, n, n) = gain(row, 1) * at_d.right;
    for (int column = 0; column < 2; ++column)
      bridge.template block<n, n>(row * n, column * n).diagonal() = left(row, column) * densities;
  }
  return detail::motion_at<G>(x0, mixed(0), mixed(1), by, bridge, 0);
}

/// Interpolates with a body twist that is an Ornstein–Uhlenbeck process (DampedTwist), between consecutive poses.
///
/// `x` are two to four poses at increasing times `t` [s]; the instant lies between the poses `k` and k + 1. `sigma` are
/// root spectral densities, `time_constants` τ [s], one per component. States: x.
///
/// In the coordinates Log(T_k⁻¹ T(t)), the displacement and the twist are conditioned on those between the poses. The
/// result is that of Gaussian-process regression with exactly these poses, which is exact if the group is Rⁿ and the
/// other poses are far away in terms of τ.
template <LieGroup G>
InterpolatedMotion<G> interpolate_damped(const std::vector<G>& x, const std::vector<double>& t, std::size_t k,
                                         const Vector<G::dof>& sigma, const Vector<G::dof>& time_constants,
                                         double instant) {
  constexpr int n = G::dof;
  constexpr double kLongest =
      1e3;  // maximum τ over the time between the poses; more is a constant twist up to rounding
  const auto count = static_cast<Eigen::Index>(x.size());
  std::vector<typename G::Tangent> d;
  for (const G& pose : x) d.push_back(minus(pose, x[k]));
  // Weights of the displacements between the poses, for the displacement since pose k and for the twist.
  std::array<Eigen::MatrixXd, 2> weights{Eigen::MatrixXd(n, count - 1), Eigen::MatrixXd(n, count - 1)};
  Matrix<2 * n, 2 * n> bridge = Matrix<2 * n, 2 * n>::Zero();
  for (int i = 0; i < n; ++i) {
    const double tau = std::min(time_constants[i], kLongest * (t.back() - t.front()));
    const double variance = 0.5 * sigma[i] * sigma[i] * tau;
    const auto grown = [&](double h) { return -std::expm1(-h / tau); };  // 1 − exp(−h/τ)
    const auto between = [&](double a, double b, double c, double e) {  // covariance of ∫ over [a, b] and [c, e], b ≤ c
      return variance * tau * tau * grown(b - a) * grown(e - c) * std::exp(-(c - b) / tau);
    };
    const auto within = [&](double h) { return 2 * variance * tau * tau * (h / tau - grown(h)); };
    Eigen::MatrixXd S(count - 1, count - 1), cross(2, count - 1);
    for (Eigen::Index a = 0; a + 1 < count; ++a) {
      const double begin = t[std::size_t(a)], end = t[std::size_t(a) + 1], start = t[k];
      S(a, a) = within(end - begin);
      for (Eigen::Index b = a + 1; b + 1 < count; ++b)
        S(a, b) = S(b, a) = between(begin, end, t[std::size_t(b)], t[std::size_t(b) + 1]);
      if (end <= start) {
        cross(0, a) = between(begin, end, start, instant);
        cross(1, a) = variance * tau * grown(end - begin) * std::exp(-(instant - end) / tau);
      } else if (begin > start) {
        cross(0, a) = between(start, instant, begin, end);
        cross(1, a) = variance * tau * grown(end - begin) * std::exp(-(begin - instant) / tau);
      } else {
        cross(0, a) = within(instant - start) + between(start, instant, instant, end);
        cross(1, a) = variance * tau * (grown(instant - begin) + grown(end - instant));
      }
    }
    const Eigen::LDLT<Eigen::MatrixXd> root(S);
    const Eigen::MatrixXd gain = root.solve(cross.transpose()).transpose();
    for (int row = 0; row < 2; ++row) weights[std::size_t(row)].row(i) = gain.row(row);
    Matrix<2, 2> prior{{within(instant - t[k]), variance * tau * grown(instant - t[k])}, {0, variance}};
    prior(1, 0) = prior(0, 1);
    const Matrix<2, 2> left = prior - gain * cross.transpose();
    for (int row = 0; row < 2; ++row)
      for (int column = 0; column < 2; ++column) bridge(row * n + i, column * n + i) = left(row, column);
  }

  std::array<typename G::Tangent, 2> value{G::Tangent::Zero(), G::Tangent::Zero()};
  Eigen::MatrixXd by = Eigen::MatrixXd::Zero(2 * n, n * count);
  for (Eigen::Index j = 0; j < count; ++j) {
    if (j == Eigen::Index(k)) continue;
    const InverseJacobians<G> at_d(d[std::size_t(j)]);
    for (int row = 0; row < 2; ++row) {
      // Pose j ends one displacement and starts the next one; its derivative has a term for each.
      typename G::Tangent weight = G::Tangent::Zero();
      if (j > 0) weight += weights[std::size_t(row)].col(j - 1);
      if (j + 1 < count) weight -= weights[std::size_t(row)].col(j);
      value[std::size_t(row)] += weight.cwiseProduct(d[std::size_t(j)]);
      by.block(row * n, j * n, n, n) += weight.asDiagonal() * at_d.right;
      by.block(row * n, Eigen::Index(k) * n, n, n) -= weight.asDiagonal() * at_d.left;
    }
  }
  return detail::motion_at<G>(x[k], value[0], value[1], by, bridge, Eigen::Index(k) * n);
}

}  // namespace tandem
