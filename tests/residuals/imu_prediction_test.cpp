// Physics of inertial prediction: a body at rest, on a circle, spinning, on a rotating Earth.

#include <gtest/gtest.h>

#include <tandem/residuals/imu_prediction.hpp>

#include "residuals/autodiff.hpp"
#include "residuals/imu_cases.hpp"

namespace tandem::testing {
namespace {

const SE3 start(SO3::Exp({0.4, -0.9, 1.3}), Vector<3>(5.0, -3.0, -20.0));
const R3 velocity(Vector<3>(2.0, -1.0, 0.5));

ImuPrediction<> predicted(const ImuPreintegrator& sum, const Earth& earth, const SE3& from, const R3& v) {
  return predict(from, v, Rn<6>(sum.delta().bias), sum.delta(), earth);
}

TEST(ImuPrediction, BodyAtRestStays) {
  const SE3 mount = tilted_mount();
  const Vector<6> bias = some_bias();
  const Earth earth = Earth::with_gravity(9.83);
  ImuPreintegrator sum(mount, some_noise(), bias);
  const Vector<3> up = (start.rotation() * mount.rotation()).inverse().act(-earth.gravity);
  for (int i = 0; i < 6000; ++i) sum.integrate(up + bias.head<3>(), bias.tail<3>(), 0.01);
  const ImuPrediction<> at = predicted(sum, earth, start, R3());
  // Gravity and specific force cancel 18 km, in 6000 steps with a rounding error of 2e-12 m each.
  EXPECT_LE((at.pose.translation() - start.translation()).norm(), 6000 * 2e-12);
  EXPECT_LE(at.velocity.vector().norm(), 1e-10);
  EXPECT_LE((at.pose.rotation().inverse() * start.rotation()).Log().norm(), 1e-13);
}

TEST(ImuPrediction, BodyOnCircleWithLeverArmFollowsTheCircle) {
  // The body moves forward (x) on a circle of 6 m with the centre to its left. All values are constant along the sensor
  // axes: one interval suffices.
  const double rate = 0.45, radius = 6.0;
  const Vector<3> omega(0.0, 0.0, rate), centre(0.0, radius, 0.0);
  const Earth earth;
  for (const SE3& mount : {SE3(), tilted_mount()}) {
    const Vector<3> acceleration = omega.cross(omega.cross(mount.translation() - centre));
    const SO3 to_sensor = mount.rotation().inverse();
    for (const int steps : {1, 7, 500}) {
      const double t = 9.0;
      ImuPreintegrator sum(mount, some_noise());
      for (int i = 0; i < steps; ++i)
        sum.integrate(to_sensor.act(acceleration - earth.gravity), to_sensor.act(omega), t / steps);
      const ImuPrediction<> at = predicted(sum, earth, SE3(), R3(Vector<3>(rate * radius, 0.0, 0.0)));
      const SO3 turned = SO3::Exp(t * omega);
      // Gravity and specific force cancel 400 m, in up to 500 steps with a rounding error of 5e-14 m each.
      EXPECT_LE((at.pose.translation() - (centre - turned.act(centre))).norm(), 500 * 5e-14) << steps;
      EXPECT_LE((at.velocity.vector() - turned.act({rate * radius, 0.0, 0.0})).norm(), 1e-12) << steps;
      EXPECT_LE((at.pose.rotation().inverse() * turned).Log().norm(), 1e-13) << steps;
    }
  }
}

TEST(ImuPrediction, BodySpinningAboutItsCentreStays) {
  // Rotation ω = a sin(c t) about a fixed axis: the sensor on the lever arm moves, the body does not. Instantaneous
  // samples.
  const Vector<3> axis = Vector<3>(1.0, -2.0, 2.0) / 3.0;
  const SE3 mount = tilted_mount();
  const SO3 to_sensor = mount.rotation().inverse();
  const Vector<3> l = mount.translation();
  const auto sample = [&](double t) {
    const Vector<3> omega = 1.5 * std::sin(0.8 * t) * axis, alpha = 1.5 * 0.8 * std::cos(0.8 * t) * axis;
    return ImuSample{t, to_sensor.act(alpha.cross(l) + omega.cross(omega.cross(l))), to_sensor.act(omega)};
  };
  const auto moved = [&](double dt) {
    ImuPreintegrator sum(mount, some_noise());
    const int count = int(std::lround(4.0 / dt));
    for (int i = 0; i < count; ++i) sum.integrate(sample(i * dt), sample((i + 1) * dt));
    const ImuPrediction<> at = predicted(sum, Earth::with_gravity(0.0), SE3(), R3());
    return Vector<2>(at.pose.translation().norm(), at.velocity.vector().norm());
  };
  const Vector<2> coarse = moved(0.02), fine = moved(0.01);
  EXPECT_LE(coarse.maxCoeff(), 2e-3);
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(coarse[i] / fine[i], 4.0, 0.1);  // second-order convergence
}

/// Integrates constant measurements on a rotating Earth by the Runge-Kutta method in steps of 1 ms:
///   dv/dt = R f + g − 2 ω × v,  R(t) = Exp(−ω t) R_i Exp(w t)
ImuPrediction<> integrated(const Vector<3>& f, const Vector<3>& w, const Earth& earth, double duration) {
  using State = Matrix<3, 2>;  // p, v
  const auto rotation = [&](double t) { return SO3::Exp(-t * earth.rate) * start.rotation() * SO3::Exp(t * w); };
  const auto slope = [&](double t, const State& x) {
    State d;
    d << x.col(1), rotation(t).act(f) + earth.gravity - 2.0 * earth.rate.cross(x.col(1));
    return d;
  };
  State x;
  x << start.translation(), velocity.vector();
  const double h = 1e-3;
  const int steps = int(std::lround(duration / h));
  for (int i = 0; i < steps; ++i) {
    const double t = i * h;
    const State a = slope(t, x), b = slope(t + h / 2, x + h / 2 * a), c = slope(t + h / 2, x + h / 2 * b),
                d = slope(t + h, x + h * c);
    x += h / 6 * (a + 2 * b + 2 * c + d);
  }
  return {SE3(rotation(duration), x.col(0)), R3(x.col(1))};
}

TEST(ImuPrediction, IsFirstOrderAccurateInEarthRate) {
  const Vector<3> f(0.6, -1.2, 9.0), w(0.1, 0.2, -0.3);
  const auto errors = [&](double times, double duration) {
    Earth earth = Earth::at_latitude(0.7, 9.81);
    earth.rate *= times;
    ImuPreintegrator sum(SE3(), some_noise());
    sum.integrate(f, w, duration);
    const ImuPrediction<> at = predicted(sum, earth, start, velocity);
    const ImuPrediction<> truth = integrated(f, w, earth, duration);
    EXPECT_LE((at.pose.rotation().inverse() * truth.pose.rotation()).Log().norm(), 1e-14);
    return Vector<2>((at.pose.translation() - truth.pose.translation()).norm(),
                     (at.velocity.vector() - truth.velocity.vector()).norm());
  };
  // At the Earth's rate: a typical interval of a Doppler log (1 s) and a long gap (10 s).
  const Vector<2> second = errors(1.0, 1.0), ten = errors(1.0, 10.0);
  std::cout << "errors: " << second.transpose() << " m, m/s after 1 s, " << ten.transpose() << " after 10 s\n";
  EXPECT_LE(second[0], 2e-8);
  EXPECT_LE(ten[0], 5e-4);
  // The error is of second order in the rate.
  const Vector<2> faster = errors(20.0, 2.0), twice = errors(40.0, 2.0);
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(twice[i] / faster[i], 4.0, 0.05);
}

TEST(ImuPrediction, BodyAtRestOnRotatingEarthStays) {
  const Earth earth = Earth::at_latitude(-0.6, 9.79);
  const SO3 to_body = start.rotation().inverse();
  ImuPreintegrator sum(SE3(), some_noise());
  for (int i = 0; i < 1000; ++i) sum.integrate(to_body.act(-earth.gravity), to_body.act(earth.rate), 0.01);
  const ImuPrediction<> at = predicted(sum, earth, start, R3());
  EXPECT_LE((at.pose.rotation().inverse() * start.rotation()).Log().norm(), 1e-13);
  // Without the Earth's rotation, the rotating direction of gravity alone causes an error of 9.79 m/s² · 7.3e-5 rad/s ·
  // (10 s)³ / 6 = 0.1 m.
  EXPECT_LE((at.pose.translation() - start.translation()).norm(), 1e-4);
  EXPECT_LE(at.velocity.vector().norm(), 5e-5);
  Earth still = earth;
  still.rate.setZero();
  EXPECT_GE((predicted(sum, still, start, R3()).pose.translation() - start.translation()).norm(), 0.05);
}

}  // namespace
}  // namespace tandem::testing
