#pragma once

#include <tuple>

#include <tandem/residuals/propagated.hpp>

namespace tandem {

/// A residual f(X) = h − z or f(X, v) = h − z of one of the chaser's own sensors with calibration errors as states:
///
///   e = (1 + s) (f(X', v') + z) − z + b,   X' = X(t − τ) rotated by A,   v' = v(t − τ),   A = R_bs M R_bs⁻¹
///
/// The bias b has the rows and units of f. The scale factor error s requires that f gives its measurement z by
/// `reading()`. The misalignment M is a rotation on the mount R_bs, and τ is the age of the measurement at the time t
/// [s]. The state is predicted to t as in Propagated. From there the rate ω and the specific force a are constant along
/// the body axes:
///
///   R(t − τ) = R Exp(−τ ω),   v(t − τ) = v − τ (R a + g),   p(t − τ) = p − τ v + τ²/2 (R a + g)
///
/// States: pose, world velocity and inertial biases at the keyframe, then b, s, M, τ. With b = s = τ = 0 and M = I it
/// equals Propagated<R>.
template <class R>
struct MiscalibratedEgo {
  static constexpr std::string_view name = R::name;
  static constexpr int dim = R::dim;
  static constexpr bool reads_velocity = detail::reads_velocity<R>();
  using States = std::tuple<SE3, R3, Rn<6>, Rn<dim>, Rn<1>, SO3, Rn<1>>;

  R residual;
  SO3 mount{};       ///< R_bs, sensor in the body
  ImuDelta ahead{};  ///< motion from the keyframe to t; by default none: t is the time of the keyframe
  Earth earth{};
  Vector<3> rate = Vector<3>::Zero();   ///< ω at t, rad/s
  Vector<3> force = Vector<3>::Zero();  ///< a at t, m/s²

  auto fields() { return std::tie(residual, mount, ahead, earth, rate, force); }

  template <Over<SE3> X, Over<R3> V, Over<Rn<6>> B, Over<Rn<dim>> E, Over<Rn<1>> F, Over<SO3> M>
  void operator()(const X& x, const V& v, const B& imu_bias, const E& bias, const F& scale, const M& turn,
                  const F& delay, Rows<dim, X>& r, RowsBy<dim, X>* Jx = nullptr, RowsBy<dim, V>* Jv = nullptr,
                  RowsBy<dim, B>* Jimu = nullptr, RowsBy<dim, E>* Jbias = nullptr, RowsBy<dim, F>* Jscale = nullptr,
                  RowsBy<dim, M>* Jturn = nullptr, RowsBy<dim, F>* Jdelay = nullptr) const {
    using S = typename X::Scalar;
    using Square = Matrix<3, 3, S>;
    const bool wanted = Jx || Jv || Jimu || Jturn || Jdelay;
    const S tau = delay.vector()[0];
    ImuPredictionJacobians<S> by;
    const ImuPrediction<S> at = predict(x, v, imu_bias, ahead, earth, wanted ? &by : nullptr);

    const Vector<3, S> w = rate.template cast<S>(), a = force.template cast<S>();
    const BasicSO3<S>& Rt = at.pose.rotation();
    const Vector<3, S> fall = Rt.act(a) + earth.gravity.template cast<S>(), vt = at.velocity.vector();
    const BasicSO3<S> back = BasicSO3<S>::Exp(-tau * w), R_then = Rt * back;
    const Vector<3, S> v_then = vt - tau * fall;
    const BasicSO3<S> R_mount = mount.template cast<S>(), turned = R_mount * turn * R_mount.inverse();
    const X pose(R_then * turned, at.pose.translation() - tau * vt + S(0.5) * tau * tau * fall);
    const V velocity(v_then);

    RowsBy<dim, X> by_pose;
    RowsBy<dim, V> by_velocity = RowsBy<dim, V>::Zero();
    if constexpr (reads_velocity)
      residual(pose, velocity, r, wanted ? &by_pose : nullptr, wanted ? &by_velocity : nullptr);
    else
      residual(pose, r, wanted ? &by_pose : nullptr);

    S factor(1.);
    if constexpr (requires { residual.reading(); }) {
      const Rows<dim, X> z = residual.reading().template cast<S>(), h = r + z;
      factor += scale.vector()[0];
      r = factor * h - z;
      if (Jscale) *Jscale = h;
    } else {
      if (Jscale) Jscale->setZero();
    }
    r += bias.vector();
    if (Jbias) Jbias->setIdentity();
    if (!wanted) return;

    by_pose *= factor;
    by_velocity *= factor;
    const Square to_then = R_then.inverse().matrix(), unturn = turned.inverse().matrix(), falls = Rt.matrix() * skew(a);
    RowsBy<dim, X> by_then;  // derivative by the pose at t − τ, before the rotation by A
    by_then << by_pose.template leftCols<3>() * unturn, by_pose.template rightCols<3>() * unturn;
    const Matrix<dim, 3, S> by_p = by_then.template leftCols<3>() * to_then;  // along the world axes
    RowsBy<dim, X> by_at;                                                     // derivative by the pose at t
    by_at << by_p * Rt.matrix(), by_then.template rightCols<3>() * back.inverse().matrix() -
                                     S(0.5) * tau * tau * by_p * falls + tau * by_velocity * falls;
    const RowsBy<dim, V> by_v = by_velocity - tau * by_p;
    if (Jx) Jx->noalias() = by_at * by.pose_by_pose + by_v * by.velocity_by_pose;
    if (Jv) Jv->noalias() = by_at * by.pose_by_velocity + by_v * by.velocity_by_velocity;
    if (Jimu) Jimu->noalias() = by_at * by.pose_by_bias + by_v * by.velocity_by_bias;
    if (Jturn) Jturn->noalias() = by_pose.template rightCols<3>() * R_mount.matrix();
    if (Jdelay) *Jdelay = -(by_p * v_then) - by_then.template rightCols<3>() * w - by_velocity * fall;
  }
};

}  // namespace tandem
