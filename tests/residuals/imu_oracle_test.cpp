// Preintegration and its residual against an independent implementation.

#include <fstream>
#include <iostream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/residuals/imu_preintegration.hpp>
#include <tandem/residuals/preintegrated_imu.hpp>

#include "shared_data.hpp"

namespace tandem {
namespace {

/// It takes a sample's specific force to be constant along the axes at the start of an interval, and its covariance is of
/// [rotation vector; position; velocity] of the deltas, along the axes at their start, with noise on the biases' walk of
/// the opposite sign to its residual's. Its residual is the prediction less the state.
class ImuOracle : public ::testing::Test {
 protected:
  void SetUp() override {
    TANDEM_NEEDS_SHARED(20);
    std::ifstream file(shared_path("reference/imu_preintegration.json"));
    ASSERT_TRUE(file) << "cannot read " << shared_path("reference/imu_preintegration.json");
    json_ = nlohmann::json::parse(file);
    const auto sigma = [&](const char* name) { return json_.at("sigma").at(name).get<double>(); };
    const ImuNoise noise{sigma("accelerometer_m_s2_per_sqrt_hz"), sigma("gyroscope_rad_s_per_sqrt_hz"),
                         sigma("accelerometer_bias_random_walk"), sigma("gyroscope_bias_random_walk"),
                         sigma("integration")};
    const SE3 mount(SO3(read<3, 3>("body_R_imu")), read<3, 1>("body_t_imu_m"));
    sum_ = ImuPreintegrator(mount, noise, read<6, 1>("bias_hat_accel_gyro"), ImuHold::at_start);
    const auto& samples = json_.at("samples_accel_gyro");
    ASSERT_EQ(samples.size(), 100u);
    for (const auto& sample : samples) {
      Vector<6> s;
      for (int k = 0; k < 6; ++k) s[k] = sample.at(std::size_t(k)).get<double>();
      sum_.integrate(s.head<3>(), s.tail<3>(), json_.at("dt_s").get<double>());
    }
    earth_.gravity = read<3, 1>("gravity_m_s2");
  }

  template <int N, int M>
  Matrix<N, M> read(const std::string& name) const {
    const nlohmann::json& rows = json_.at(name);
    EXPECT_EQ(rows.size(), std::size_t(N)) << name;
    Matrix<N, M> m;
    for (int i = 0; i < N; ++i)
      for (int k = 0; k < M; ++k) {
        const nlohmann::json& row = rows.at(std::size_t(i));
        m(i, k) = (M == 1 ? row : row.at(std::size_t(k))).template get<double>();
      }
    return m;
  }
  /// Its rows in our order and sign.
  template <int M>
  static Matrix<15, M> ours(const Matrix<15, M>& theirs) {
    Matrix<15, M> m;
    m << -theirs.template middleRows<6>(3), -theirs.template topRows<3>(), -theirs.template bottomRows<6>();
    return m;
  }
  /// A pose's columns, which it has in the order of rotation and translation.
  static Matrix<15, 6> ours_of_pose(const Matrix<15, 6>& theirs) {
    Matrix<15, 6> m;
    m << theirs.rightCols<3>(), theirs.leftCols<3>();
    return ours<6>(m);
  }
  SE3 pose(const char* R, const char* p) const { return SE3(SO3(read<3, 3>(R)), read<3, 1>(p)); }

  nlohmann::json json_;
  ImuPreintegrator sum_{SE3(), ImuNoise{}};
  Earth earth_;
};

TEST_F(ImuOracle, has_the_same_deltas) {
  const ImuDelta& delta = sum_.delta();
  EXPECT_NEAR(delta.dt, 1.0, 1e-14);
  // Its integration on the manifold is ours; that in the tangent space approximates some more.
  EXPECT_LE((delta.R.matrix() - read<3, 3>("delta_R_manifold")).norm(), 1e-13);
  EXPECT_LE((delta.p - read<3, 1>("delta_p_manifold")).norm(), 1e-13);
  EXPECT_LE((delta.v - read<3, 1>("delta_v_manifold")).norm(), 1e-13);
  EXPECT_LE((delta.R.matrix() - read<3, 3>("delta_R_tangent")).norm(), 1e-4);
  EXPECT_LE((delta.p - read<3, 1>("delta_p_tangent")).norm(), 1e-4);
  EXPECT_LE((delta.v - read<3, 1>("delta_v_tangent")).norm(), 1e-4);
}

TEST_F(ImuOracle, predicts_the_same_state) {
  // It does so at the bias of the deltas.
  const ImuPrediction<> at =
      predict(pose("Ri", "pi"), R3(read<3, 1>("vi")), Rn<6>(read<6, 1>("bias_hat_accel_gyro")), sum_.delta(), earth_);
  EXPECT_LE((at.pose.rotation().matrix() - read<3, 3>("predict_R")).norm(), 1e-4);
  EXPECT_LE((at.pose.translation() - read<3, 1>("predict_p")).norm(), 1e-4);
  EXPECT_LE((at.velocity.vector() - read<3, 1>("predict_v")).norm(), 1e-4);
}

TEST_F(ImuOracle, has_the_same_residual_and_jacobians) {
  Vector<15> r;
  Matrix<15, 6> xi, bi, xj, bj;
  Matrix<15, 3> vi, vj;
  PreintegratedImu{sum_.delta(), earth_}(pose("Ri", "pi"), R3(read<3, 1>("vi")), Rn<6>(read<6, 1>("bi")),
                                         pose("Rj", "pj"), R3(read<3, 1>("vj")), Rn<6>(read<6, 1>("bj")), r, &xi, &vi,
                                         &bi, &xj, &vj, &bj);
  EXPECT_LE((r - ours<1>(read<15, 1>("residual_rot_pos_vel_ba_bg"))).cwiseAbs().maxCoeff(), 1e-4);
  const auto relative = [](const auto& given, const auto& expected) {
    return (given - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
  };
  EXPECT_LE(relative(xi, ours_of_pose(read<15, 6>("J_xi_rot_trans"))), 1e-4);
  EXPECT_LE(relative(vi, ours<3>(read<15, 3>("J_vi"))), 1e-12);
  EXPECT_LE(relative(bi, ours<6>(read<15, 6>("J_bi"))), 1e-4);
  EXPECT_LE(relative(xj, ours_of_pose(read<15, 6>("J_xj_rot_trans"))), 1e-4);
  EXPECT_LE(relative(vj, ours<3>(read<15, 3>("J_vj"))), 1e-12);
  EXPECT_LE(relative(bj, ours<6>(read<15, 6>("J_bj"))), 1e-12);
}

TEST_F(ImuOracle, has_the_same_covariance) {
  const Matrix<15, 15> theirs = read<15, 15>("covariance_rot_pos_vel_ba_bg");
  // Ours along the axes of its, in its order and with its sign of the biases.
  const SO3& R = sum_.delta().R;
  Matrix<15, 15> M = Matrix<15, 15>::Zero();
  M.block<3, 3>(0, 6) = SO3::Jr_inverse(R.Log());
  M.block<3, 3>(3, 0) = R.matrix();
  M.block<3, 3>(6, 3) = R.matrix();
  M.bottomRightCorner<6, 6>() = -Matrix<6, 6>::Identity();
  const Matrix<15, 15> given = M * sum_.covariance() * M.transpose();
  // Entry by entry over their rows' standard deviations; and block by block where it matters, without the biases, whose
  // correlations it takes to one step in a hundred.
  const Vector<15> sigma = theirs.diagonal().cwiseSqrt();
  EXPECT_LE((given - theirs).cwiseQuotient(sigma * sigma.transpose()).cwiseAbs().maxCoeff(), 1e-3);
  const auto of_block = [&](int i, int k) {
    const Matrix<3, 3> block = theirs.block<3, 3>(i, k);
    return (given.block<3, 3>(i, k) - block).norm() / block.norm();
  };
  double worst = 0.0;
  for (int i = 0; i < 9; i += 3)
    for (int k = 0; k < 9; k += 3) worst = std::max(worst, of_block(i, k));
  EXPECT_LE(worst, 1e-3);
  for (int i = 0; i < 9; i += 3)
    for (int k = 9; k < 15; k += 3) {
      if (i == 0 && k == 9) continue;  // the accelerometer's bias does not turn anything: zero in both
      EXPECT_LE(of_block(i, k), 2.5e-2) << i << " " << k;
    }
  EXPECT_EQ((given.block<3, 3>(0, 9).norm()), 0.0);
  std::cout << "covariance: blocks off by " << worst << '\n';
}

}  // namespace
}  // namespace tandem
