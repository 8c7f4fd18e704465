#include <gtest/gtest.h>

#include <tandem/lie/se2.hpp>
#include <tandem/lie/se3.hpp>
#include <tandem/residuals/vehicle/inside_cone.hpp>
#include <tandem/residuals/vehicle/twist_kinematics.hpp>

#include "residuals/curvature_autodiff.hpp"

namespace tandem::testing {
namespace {

template <class G>
class TwistKinematicsTest : public ::testing::Test {};
using Groups = ::testing::Types<SE3, SE2, SO3>;
TYPED_TEST_SUITE(TwistKinematicsTest, Groups);

TYPED_TEST(TwistKinematicsTest, VanishesAlongTheMeanTwistAndHasCorrectJacobians) {
  using G = TypeParam;
  const Rn<G::dof> w0(tangent<G>(0.3, 1.2)), w1(tangent<G>(-0.7, 0.4));
  const G x0 = G::Exp(tangent<G>(1.1, 12.0));
  for (const double dt : {0.05, 1.0, 3.0}) {
    const TwistKinematics<G> residual{dt};
    const G end = x0 * G::Exp(0.5 * dt * (w0.vector() + w1.vector()));
    Vector<G::dof> r;
    residual(x0, w0, end, w1, r);
    EXPECT_LE(r.norm(), 1e-14);
    for (const auto& d : residual_sizes<G>()) {
      residual(x0, w0, G(end * G::Exp(d)), w1, r);
      EXPECT_LE((r - d).norm(), 1e-13 * (1.0 + d.norm()));
      expect_correct_jacobians(residual, x0, w0, G(end * G::Exp(d)), w1);
    }
  }
}

TYPED_TEST(TwistKinematicsTest, HasCorrectJacobiansAtRandomStates) {
  expect_correct_jacobians_at_random_states(TwistKinematics<TypeParam>{0.1}, 1);
}

TEST(TwistKinematics, HasCorrectCurvature) {
  const Vector<6> w = tangent<SE3>(0.8, -1.3);
  for (const double turn : {0.0, 1e-9, 0.4, 2.5}) {  // rotation of Exp's argument [rad], at dt = 1 s
    const Rn<6> w0(tangent<SE3>(1.5 * turn, 1.2)), w1(Vector<6>(tangent<SE3>(0.5 * turn, 0.4)));
    const SE3 x0 = SE3::Exp(tangent<SE3>(1.1, 12.0));
    const SE3 end = x0 * SE3::Exp(0.5 * (w0.vector() + w1.vector()));
    for (const auto& d : residual_sizes<SE3>())
      if (SE3::angle(d) < 3.1)  // the curvature of Log is unbounded near π
        expect_correct_curvature(TwistKinematics<SE3>{1.0}, w, x0, w0, SE3(end * SE3::Exp(d)), w1);
  }
  expect_correct_curvature(TwistKinematics<R3>{0.3}, Vector<3>(0.2, -0.5, 1.0), R3({1.0, 2.0, 3.0}),
                           R3({0.1, 0.2, 0.3}), R3(), R3({-1.0, 0.0, 1.0}));
}

TEST(InsideCone, IsDistanceToTheSurface) {
  using std::numbers::pi;
  const InsideCone<R3> cone{pi / 6};
  const auto at = [&](const Vector<3>& p) {
    Vector<1> r;
    cone(SE3(), R3(p), r);
    return r[0];
  };
  EXPECT_DOUBLE_EQ(at({10.0, 0.0, 0.0}), 5.0);             // 10 m sin 30°
  EXPECT_EQ(at({0.0, 0.0, 0.0}), 0.0);                     // the apex
  EXPECT_NEAR(at({3.0, std::sqrt(3.0), 0.0}), 0.0, 0.01);  // on the surface
  EXPECT_LT(at({3.0, 0.0, 2.0}), -0.2);
  EXPECT_LT(at({-10.0, 0.0, 0.0}), -4.9);  // behind
}

TEST(InsideCone, AxisIsXOfTheMount) {
  const SE3 mount(SO3::Exp({0.0, 0.0, 0.5}), {1.0, 2.0, 3.0});
  const InsideCone<> cone{0.4, mount, {0.1, 0.0, 0.2}};
  const SE3 chaser = SE3::Exp(tangent<SE3>(0.8, 4.0));
  const SE3 target = chaser * mount * SE3(SO3::Exp({0.3, 0.2, 0.1}), {7.0, 0.5, -0.3});
  const Vector<3> p = (chaser * mount).inverse().act(target.act(cone.beacon));
  Vector<1> r;
  cone(chaser, target, r);
  EXPECT_NEAR(r[0], p[0] * std::sin(0.4) - std::hypot(p[1], p[2]) * std::cos(0.4), 0.01);
}

TEST(InsideCone, HasCorrectJacobians) {
  const InsideCone<> cone{0.6, SE3::Exp(tangent<SE3>(0.7, 0.5)), {0.1, -0.2, 0.3}};
  expect_correct_jacobians_at_random_states(cone, 1);
  expect_correct_jacobians_at_random_states(InsideCone<R3>{0.6}, 2);
  for (const auto& d : residual_sizes<SE3>()) expect_correct_jacobians(cone, SE3(), SE3::Exp(d));
}

}  // namespace
}  // namespace tandem::testing
