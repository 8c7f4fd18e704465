// Preintegration: composition, bias correction and covariance.

#include <limits>

#include <gtest/gtest.h>

#include <tandem/residuals/gaussian.hpp>
#include <tandem/residuals/preintegrated_imu.hpp>

#include "residuals/autodiff.hpp"
#include "residuals/imu_cases.hpp"

namespace tandem::testing {
namespace {

TEST(ImuPreintegration, IsAssociative) {
  const auto readings = random_readings(1, 90, 0.01);
  const std::vector<Reading> early(readings.begin(), readings.begin() + 30),
      late(readings.begin() + 30, readings.end());
  for (const ImuHold hold : {ImuHold::turning, ImuHold::at_start}) {
    ImuPreintegrator whole(tilted_mount(), some_noise(), some_bias(), hold), a = whole, b = whole;
    add(whole, readings), add(a, early), add(b, late);
    const ImuDelta &w = whole.delta(), &x = a.delta(), &y = b.delta();
    EXPECT_NEAR(w.dt, x.dt + y.dt, 1e-15);
    EXPECT_LE((w.R.inverse() * x.R * y.R).Log().norm(), 1e-14);
    EXPECT_LE((w.v - (x.v + x.R.act(y.v))).norm(), 1e-13);
    EXPECT_LE((w.p - (x.p + y.dt * x.v + x.R.act(y.p))).norm(), 1e-13);
  }
}

TEST(ImuPreintegration, ConstantReadingIsIndependentOfStepSize) {
  ImuPreintegrator one(tilted_mount(), some_noise(), some_bias()), many = one;
  const Vector<3> f(0.5, -2.0, 9.0), w(0.8, -0.5, 1.4);
  one.integrate(f, w, 2.0);
  for (int i = 0; i < 400; ++i) many.integrate(f, w, 0.005);
  EXPECT_LE((one.delta().R.inverse() * many.delta().R).Log().norm(), 1e-13);
  EXPECT_LE((one.delta().v - many.delta().v).norm(), 1e-12);
  EXPECT_LE((one.delta().p - many.delta().p).norm(), 1e-12);
  EXPECT_LE(difference(one.delta().R_by_bias, many.delta().R_by_bias), 1e-12);
  EXPECT_LE(difference(one.delta().v_by_bias, many.delta().v_by_bias), 1e-12);
  EXPECT_LE(difference(one.delta().p_by_bias, many.delta().p_by_bias), 1e-12);
}

TEST(ImuPreintegration, HoldModeSelectsTheAxes) {
  const Vector<3> f(0.0, 0.0, 2.0), w(0.0, std::numbers::pi / 2, 0.0);  // 90°, from z to x
  ImuPreintegrator turning(SE3(), some_noise()), held(SE3(), some_noise(), Vector<6>::Zero(), ImuHold::at_start);
  turning.integrate(f, w, 1.0);
  held.integrate(f, w, 1.0);
  const double k = 2.0 / std::numbers::pi;
  EXPECT_LE((turning.delta().v - 2.0 * k * Vector<3>(1.0, 0.0, 1.0)).norm(), 1e-15);
  EXPECT_LE((turning.delta().p - 2.0 * k * Vector<3>(1.0 - k, 0.0, k)).norm(), 1e-15);
  EXPECT_LE((held.delta().v - f).norm(), 1e-15);
  EXPECT_LE((held.delta().p - 0.5 * f).norm(), 1e-15);
  EXPECT_LE((held.delta().R.inverse() * turning.delta().R).Log().norm(), 1e-15);
}

TEST(ImuPreintegration, BiasCorrectionIsFirstOrder) {
  Vector<6> direction;
  direction << 0.3, -0.5, 0.4, 0.06, 0.08, -0.05;
  // Small steps, where the coefficients use series, and large rotations, where they do not.
  for (const auto& [dt, count] : {std::pair{0.01, 80}, std::pair{0.4, 6}})
    for (const ImuHold hold : {ImuHold::turning, ImuHold::at_start}) {
      const auto readings = random_readings(3, count, dt);
      const auto integrated = [&](const Vector<6>& bias) {
        ImuPreintegrator sum(tilted_mount(), some_noise(), bias, hold);
        add(sum, readings);
        return sum.delta();
      };
      const ImuDelta at = integrated(some_bias());
      const auto errors = [&](double h) {
        const Vector<6> d = h * direction;
        const ImuDelta again = integrated(some_bias() + d);
        return Vector<3>((again.R.inverse() * at.R * SO3::Exp(at.R_by_bias * d.tail<3>())).Log().norm(),
                         (at.v + at.v_by_bias * d - again.v).norm(), (at.p + at.p_by_bias * d - again.p).norm());
      };
      const Vector<3> whole = errors(2e-2), half = errors(1e-2);
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(whole[i] / half[i], 4.0, 0.1) << i << ", step " << dt;
    }
}

TEST(ImuPreintegration, RejectsInvalidTimeSteps) {
  ImuPreintegrator sum(SE3(), some_noise());
  const Vector<3> f(0.0, 0.0, 9.8), w(0.0, 0.1, 0.0);
  sum.integrate(f, w, 0.0);
  EXPECT_EQ(sum.delta().dt, 0.0);
  EXPECT_EQ(sum.covariance().norm(), 0.0);
  for (const double bad : {-1e-3, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(sum.integrate(f, w, bad), Error) << bad;
  EXPECT_THROW(sum.integrate(ImuSample{1.0, f, w}, ImuSample{1.0, f, w}), Error);
  EXPECT_THROW(sum.integrate(ImuSample{1.0, f, w}, ImuSample{0.9, f, w}), Error);
}

/// Returns the largest difference of two covariance entries, relative to the standard deviations of their rows.
double mismatch(const Matrix<15, 15>& given, const Matrix<15, 15>& expected) {
  const Vector<15> sigma = expected.diagonal().cwiseSqrt();
  return (given - expected).cwiseQuotient(sigma * sigma.transpose()).cwiseAbs().maxCoeff();
}

struct States {
  SE3 x{SO3::Exp({0.4, -0.9, 1.3}), Vector<3>(5.0, -3.0, -20.0)};
  R3 v{Vector<3>(2.0, -1.0, 0.5)};
  Rn<6> b;
};
States after(const States& from, const ImuDelta& delta, const Earth& earth) {
  const ImuPrediction<> at = predict(from.x, from.v, from.b, delta, earth);
  return {at.pose, at.velocity, from.b};
}

/// Returns the Jacobians of the residual with respect to all states at i and at j.
std::pair<Matrix<15, 15>, Matrix<15, 15>> jacobians(const PreintegratedImu& imu, const States& i, const States& j) {
  Vector<15> r;
  Matrix<15, 6> xi, bi, xj, bj;
  Matrix<15, 3> vi, vj;
  imu(i.x, i.v, i.b, j.x, j.v, j.b, r, &xi, &vi, &bi, &xj, &vj, &bj);
  std::pair<Matrix<15, 15>, Matrix<15, 15>> J;
  J.first << xi, vi, bi;
  J.second << xj, vj, bj;
  return J;
}

TEST(ImuPreintegration, CovarianceComposesLikeTheResidual) {
  // Two consecutive residuals imply one between their ends, with the noise −J_b(bc) J_b(ab)⁻¹ n_ab + n_bc. This
  // requires the same row frames and the same correlation with the bias random walk as in the residual. No lever arm,
  // because the covariance neglects its effect.
  const SE3 mount(tilted_mount().rotation(), Vector<3>::Zero());
  const Earth earth = Earth::with_gravity(9.81);
  const auto readings = random_readings(1, 90, 0.01);
  const std::vector<Reading> early(readings.begin(), readings.begin() + 30),
      late(readings.begin() + 30, readings.end());
  for (const ImuHold hold : {ImuHold::turning, ImuHold::at_start}) {
    ImuPreintegrator whole(mount, some_noise(), some_bias(), hold), ab = whole, bc = whole;
    add(whole, readings), add(ab, early), add(bc, late);
    States a;
    a.b = Rn<6>(some_bias());
    const States b = after(a, ab.delta(), earth), c = after(b, bc.delta(), earth);
    const Matrix<15, 15> by_b_of_ab = jacobians(PreintegratedImu{ab.delta(), earth}, a, b).second;
    const Matrix<15, 15> by_b_of_bc = jacobians(PreintegratedImu{bc.delta(), earth}, b, c).first;
    const Matrix<15, 15> M = by_b_of_bc * by_b_of_ab.inverse();
    const Matrix<15, 15> composed = M * ab.covariance() * M.transpose() + bc.covariance();
    EXPECT_LE(mismatch(whole.covariance(), composed), 1e-12);
    EXPECT_EQ(whole.covariance(), whole.covariance().transpose());
  }
}

TEST(StatisticalImuPreintegration, SampleCovarianceMatchesPrediction) {
  // Readings have white noise of variance σ²/dt and random-walk biases, which change by u' over an interval and by u in
  // its mean.
  constexpr int count = 20000;
  const auto readings = random_readings(8, 40, 0.02);
  const SE3 mount(tilted_mount().rotation(), Vector<3>::Zero());
  const ImuNoise noise{2e-3, 3e-4, 6e-3, 8e-4, 0.0};
  const Earth earth;
  ImuPreintegrator clean(mount, noise);
  add(clean, readings);
  const States i;
  const States j = after(i, clean.delta(), earth);

  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  const auto draw = [&] {
    Vector<6> z;
    for (double& entry : z) entry = normal(random);
    return z;
  };
  Vector<6> white, walk;
  white << Vector<3>::Constant(noise.accelerometer), Vector<3>::Constant(noise.gyroscope);
  walk << Vector<3>::Constant(noise.accelerometer_bias_walk), Vector<3>::Constant(noise.gyroscope_bias_walk);
  Matrix<15, 15> sampled = Matrix<15, 15>::Zero();
  for (int n = 0; n < count; ++n) {
    ImuPreintegrator sum(mount, noise);
    Vector<6> bias = Vector<6>::Zero();
    for (const Reading& reading : readings) {
      const Vector<6> step = std::sqrt(reading.dt) * walk.cwiseProduct(draw());
      const Vector<6> mean = bias + 0.5 * step + std::sqrt(reading.dt / 12.0) * walk.cwiseProduct(draw());
      const Vector<6> error = mean + white.cwiseProduct(draw()) / std::sqrt(reading.dt);
      sum.integrate(reading.specific_force + error.head<3>(), reading.angular_rate + error.tail<3>(), reading.dt);
      bias += step;
    }
    Vector<15> r;
    PreintegratedImu{sum.delta(), earth}(i.x, i.v, i.b, j.x, j.v, Rn<6>(bias), r);
    sampled += r * r.transpose() / count;
  }
  // The standard error of a sampled entry is √((1 + ρ²)/n) < √(2/n); the worst of 120 entries hardly exceeds 4.5 of
  // them.
  EXPECT_LE(mismatch(sampled, clean.covariance()), 4.5 * std::sqrt(2.0 / count));
  // Without the correlation with the bias random walk, or with the wrong sign, the difference would be much larger.
  Matrix<15, 15> wrong = clean.covariance();
  wrong.topRightCorner<9, 6>().setZero();
  wrong.bottomLeftCorner<6, 9>().setZero();
  EXPECT_GE(mismatch(sampled, wrong), 0.3);
}

TEST(ImuPreintegration, CovarianceHasFullRankFromTheFirstReading) {
  for (const double dt : {0.005, 0.01, 0.1}) {
    ImuPreintegrator sum(tilted_mount(), some_noise());
    for (int i = 0; i < 200; ++i) {
      sum.integrate({0.5, -0.3, 9.9}, {0.2, -0.4, 0.6}, dt);
      EXPECT_EQ(Gaussian::covariance(sum.covariance()).dim(), 15) << i;
    }
  }
}

}  // namespace
}  // namespace tandem::testing
