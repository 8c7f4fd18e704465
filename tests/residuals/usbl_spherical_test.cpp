#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/usbl_spherical.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

using std::numbers::pi;

template <class T>
class UsblSphericalTest : public ::testing::Test {
 protected:
  const SE3 B = SE3::Exp(tangent<SE3>(1.7, 0.5));
  const Vector<3> beacon = T::dof == 3 ? Vector<3>(0.0, 0.0, 0.0) : Vector<3>(-0.4, 0.2, 0.9);
  const UsblSpherical<SE3, T> residual{25.0, 2.1, -0.4, B, beacon};
};
using Targets = ::testing::Types<SE3, R3>;
TYPED_TEST_SUITE(UsblSphericalTest, Targets);

TYPED_TEST(UsblSphericalTest, MeasurementAndResidualGiveTheTargetPosition) {
  using T = TypeParam;
  for (const double angle : {0.0, 1e-6, 0.5, 3.0})
    for (const double size : {0.0, 1.0, 300.0}) {
      const SE3 c = SE3::Exp(tangent<SE3>(angle, 20.0));
      const T t = T::Exp(tangent<T>(-angle, size));
      Vector<3> r;
      this->residual(c, t, r);
      const double range = 25.0 + r[0], azimuth = 2.1 + r[1], elevation = -0.4 + r[2];
      EXPECT_LE(std::abs(r[1]), pi);
      const Vector<3> p = range * Vector<3>(std::cos(azimuth) * std::cos(elevation),
                                            std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
      EXPECT_LE((c.act(this->B.act(p)) - t.act(this->beacon)).norm(), 5e-13) << angle << ", " << size;
    }
}

TYPED_TEST(UsblSphericalTest, HasCorrectJacobians) {
  using T = TypeParam;
  for (const double angle : {0.0, 1e-9, 0.5, 3.0, pi - 1e-6})
    for (const double size : {0.0, 1.0, 300.0})
      expect_correct_jacobians(this->residual, SE3::Exp(tangent<SE3>(angle, 20.0)), T::Exp(tangent<T>(-angle, size)));
  expect_correct_jacobians_at_random_states(this->residual, 5);
}

TEST(UsblSpherical, MatchesHandCalculation) {
  Vector<3> r;
  // (3, 4, 0) and (0, −3, 4) are 5 m away, at azimuths atan(4/3) and −90° and elevations 0 and asin(0.8).
  UsblSpherical<SE3, R3>{4.0, 0.5, 0.1}(SE3(), R3(Vector<3>(3.0, 4.0, 0.0)), r);
  EXPECT_LE((r - Vector<3>(1.0, std::atan2(4.0, 3.0) - 0.5, -0.1)).norm(), 1e-15);
  UsblSpherical<SE3, R3>{5.0, -1.5, 1.0}(SE3(), R3(Vector<3>(0.0, -3.0, 4.0)), r);
  EXPECT_LE((r - Vector<3>(0.0, 1.5 - pi / 2, std::asin(0.8) - 1.0)).norm(), 1e-15);
  // Across the discontinuity behind the sensor: from 179° to −179° is 2°.
  const double degree = pi / 180;
  const R3 behind(Vector<3>(-std::cos(degree), -std::sin(degree), 0.0));
  UsblSpherical<SE3, R3>{1.0, 179 * degree, 0.0}(SE3(), behind, r);
  EXPECT_NEAR(r[1], 2 * degree, 1e-15);
}

TEST(UsblSpherical, ThrowsOnTheZAxisAndAtTheSensor) {
  const auto message = [](const Vector<3>& p) {
    Vector<3> r;
    try {
      UsblSpherical<SE3, R3>{5.0, 0.0, 0.0}(SE3(), R3(p), r);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(message(Vector<3>::Zero()), HasSubstr("undefined if the target is at the sensor"));
  EXPECT_THAT(message({0.0, 0.0, 3.0}), HasSubstr("azimuth is undefined on the z axis"));
  EXPECT_THAT(message({0.0, 1e-8, -3.0}), HasSubstr("azimuth is undefined on the z axis"));
  EXPECT_EQ(message({0.0, 1e-7, -3.0}), "no error");
}

TEST(UsblSpherical, JacobianMatchesDualNumbersNearThePole) {
  for (const double gap : {1e-2, 1e-4, 1e-6})
    EXPECT_LE(autodiff_error(UsblSpherical<SE3, R3>{5.0, 0.0, 0.0}, SE3(), R3(Vector<3>(gap, gap, 3.0))), 1e-15);
}

}  // namespace
}  // namespace tandem::testing
