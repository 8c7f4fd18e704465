// Group axioms, Exp and Log, Ad and the Jacobians of Exp, for every group.

#include <cmath>
#include <concepts>
#include <string>

#include <gtest/gtest.h>

#include <tandem/lie/operations.hpp>
#include <tandem/lie/testing.hpp>

#include "samples.hpp"

namespace tandem {
namespace {

static_assert(LieGroup<SO2> && LieGroup<SE2> && LieGroup<SO3> && LieGroup<SE3> && LieGroup<SE23>);
static_assert(LieGroup<Rn<1>> && LieGroup<Rn<3>> && LieGroup<PoseBundle> && LieGroup<MixedBundle>);
static_assert(LieGroup<Bundle<PoseBundle, SO3>> && LieGroup<SE3::Rebind<float>>);
static_assert(PoseBundle::dof == 15 && PoseBundle::offset<2>() == 9 && MixedBundle::matrix_size == 7);

struct WithoutLog : SO2 {
  void Log() const;
};
static_assert(!LieGroup<double> && !LieGroup<Vector<3>> && !LieGroup<SO3::Quaternion> && !LieGroup<WithoutLog>);

static_assert(Over<SE3, SE3> && Over<BasicSE3<float>, SE3> && Over<PoseBundle::Rebind<float>, PoseBundle>);
static_assert(!Over<SE2, SE3> && !Over<SE3, SE23> && !Over<Rn<2>, Rn<3>> && !Over<double, SE3>);

// Elements have entries of order one. Each identity accumulates a few dozen rounding errors of 1.1e-16.
constexpr double kRounding = 1e-14;

template <class G>
class Groups : public ::testing::Test {
 protected:
  void expect(const check::Errors& errors, double tolerance) {
    EXPECT_EQ(errors.report(tolerance), "");
    this->RecordProperty("largest_error", std::to_string(errors.largest() * 1e15) + "e-15");
  }
  Samples samples;
};
TYPED_TEST_SUITE(Groups, AllGroups);

TYPED_TEST(Groups, Axioms) {
  using G = TypeParam;
  check::Errors errors;
  for (const double angle : test_angles())
    for (int i = 0; i < 10; ++i)
      check::axioms(this->samples.template element<G>(), G::Exp(this->samples.template tangent<G>(angle)),
                    this->samples.template element<G>(), this->samples.template tangent<G>(1.),
                    this->samples.template vector<G::point_dim>(), errors);
  this->expect(errors, kRounding);
}

TYPED_TEST(Groups, ExpAndLog) {
  using G = TypeParam;
  check::Errors errors;
  for (const double angle : test_angles())
    for (int i = 0; i < 10; ++i)
      for (const double scale : {1., angle})
        check::exponential<G>(this->samples.template tangent<G>(angle, scale), errors);
  this->expect(errors, kRounding);
}

TYPED_TEST(Groups, JacobiansOfExp) {
  using G = TypeParam;
  check::Errors errors;
  for (const double angle : test_angles())
    for (int i = 0; i < 10; ++i)
      for (const double scale : {1., angle})
        check::jacobians<G>(this->samples.template tangent<G>(angle, scale), errors);
  this->expect(errors, kRounding);
}

TYPED_TEST(Groups, Operations) {
  using G = TypeParam;
  check::Errors errors;
  for (const double angle : test_angles()) {
    if (angle > M_PI - 1e-8) continue;  // rounding of x Exp(v) may move its angle past π
    for (int i = 0; i < 10; ++i)
      check::operations(this->samples.template element<G>(), this->samples.template tangent<G>(angle),
                        this->samples.template vector<G::point_dim>(), errors);
  }
  this->expect(errors, kRounding);
}

TYPED_TEST(Groups, DefaultConstructsIdentity) {
  EXPECT_EQ(TypeParam().matrix(), TypeParam::identity().matrix());
  EXPECT_EQ(TypeParam::identity().Log(), TypeParam::Tangent::Zero());
  EXPECT_EQ(TypeParam::Exp(TypeParam::Tangent::Zero()).matrix(), TypeParam::identity().matrix());
}

TYPED_TEST(Groups, AngleReturnsTheRotationAngle) {
  using G = TypeParam;
  constexpr bool rotates = !std::same_as<G, Rn<1>> && !std::same_as<G, Rn<3>>;
  for (const double angle : test_angles())
    EXPECT_NEAR(G::angle(this->samples.template tangent<G>(angle, 10.)), rotates ? angle : 0., 2e-15 * angle);
}

TYPED_TEST(Groups, CastPreservesTheElement) {
  const TypeParam x = this->samples.template element<TypeParam>();
  EXPECT_EQ(x.template cast<double>().matrix(), x.matrix());
  const auto difference = (x.template cast<float>().matrix() - x.matrix().template cast<float>()).eval();
  EXPECT_LE(difference.cwiseAbs().maxCoeff(),
            2e-6f);  // entries reach about 5; single precision rounds at 6e-8
}

// At θ = π the rotation vectors ±θ describe the same rotation. Log must return one of them, up to rounding.
TEST(SO3, LogAtPi) {
  Samples samples;
  for (const double past : {0., 1e-15, 1e-12, 1e-9}) {
    for (int i = 0; i < 100; ++i) {
      const Vector<3> axis = samples.vector<3>().normalized();
      const SO3 x = SO3::Exp((M_PI + past) * axis);
      const Vector<3> v = x.Log();
      EXPECT_LE(v.norm(), M_PI + 1e-15);
      EXPECT_LE((SO3::Exp(v).matrix() - x.matrix()).cwiseAbs().maxCoeff(), 2e-15);
      EXPECT_NEAR(std::abs(v.dot(axis)), M_PI - past, 2e-15);
    }
  }
}

TEST(SO3, LogIsIndependentOfQuaternionSign) {
  Samples samples;
  for (const double angle : test_angles()) {
    const SO3 x = SO3::Exp(samples.tangent<SO3>(angle));
    const SO3 y(Eigen::Quaterniond(-x.quaternion().coeffs()));
    EXPECT_LE((x.Log() - y.Log()).cwiseAbs().maxCoeff(), 2e-15) << angle;
  }
}

TEST(SO3, FromMatrixAndQuaternion) {
  Samples samples;
  for (const double angle : test_angles()) {
    const SO3 x = SO3::Exp(samples.tangent<SO3>(angle));
    // Each matrix entry is accurate to 1e-16, and the conversion to a quaternion preserves this accuracy near 0 and π.
    EXPECT_LE((SO3(x.matrix()).matrix() - x.matrix()).cwiseAbs().maxCoeff(), 2e-15) << angle;
    EXPECT_LE((SO3(Eigen::Quaterniond(3. * x.quaternion().coeffs())).matrix() - x.matrix()).cwiseAbs().maxCoeff(),
              2e-15);
  }
}

// Each product changes the quaternion's norm by about 1e-16, as a random walk or, in the worst case, in one direction.
TEST(SO3, LongProductsRemainOrthogonal) {
  Samples samples;
  const SO3 step = SO3::Exp(samples.tangent<SO3>(0.01));
  SO3 x;
  for (int i = 0; i < 100000; ++i) x = x * step;
  EXPECT_LE((x.matrix() * x.matrix().transpose() - Matrix<3, 3>::Identity()).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(SO2, LogIsBetweenMinusPiAndPi) {
  EXPECT_NEAR(SO2(3. * M_PI / 2.).angle(), -M_PI / 2., 1e-15);
  EXPECT_NEAR((SO2(2.) * SO2(2.)).angle(), 4. - 2. * M_PI, 1e-15);
  EXPECT_DOUBLE_EQ(SO2(M_PI).angle(), M_PI);
}

// Far from the origin, the Jacobian of the action with respect to the point still equals the rotation matrix, up to
// rounding.
TEST(Act, PointJacobianFarFromTheOrigin) {
  Samples samples;
  const SO3 R = samples.element<SO3>();
  const SE3 x(R, Vector<3>(4.5e5, 5.2e6, -30.));  // UTM coordinates [m]
  Matrix<3, 3> Jp;
  act(x, Vector<3>(samples.vector<3>()), nullptr, &Jp);
  EXPECT_LE((Jp - R.matrix()).cwiseAbs().maxCoeff(), 1e-15);
}

}  // namespace
}  // namespace tandem
