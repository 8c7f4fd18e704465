// Preintegration and its residual against an independent implementation (the reference).

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

/// Conventions of the reference: the specific force is constant along the axes at the start of an interval. The
/// covariance is that of the deltas [rotation vector; position; velocity; biases] along their initial axes, with the
/// opposite sign of the bias noise. The residual is prediction minus state.
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
  /// Converts the rows of the reference to Tandem's order and sign.
  template <int M>
  static Matrix<15, M> converted(const Matrix<15, M>& reference) {
    Matrix<15, M> m;
    m << -reference.template middleRows<6>(3), -reference.template topRows<3>(), -reference.template bottomRows<6>();
    return m;
  }
  /// Converts rows and pose columns; the reference orders pose columns as rotation, translation.
  static Matrix<15, 6> converted_pose(const Matrix<15, 6>& reference) {
    Matrix<15, 6> m;
    m << reference.rightCols<3>(), reference.leftCols<3>();
    return converted<6>(m);
  }
  SE3 pose(const char* R, const char* p) const { return SE3(SO3(read<3, 3>(R)), read<3, 1>(p)); }

  nlohmann::json json_;
  ImuPreintegrator sum_{SE3(), ImuNoise{}};
  Earth earth_;
};

TEST_F(ImuOracle, DeltasMatchReference) {
  const ImuDelta& delta = sum_.delta();
  EXPECT_NEAR(delta.dt, 1.0, 1e-14);
  // Tandem also integrates on the manifold. The tangent-space integration of the reference has further approximations.
  EXPECT_LE((delta.R.matrix() - read<3, 3>("delta_R_manifold")).norm(), 1e-13);
  EXPECT_LE((delta.p - read<3, 1>("delta_p_manifold")).norm(), 1e-13);
  EXPECT_LE((delta.v - read<3, 1>("delta_v_manifold")).norm(), 1e-13);
  EXPECT_LE((delta.R.matrix() - read<3, 3>("delta_R_tangent")).norm(), 1e-4);
  EXPECT_LE((delta.p - read<3, 1>("delta_p_tangent")).norm(), 1e-4);
  EXPECT_LE((delta.v - read<3, 1>("delta_v_tangent")).norm(), 1e-4);
}

TEST_F(ImuOracle, PredictionMatchesReference) {
  // The reference predicts at the bias of the deltas.
  const ImuPrediction<> at =
      predict(pose("Ri", "pi"), R3(read<3, 1>("vi")), Rn<6>(read<6, 1>("bias_hat_accel_gyro")), sum_.delta(), earth_);
  EXPECT_LE((at.pose.rotation().matrix() - read<3, 3>("predict_R")).norm(), 1e-4);
  EXPECT_LE((at.pose.translation() - read<3, 1>("predict_p")).norm(), 1e-4);
  EXPECT_LE((at.velocity.vector() - read<3, 1>("predict_v")).norm(), 1e-4);
}

TEST_F(ImuOracle, ResidualAndJacobiansMatchReference) {
  Vector<15> r;
  Matrix<15, 6> xi, bi, xj, bj;
  Matrix<15, 3> vi, vj;
  PreintegratedImu{sum_.delta(), earth_}(pose("Ri", "pi"), R3(read<3, 1>("vi")), Rn<6>(read<6, 1>("bi")),
                                         pose("Rj", "pj"), R3(read<3, 1>("vj")), Rn<6>(read<6, 1>("bj")), r, &xi, &vi,
                                         &bi, &xj, &vj, &bj);
  EXPECT_LE((r - converted<1>(read<15, 1>("residual_rot_pos_vel_ba_bg"))).cwiseAbs().maxCoeff(), 1e-4);
  const auto relative = [](const auto& given, const auto& expected) {
    return (given - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
  };
  EXPECT_LE(relative(xi, converted_pose(read<15, 6>("J_xi_rot_trans"))), 1e-4);
  EXPECT_LE(relative(vi, converted<3>(read<15, 3>("J_vi"))), 1e-12);
  EXPECT_LE(relative(bi, converted<6>(read<15, 6>("J_bi"))), 1e-4);
  EXPECT_LE(relative(xj, converted_pose(read<15, 6>("J_xj_rot_trans"))), 1e-4);
  EXPECT_LE(relative(vj, converted<3>(read<15, 3>("J_vj"))), 1e-12);
  EXPECT_LE(relative(bj, converted<6>(read<15, 6>("J_bj"))), 1e-12);
}

TEST_F(ImuOracle, CovarianceMatchesReference) {
  const Matrix<15, 15> reference = read<15, 15>("covariance_rot_pos_vel_ba_bg");
  // M converts Tandem's covariance to the axes, order and signs of the reference.
  const SO3& R = sum_.delta().R;
  Matrix<15, 15> M = Matrix<15, 15>::Zero();
  M.block<3, 3>(0, 6) = SO3::Jr_inverse(R.Log());
  M.block<3, 3>(3, 0) = R.matrix();
  M.block<3, 3>(6, 3) = R.matrix();
  M.bottomRightCorner<6, 6>() = -Matrix<6, 6>::Identity();
  const Matrix<15, 15> given = M * sum_.covariance() * M.transpose();
  // Entries are compared relative to the standard deviations of their rows. Blocks are compared as well; the tolerance
  // for bias blocks is larger, because the reference approximates their correlations to one step in a hundred.
  const Vector<15> sigma = reference.diagonal().cwiseSqrt();
  EXPECT_LE((given - reference).cwiseQuotient(sigma * sigma.transpose()).cwiseAbs().maxCoeff(), 1e-3);
  const auto of_block = [&](int i, int k) {
    const Matrix<3, 3> block = reference.block<3, 3>(i, k);
    return (given.block<3, 3>(i, k) - block).norm() / block.norm();
  };
  double worst = 0.0;
  for (int i = 0; i < 9; i += 3)
    for (int k = 0; k < 9; k += 3) worst = std::max(worst, of_block(i, k));
  EXPECT_LE(worst, 1e-3);
  for (int i = 0; i < 9; i += 3)
    for (int k = 9; k < 15; k += 3) {
      if (i == 0 && k == 9) continue;  // the accelerometer bias does not affect rotation: zero in both
      EXPECT_LE(of_block(i, k), 2.5e-2) << i << " " << k;
    }
  EXPECT_EQ((given.block<3, 3>(0, 9).norm()), 0.0);
  std::cout << "covariance: largest relative error of a block " << worst << '\n';
}

}  // namespace
}  // namespace tandem
