#include <random>

#include <gtest/gtest.h>

#include <tandem/lie/se3.hpp>
#include <tandem/residuals/motion_interpolation.hpp>

namespace tandem {
namespace {

/// Compares a Jacobian with central differences of motion(perturbed states).
template <LieGroup G, class F>
void expect_jacobian(const Eigen::MatrixXd& jacobian, F motion) {
  constexpr double h = 1e-6;
  constexpr int n = G::dof;
  for (Eigen::Index column = 0; column < jacobian.cols(); ++column) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(jacobian.cols());
    step[column] = h;
    const InterpolatedMotion<G> plus = motion(step), less = motion(-step);
    Vector<2 * n> difference;
    difference << minus(plus.pose, less.pose), plus.twist - less.twist;
    EXPECT_LE((difference / (2 * h) - jacobian.col(column)).norm(), 1e-7 * (1 + jacobian.norm())) << column;
  }
}

SE3 pose(double x, double turn) { return SE3::Exp(Vector<6>(x, 0.2 * turn, -0.1, 0.1 * turn, -0.3 * turn, turn)); }

TEST(MotionInterpolation, MeetsTheKeyframes) {
  const SE3 a = pose(1, 0.2), b = pose(2, 0.5);
  const Rn<6> v(Vector<6>(1, 0, 0.1, 0, 0.1, 0.3)), w(Vector<6>(0.8, 0.1, 0, 0.1, 0, 0.4));
  const Vector<6> densities = Vector<6>::Constant(0.1);
  for (const double after : {0.0, 2.0}) {
    const SE3& expected = after == 0 ? a : b;
    EXPECT_LE(minus(interpolate_constant_twist(a, b, 2.0, after).pose, expected).norm(), 1e-12);
    const auto motion = interpolate_white_noise(a, v, b, w, densities, 2.0, after);
    EXPECT_LE(minus(motion.pose, expected).norm(), 1e-12);
    EXPECT_LE((motion.twist - (after == 0 ? v : w).vector()).norm(), 1e-12);
    EXPECT_LE(motion.bridge.norm(), 1e-12);
    EXPECT_LE(minus(interpolate_damped<SE3>({a, b}, {0, 2}, 0, densities, densities * 50, after).pose, expected).norm(),
              1e-9);
  }
}

TEST(MotionInterpolation, HasExactJacobians) {
  const std::vector<SE3> x{pose(0.2, -0.1), pose(1, 0.2), pose(2, 0.5), pose(2.7, 0.9)};
  const Rn<6> v(Vector<6>(1, 0, 0.1, 0, 0.1, 0.3)), w(Vector<6>(0.8, 0.1, 0, 0.1, 0, 0.4));
  const Vector<6> densities(0.1, 0.2, 0.3, 0.1, 0.1, 0.2), times(2, 3, 4, 5, 6, 7);
  const auto part = [](const Eigen::VectorXd& d, int i) { return Vector<6>(d.segment<6>(6 * i)); };
  const auto constant = [&](const Eigen::VectorXd& d) {
    return interpolate_constant_twist<SE3>(x[1] * SE3::Exp(part(d, 0)), x[2] * SE3::Exp(part(d, 1)), 1.5, 0.6);
  };
  expect_jacobian<SE3>(constant(Eigen::VectorXd::Zero(12)).jacobian, constant);
  const auto white = [&](const Eigen::VectorXd& d) {
    return interpolate_white_noise<SE3>(x[1] * SE3::Exp(part(d, 0)), Rn<6>(Vector<6>(v.vector() + part(d, 1))),
                                        x[2] * SE3::Exp(part(d, 2)), Rn<6>(Vector<6>(w.vector() + part(d, 3))),
                                        densities, 1.5, 0.6);
  };
  expect_jacobian<SE3>(white(Eigen::VectorXd::Zero(24)).jacobian, white);
  const auto damped = [&](const Eigen::VectorXd& d) {
    std::vector<SE3> moved = x;
    for (int i = 0; i < 4; ++i) moved[std::size_t(i)] = x[std::size_t(i)] * SE3::Exp(part(d, i));
    return interpolate_damped<SE3>(moved, {0, 1, 2.5, 3.2}, 1, densities, times, 1.7);
  };
  expect_jacobian<SE3>(damped(Eigen::VectorXd::Zero(24)).jacobian, damped);
}

/// Interpolation between two keyframes of a Gauss–Markov process equals conditioning on both: the joint distribution of
/// the states at 0, `after` and dt follows from the residuals alone.
TEST(MotionInterpolation, WhiteNoiseIsExactOnPoints) {
  const double dt = 2.0, after = 0.7;
  const Vector<3> densities(0.1, 0.5, 2.0);
  const R3 x0(Vector<3>(1, 2, 3)), x1(Vector<3>(2, 2.5, 2));
  const Rn<3> w0(Vector<3>(0.3, 0.1, -0.2)), w1(Vector<3>(0.6, 0.2, -0.9));
  const auto motion = interpolate_white_noise<R3>(x0, w0, x1, w1, densities, dt, after);
  // Information of the middle state from both residuals.
  using Prior = WhiteNoiseAcceleration<R3>;
  const Matrix<6, 6> first = Prior::covariance(densities, after).inverse();
  const Matrix<6, 6> second = Prior::covariance(densities, dt - after).inverse();
  Matrix<6, 3> J1, Jw1, K0, Kw0;
  Vector<6> r, s;
  const R3 guess;
  const Rn<3> still;
  Prior{after}(x0, w0, guess, still, r, nullptr, nullptr, &J1, &Jw1);
  Prior{dt - after}(guess, still, x1, w1, s, &K0, &Kw0);
  Matrix<6, 6> J, K;
  J << J1, Jw1;
  K << K0, Kw0;
  const Matrix<6, 6> H = J.transpose() * first * J + K.transpose() * second * K;
  const Vector<6> middle = -H.ldlt().solve(J.transpose() * first * r + K.transpose() * second * s);
  EXPECT_LE((motion.pose.vector() - middle.head<3>()).norm(), 1e-12);
  EXPECT_LE((motion.twist - middle.tail<3>()).norm(), 1e-12);
  EXPECT_LE((motion.bridge - H.inverse()).norm(), 1e-12);
}

/// The damped process as a fine chain of Gauss–Markov steps, conditioned on the positions at the keyframes.
TEST(MotionInterpolation, DampedIsExactOnPoints) {
  const double tau = 1.5, sigma = 0.8, h = 0.002;
  const std::vector<double> t{0, 1, 2, 3.2};
  const std::vector<double> p{0.0, 0.4, 1.5, 1.9};
  const double instant = 1.4;
  const double variance = 0.5 * sigma * sigma * tau;
  // Covariances of displacements by double sums over the stationary covariance of the velocity.
  const auto index = [&](double time) { return int(std::lround(time / h)); };
  const auto displacement = [&](double a, double b, double c, double d) {
    double sum = 0;
    for (int i = index(a); i < index(b); ++i)
      for (int j = index(c); j < index(d); ++j) sum += std::exp(-std::abs(i - j) * h / tau);
    return variance * h * h * sum;
  };
  const auto velocity = [&](double a, double b) {
    double sum = 0;
    for (int i = index(a); i < index(b); ++i) sum += std::exp(-std::abs((i + 0.5) * h - instant) / tau);
    return variance * h * sum;
  };
  Matrix<3, 3> S;
  Matrix<2, 3> cross;
  Vector<3> d;
  for (int a = 0; a < 3; ++a) {
    const auto u = std::size_t(a);
    d[a] = p[u + 1] - p[u];
    for (int b = 0; b < 3; ++b) S(a, b) = displacement(t[u], t[u + 1], t[std::size_t(b)], t[std::size_t(b) + 1]);
    cross(0, a) = displacement(t[1], instant, t[u], t[u + 1]);
    cross(1, a) = velocity(t[u], t[u + 1]);
  }
  const Vector<2> expected = cross * S.ldlt().solve(d);
  std::vector<Rn<1>> x;
  for (const double value : p) x.push_back(Rn<1>(Vector<1>(value)));
  const auto motion = interpolate_damped<Rn<1>>(x, t, 1, Vector<1>(sigma), Vector<1>(tau), instant);
  EXPECT_NEAR(motion.pose.vector()[0], p[1] + expected[0], 1e-5);
  EXPECT_NEAR(motion.twist[0], expected[1], 1e-5);
  EXPECT_NEAR(motion.bridge(0, 0),
              displacement(t[1], instant, t[1], instant) - cross.row(0).dot(S.ldlt().solve(cross.row(0).transpose())),
              1e-5);
  EXPECT_NEAR(motion.bridge(1, 1), variance - cross.row(1).dot(S.ldlt().solve(cross.row(1).transpose())), 1e-5);
}

}  // namespace
}  // namespace tandem
