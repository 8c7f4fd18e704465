#pragma once

#include <tandem/residuals/imu_prediction.hpp>

namespace tandem {

/// Preintegrated inertial measurements between two keyframes: difference between the state at j and the state predicted
/// from i, (R̂, p̂, v̂) = predict(X_i, v_i, b_i, delta, earth) [m, m/s, rad, m/s², rad/s],
///
///   e = [R_jᵀ (p_j − p̂);  R_jᵀ (v_j − v̂);  Log(R̂ᵀ R_j);  b_j − b_i]
///
/// The rows are along the body axes at j, except for the biases (sensor axes). States: pose, world velocity and biases
/// [accelerometer; gyroscope] at i, then at j. The covariance is ImuPreintegrator::covariance(). Source: Forster et al.
/// 2017, eqs. 45-47, with position and velocity errors expressed at j.
struct PreintegratedImu {
  static constexpr std::string_view name = "preintegrated IMU";
  static constexpr int dim = 15;
  using States = std::tuple<SE3, R3, Rn<6>, SE3, R3, Rn<6>>;

  ImuDelta delta;
  Earth earth{};

  auto fields() { return std::tie(delta, earth); }

  template <Over<SE3> X, Over<R3> V, Over<Rn<6>> B>
  void operator()(const X& xi, const V& vi, const B& bi, const X& xj, const V& vj, const B& bj, Rows<15, X>& r,
                  RowsBy<15, X>* Jxi = nullptr, RowsBy<15, V>* Jvi = nullptr, RowsBy<15, B>* Jbi = nullptr,
                  RowsBy<15, X>* Jxj = nullptr, RowsBy<15, V>* Jvj = nullptr, RowsBy<15, B>* Jbj = nullptr) const {
    using S = typename X::Scalar;
    using Rotation = BasicSO3<S>;
    ImuPredictionJacobians<S> by;
    const bool from_i = Jxi || Jvi || Jbi;
    const ImuPrediction<S> at_j = predict(xi, vi, bi, delta, earth, from_i ? &by : nullptr);
    const Matrix<3, 3, S> to_body = xj.rotation().inverse().matrix();
    const Rotation turn = at_j.pose.rotation().inverse() * xj.rotation();
    const Vector<3, S> p = to_body * (xj.translation() - at_j.pose.translation());
    const Vector<3, S> v = to_body * (vj.vector() - at_j.velocity.vector());
    const Vector<3, S> theta = turn.Log();
    r << p, v, theta, bj.vector() - bi.vector();

    if (from_i) {
      const Matrix<3, 3, S> by_position = -turn.inverse().matrix(), by_rotation = -Rotation::Jl_inverse(theta);
      if (Jxi) {
        Jxi->template topRows<3>().noalias() = by_position * by.pose_by_pose.template topRows<3>();
        Jxi->template middleRows<3>(3).noalias() = -to_body * by.velocity_by_pose;
        Jxi->template middleRows<3>(6).noalias() = by_rotation * by.pose_by_pose.template bottomRows<3>();
        Jxi->template bottomRows<6>().setZero();
      }
      if (Jvi) {
        Jvi->template topRows<3>().noalias() = by_position * by.pose_by_velocity.template topRows<3>();
        Jvi->template middleRows<3>(3).noalias() = -to_body * by.velocity_by_velocity;
        Jvi->template bottomRows<9>().setZero();
      }
      if (Jbi) {
        Jbi->template topRows<3>().noalias() = by_position * by.pose_by_bias.template topRows<3>();
        Jbi->template middleRows<3>(3).noalias() = -to_body * by.velocity_by_bias;
        Jbi->template middleRows<3>(6).noalias() = by_rotation * by.pose_by_bias.template bottomRows<3>();
        Jbi->template bottomRows<6>() = -Matrix<6, 6, S>::Identity();
      }
    }
    if (Jxj) {
      Jxj->setZero();
      Jxj->template topLeftCorner<3, 3>().setIdentity();
      Jxj->template block<3, 3>(0, 3) = skew(p);
      Jxj->template block<3, 3>(3, 3) = skew(v);
      Jxj->template block<3, 3>(6, 3) = Rotation::Jr_inverse(theta);
    }
    if (Jvj) *Jvj << Matrix<3, 3, S>::Zero(), to_body, Matrix<9, 3, S>::Zero();
    if (Jbj) *Jbj << Matrix<9, 6, S>::Zero(), Matrix<6, 6, S>::Identity();
  }
};

}  // namespace tandem
