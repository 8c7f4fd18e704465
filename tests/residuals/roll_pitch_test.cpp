#include <string>

#include <gtest/gtest.h>

#include <tandem/residuals/roll_pitch.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

using std::numbers::pi;

SO3 from_angles(double heading, double pitch, double roll) {
  return SO3::Exp({0.0, 0.0, heading}) * SO3::Exp({0.0, pitch, 0.0}) * SO3::Exp({roll, 0.0, 0.0});
}

template <class G>
G with_rotation(const SO3& R) {
  if constexpr (std::is_same_v<G, SO3>)
    return R;
  else
    return G(R, Vector<3>(7.0, -30.0, 2.0));
}

template <class G>
Vector<2> value(const SO3& R) {
  Vector<2> r;
  RollPitch<G>{}(with_rotation<G>(R), r);
  return r;
}

template <class G>
class RollPitchTest : public ::testing::Test {};
using RollPitchGroups = ::testing::Types<SE3, SO3>;
TYPED_TEST_SUITE(RollPitchTest, RollPitchGroups);

TYPED_TEST(RollPitchTest, IsLogOfTheRotationToLevel) {
  for (const double heading : {-3.0, 0.0, 0.4, 2.0})
    for (const double pitch : {-1.5, -0.3, 0.0, 1e-9, 0.7, 1.57})
      for (const double roll : {-3.1, -0.5, 0.0, 1e-8, 1.2, 3.0}) {
        const SO3 R = from_angles(heading, pitch, roll);
        // Reference: Rz(ψ)⁻¹ R = Ry(pitch) Rx(roll) by plain matrices; the residual is the head of the logarithm of its
        // inverse.
        const Matrix<3, 3> Ry{
            {std::cos(pitch), 0.0, std::sin(pitch)}, {0.0, 1.0, 0.0}, {-std::sin(pitch), 0.0, std::cos(pitch)}};
        const Matrix<3, 3> Rx{
            {1.0, 0.0, 0.0}, {0.0, std::cos(roll), -std::sin(roll)}, {0.0, std::sin(roll), std::cos(roll)}};
        const Eigen::AngleAxisd to_level(Matrix<3, 3>((Ry * Rx).transpose()));
        const Vector<3> e = to_level.angle() * to_level.axis();
        // The heading is only accurate to 1e-15 / cos(pitch), which affects the third row of e.
        EXPECT_LE((value<TypeParam>(R) - e.head<2>()).norm(), 1e-14 / std::cos(pitch))
            << heading << " " << pitch << " " << roll;
      }
}

TYPED_TEST(RollPitchTest, IsMinusRollOrPitchIfTheOtherIsZero) {
  for (const double angle : {-1.2, -1e-7, 0.0, 0.3, 1.5}) {
    EXPECT_LE((value<TypeParam>(from_angles(0.8, 0.0, angle)) - Vector<2>(-angle, 0.0)).norm(), 1e-15);
    EXPECT_LE((value<TypeParam>(from_angles(0.8, angle, 0.0)) - Vector<2>(0.0, -angle)).norm(), 1e-14);
  }
}

TYPED_TEST(RollPitchTest, IsIndependentOfHeading) {
  using G = TypeParam;
  const Vector<2> expected = value<G>(from_angles(0.0, 0.4, -0.7));
  for (double heading = -6.0; heading < 6.5; heading += 0.5) {
    const SO3 R = from_angles(heading, 0.4, -0.7);
    EXPECT_LE((value<G>(R) - expected).norm(), 1e-15 * 4);
    Vector<2> r;
    Matrix<2, G::dof> J;
    RollPitch<G>{}(with_rotation<G>(R), r, &J);
    // A rotation about the world's vertical is a rotation about Rᵀ z and has no effect; neither has the position.
    EXPECT_LE((J.template rightCols<3>() * R.matrix().row(2).transpose()).norm(), 1e-15 * 4);
    EXPECT_EQ((J.template leftCols<G::dof - 3>().cwiseAbs().sum()), 0.0);
  }
}

TYPED_TEST(RollPitchTest, HasCorrectJacobian) {
  using G = TypeParam;
  for (const double heading : {-3.0, 0.0, 0.4, pi})
    for (const double pitch : {-1.4, -0.3, 0.0, 1e-9, 0.7})
      for (const double roll : {-3.1, -0.5, 0.0, 1e-8, 1.2, pi - 1e-3, pi - 1e-6})
        expect_correct_jacobians(RollPitch<G>{}, with_rotation<G>(from_angles(heading, pitch, roll)));
  expect_correct_jacobians_at_random_states(RollPitch<G>{}, 1);
}

TYPED_TEST(RollPitchTest, ThrowsAtPitch90Degrees) {
  using G = TypeParam;
  for (const double pitch : {-pi / 2, pi / 2})
    for (const double heading : {0.0, 1.0})
      for (const double roll : {0.0, -2.0}) try {
          value<G>(from_angles(heading, pitch, roll));
          ADD_FAILURE() << "no error at " << pitch << " " << heading << " " << roll;
        } catch (const Error& error) {
          EXPECT_NE(std::string(error.what()).find("pitch of ±90 degrees"), std::string::npos) << error.what();
        }
}

TYPED_TEST(RollPitchTest, IsFiniteWhereverItIsDefined) {
  using G = TypeParam;
  int defined = 0;
  for (double gap = 1.0; gap > 1e-17; gap *= 0.5)
    for (const double pitch : {pi / 2 - gap, gap - pi / 2}) try {
        Vector<2> r;
        Matrix<2, G::dof> J;
        RollPitch<G>{}(with_rotation<G>(from_angles(0.3, pitch, 0.2)), r, &J);
        EXPECT_TRUE(r.allFinite() && J.allFinite()) << gap;
        // The heading changes by at most 1/cos(pitch) per rad, and the level attitude is at most π away.
        EXPECT_LE(J.cwiseAbs().maxCoeff(), 4.0 / gap) << gap;
        EXPECT_LE(r.norm(), pi);
        ++defined;
      } catch (const Error&) {
        EXPECT_LT(gap, 2e-8) << "throws too far from 90 degrees";
      }
  EXPECT_GE(defined, 50);
}

TYPED_TEST(RollPitchTest, JacobianMatchesDualNumbersNearPitch90Degrees) {
  // Both use cos(pitch) = gap, whose relative rounding error is 1e-16 / gap.
  for (const double gap : {1e-2, 1e-4, 1e-6})
    EXPECT_LE(autodiff_error(RollPitch<TypeParam>{}, with_rotation<TypeParam>(from_angles(0.3, pi / 2 - gap, 0.2))),
              1e-15 / gap);
}

}  // namespace
}  // namespace tandem::testing
