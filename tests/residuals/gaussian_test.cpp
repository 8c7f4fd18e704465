#include <cmath>
#include <limits>
#include <random>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/residuals/gaussian.hpp>

namespace tandem {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double infinity = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();

template <class F>
std::string message_of(F f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

/// Returns a symmetric positive definite matrix with standard deviations from `small` to 1.
Eigen::MatrixXd positive_definite(int n, double small) {
  std::mt19937 random(7);
  Eigen::MatrixXd A(n, n);
  for (double& a : A.reshaped()) a = std::normal_distribution<double>()(random);
  const Eigen::VectorXd s = Eigen::VectorXd::LinSpaced(n, std::log(small), 0.0).array().exp();
  return s.asDiagonal() * (A * A.transpose() + Eigen::MatrixXd::Identity(n, n)) * s.asDiagonal();
}

Eigen::MatrixXd information_of(const Gaussian& g) { return g.sqrt_information().transpose() * g.sqrt_information(); }

TEST(Gaussian, DiagonalHoldsInverseSigmas) {
  const Gaussian g{0.1, 2.0, 4.0};
  EXPECT_EQ(g.dim(), 3);
  EXPECT_TRUE(g.is_diagonal());
  EXPECT_EQ(g.diagonal(), Eigen::Vector3d(10.0, 0.5, 0.25));
  EXPECT_EQ(g.sqrt_information(), Eigen::MatrixXd(Eigen::Vector3d(10.0, 0.5, 0.25).asDiagonal()));
  EXPECT_EQ(Gaussian(Eigen::VectorXd(Eigen::Vector3d(0.1, 2.0, 4.0))).diagonal(), g.diagonal());
}

TEST(Gaussian, SquaredRootIsTheInformation) {
  for (const int n : {1, 2, 3, 6, 9})
    for (const double small : {1.0, 1e-3}) {
      const Eigen::MatrixXd M = positive_definite(n, small), identity = Eigen::MatrixXd::Identity(n, n);
      const Gaussian by_information = Gaussian::information(M), by_covariance = Gaussian::covariance(M);
      EXPECT_EQ(by_information.dim(), n);
      EXPECT_EQ(by_covariance.dim(), n);
      EXPECT_FALSE(by_covariance.is_diagonal());
      // Relative to the scale √(M_ii M_jj) of each entry, to which Cholesky is invariant.
      const Eigen::VectorXd s = M.diagonal().cwiseSqrt().cwiseInverse();
      EXPECT_LE((s.asDiagonal() * (information_of(by_information) - M) * s.asDiagonal()).norm(), 1e-14);
      const Eigen::MatrixXd W = by_covariance.sqrt_information();
      EXPECT_LE((W * M * W.transpose() - identity).norm(), 1e-12) << n;  // whitens: W Σ Wᵀ = I
    }
}

TEST(Gaussian, SigmasCovarianceAndInformationAgree) {
  const Eigen::Vector4d sigmas(0.05, 3.0, 1e-3, 20.0);
  const Eigen::MatrixXd covariance = sigmas.cwiseAbs2().asDiagonal();
  const Eigen::MatrixXd information = sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
  const Eigen::MatrixXd expected = Gaussian(Eigen::VectorXd(sigmas)).sqrt_information();
  EXPECT_TRUE(Gaussian::covariance(covariance).sqrt_information().isApprox(expected, 1e-15));
  EXPECT_TRUE(Gaussian::information(information).sqrt_information().isApprox(expected, 1e-15));

  const Eigen::MatrixXd full = positive_definite(5, 1e-2);
  EXPECT_TRUE(
      information_of(Gaussian::covariance(full)).isApprox(information_of(Gaussian::information(full.inverse())), 1e-9));
}

TEST(Gaussian, WhitenedNormIsMahalanobisDistance) {
  const Eigen::MatrixXd M = positive_definite(4, 0.1);
  const Eigen::Vector4d r(1.0, -2.0, 0.5, 3.0);
  EXPECT_NEAR((Gaussian::covariance(M).sqrt_information() * r).squaredNorm() / r.dot(M.inverse() * r), 1.0, 1e-12);
  EXPECT_NEAR((Gaussian::information(M).sqrt_information() * r).squaredNorm() / r.dot(M * r), 1.0, 1e-13);
}

TEST(Gaussian, ReturnsItsCovariance) {
  EXPECT_TRUE(
      (Gaussian{0.1, 2.0}).covariance_matrix().isApprox(Eigen::Vector2d(0.01, 4.0).asDiagonal().toDenseMatrix()));
  const Eigen::MatrixXd M = positive_definite(5, 0.1);
  EXPECT_TRUE(Gaussian::covariance(M).covariance_matrix().isApprox(M, 1e-12));
  EXPECT_TRUE(Gaussian::information(M).covariance_matrix().isApprox(M.inverse(), 1e-10));
}

TEST(Gaussian, ScaledMultipliesStandardDeviations) {
  EXPECT_TRUE((Gaussian{0.1, 2.0}).scaled(4.0).diagonal().isApprox(Eigen::Vector2d(2.5, 0.125), 1e-15));
  const Eigen::MatrixXd M = positive_definite(3, 0.1);
  const Gaussian g = Gaussian::covariance(M);
  EXPECT_TRUE(information_of(g.scaled(std::sqrt(2.5))).isApprox(information_of(Gaussian::covariance(2.5 * M)), 1e-12));
  EXPECT_TRUE(g.scaled(3.0).diagonal().isApprox(g.diagonal() / 3.0, 1e-15));
}

TEST(Gaussian, RejectsInvalidSigmas) {
  for (const double bad : {0.0, -0.0, -1.0, infinity, -infinity, nan}) {
    EXPECT_THAT(message_of([&] {
                  Gaussian{1.0, bad};
                }),
                AllOf(HasSubstr("sigma"), HasSubstr("not positive and finite")));
    EXPECT_THAT(message_of([&] { Gaussian{bad}; }), HasSubstr("not positive and finite"));
  }
  EXPECT_THAT(message_of([] { static_cast<void>(Gaussian(Eigen::VectorXd())); }), HasSubstr("is empty"));
}

TEST(Gaussian, RejectsInvalidScale) {
  for (const double bad : {0.0, -1.0, infinity, nan})
    EXPECT_THAT(message_of([&] { Gaussian{1.0}.scaled(bad); }),
                AllOf(HasSubstr("scale"), HasSubstr("not positive and finite")));
}

/// Checks that covariance() and information() reject the matrix with this reason.
void expect_rejected(const Eigen::MatrixXd& M, const std::string& why) {
  EXPECT_THAT(message_of([&] { Gaussian::covariance(M); }), AllOf(HasSubstr("covariance"), HasSubstr(why))) << M;
  EXPECT_THAT(message_of([&] { Gaussian::information(M); }), AllOf(HasSubstr("information"), HasSubstr(why))) << M;
}

TEST(Gaussian, RejectsNonSquareMatrices) {
  expect_rejected(Eigen::MatrixXd::Ones(2, 3), "2 x 3, not square");
  expect_rejected(Eigen::MatrixXd(), "0 x 0");
}

TEST(Gaussian, RejectsNonFiniteMatrices) {
  for (const double bad : {infinity, nan}) {
    Eigen::MatrixXd M = Eigen::MatrixXd::Identity(3, 3);
    M(1, 2) = M(2, 1) = bad;
    expect_rejected(M, "not finite");
  }
}

TEST(Gaussian, RejectsAsymmetricMatrices) {
  Eigen::MatrixXd M = Eigen::MatrixXd::Identity(3, 3);
  M(0, 1) = 0.1;
  expect_rejected(M, "not symmetric");
}

TEST(Gaussian, RejectsIndefiniteMatrices) {
  expect_rejected(Eigen::MatrixXd::Zero(2, 2), "not positive definite");
  expect_rejected(-Eigen::MatrixXd::Identity(2, 2), "not positive definite");
  expect_rejected(Eigen::Matrix2d{{1.0, 2.0}, {2.0, 1.0}}, "not positive definite");
  // Singular matrices, whose last pivot is a rounding error of either sign.
  std::mt19937 random(3);
  for (int n = 2; n <= 9; ++n)
    for (int trial = 0; trial < 20; ++trial) {
      Eigen::MatrixXd A(n, n - 1);
      for (double& a : A.reshaped()) a = std::normal_distribution<double>()(random);
      expect_rejected(A * A.transpose(), "not positive definite");
    }
}

TEST(Gaussian, AcceptsRoundingAsymmetryAndDifferentUnits) {
  Eigen::MatrixXd M = positive_definite(6, 1e-6);
  M(0, 5) *= 1.0 + 1e-12;
  EXPECT_NO_THROW(Gaussian::covariance(M));
  EXPECT_NO_THROW(Gaussian::information(M));
  EXPECT_NO_THROW(Gaussian::covariance(Eigen::Vector3d(1e-16, 1.0, 1e12).asDiagonal().toDenseMatrix()));
}

}  // namespace
}  // namespace tandem
