#pragma once

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/earth.hpp>
#include <tandem/residuals/imu_delta.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Pose and velocity in the world [m, rad; m/s].
template <class S = double>
struct ImuPrediction {
  BasicSE3<S> pose;
  BasicRn<3, S> velocity;
};

/// Jacobians of a prediction with respect to right perturbations of its initial state.
template <class S = double>
struct ImuPredictionJacobians {
  Matrix<6, 6, S> pose_by_pose;
  Matrix<6, 3, S> pose_by_velocity;
  Matrix<6, 6, S> pose_by_bias;
  Matrix<3, 6, S> velocity_by_pose;
  Matrix<3, 3, S> velocity_by_velocity;
  Matrix<3, 6, S> velocity_by_bias;
};

/// Predicts pose and velocity after delta.dt from preintegrated inertial measurements. The pose, the world velocity
/// [m/s] and the biases [accelerometer; gyroscope] [m/s², rad/s] refer to the start. R, v, p are the deltas corrected
/// to first order in bias − delta.bias. ω is the Earth's rate, W = [ω]×, g gravity and dt = delta.dt:
///
///   R_j = Exp(−ω dt) R_i R
///   v_j = (I − 2 dt W) v_i + (I − dt W) R_i v − W R_i p + (dt I − dt² W) g
///   p_j = p_i + (I − dt W) (dt v_i + R_i p) + (dt²/2 I − dt³/3 W) g
///
/// These equations integrate the motion on a rotating Earth to first order in ω, for any f and ΔR (using ∫ t dv = t v −
/// p):
///
///   dv/dt = R f + g − 2 ω × v,   R(t) = Exp(−ω t) R_i ΔR(t)
///
/// Compared with a fine numerical integration, the error is 1e-8 m after 1 s and 1e-4 m after 10 s. Gravity includes
/// the centrifugal acceleration. Source: Lupton & Sukkarieh 2012, §V-C, for the Earth's rotation; Forster et al. 2017,
/// eq. 44, for the biases.
template <class S>
ImuPrediction<S> predict(const BasicSE3<S>& pose, const BasicRn<3, S>& velocity, const BasicRn<6, S>& bias,
                         const ImuDelta& delta, const Earth& earth, ImuPredictionJacobians<S>* J = nullptr) {
  using Rotation = BasicSO3<S>;
  using Square = Matrix<3, 3, S>;
  const double dt = delta.dt;
  const Matrix<3, 3> W = skew(earth.rate), slowed = Matrix<3, 3>::Identity() - dt * W;
  const Vector<3> fall = dt * earth.gravity, drop = 0.5 * dt * fall;
  const Vector<3> v_by_gravity = fall - dt * (W * fall), p_by_gravity = drop - (2.0 / 3.0 * dt) * (W * drop);

  const Vector<6, S> d = bias.vector() - delta.bias.template cast<S>();
  const Vector<3, S> turn = delta.R_by_bias.template cast<S>() * d.template tail<3>();
  const Rotation R = delta.R.template cast<S>() * Rotation::Exp(turn);
  const Vector<3, S> v = delta.v.template cast<S>() + delta.v_by_bias.template cast<S>() * d;
  const Vector<3, S> p = delta.p.template cast<S>() + delta.p_by_bias.template cast<S>() * d;

  const Square Ri = pose.rotation().matrix(), coriolis = W.template cast<S>(), near = slowed.template cast<S>();
  const Square near_Ri = near * Ri, W_Ri = coriolis * Ri;
  const Vector<3, S> vi = velocity.vector();
  const Rotation Rj = Rotation(SO3::Exp(-dt * earth.rate).template cast<S>()) * pose.rotation() * R;
  const Vector<3, S> vj = vi - (2. * dt) * (coriolis * vi) + near_Ri * v - W_Ri * p + v_by_gravity.template cast<S>();
  const Vector<3, S> pj = pose.translation() + dt * (near * vi) + near_Ri * p + p_by_gravity.template cast<S>();
  if (J) {
    const Square to_body = Rj.inverse().matrix(), to_body_near_Ri = to_body * near_Ri;
    const Matrix<3, 6, S> p_by_bias = delta.p_by_bias.template cast<S>(),
                          v_by_bias = delta.v_by_bias.template cast<S>();
    J->pose_by_pose << to_body * Ri, to_body_near_Ri * skew(S(-1.) * p), Square::Zero(), R.inverse().matrix();
    J->pose_by_velocity << dt * (to_body * near), Square::Zero();
    J->pose_by_bias << to_body_near_Ri * p_by_bias, Square::Zero(),
        Rotation::Jr(turn) * delta.R_by_bias.template cast<S>();
    J->velocity_by_pose << Square::Zero(), W_Ri * skew(p) - near_Ri * skew(v);
    J->velocity_by_velocity = Square::Identity() - (2. * dt) * coriolis;
    J->velocity_by_bias = near_Ri * v_by_bias - W_Ri * p_by_bias;
  }
  return {BasicSE3<S>(Rj, pj), BasicRn<3, S>(vj)};
}
// Instantiated in imu_prediction.cpp.
extern template ImuPrediction<double> predict(const SE3&, const R3&, const Rn<6>&, const ImuDelta&, const Earth&,
                                              ImuPredictionJacobians<double>*);

}  // namespace tandem
