#include <limits>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <tandem/residuals/direction.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

using std::numbers::pi;

/// Returns the unit vector at `angle` from the direction, towards e1 cos(heading) + e2 sin(heading), by Exp on S².
Vector<3> turned(const Direction<3>& d, double angle, double heading) {
  return std::cos(angle) * d.unit() + std::sin(angle) * d.axes() * Vector<2>(std::cos(heading), std::sin(heading));
}

TEST(Direction, AxesPointToIncreasingAzimuthAndElevation) {
  for (const double azimuth : {-3.0, -0.7, 0.0, 1.2, 3.1})
    for (const double elevation : {-1.5, -0.4, 0.0, 0.9}) {
      const Direction<3> d(azimuth, elevation);
      const double h = 1e-6;
      const Vector<3> by_azimuth = Direction<3>(azimuth + h, elevation).unit() - d.unit();
      const Vector<3> by_elevation = Direction<3>(azimuth, elevation + h).unit() - d.unit();
      EXPECT_LE((d.axes().col(0) - by_azimuth / (h * std::cos(elevation))).norm(), 1e-5);
      EXPECT_LE((d.axes().col(1) - by_elevation / h).norm(), 1e-5);
      Matrix<3, 3> frame;
      frame << d.unit(), d.axes();
      EXPECT_LE((frame.transpose() * frame - Matrix<3, 3>::Identity()).norm(), 5e-16);
      EXPECT_LE((d.axes().col(0).cross(d.axes().col(1)) - d.unit()).norm(), 5e-16);
    }
  EXPECT_LE((Direction<3>(pi / 2, 0.0).unit() - Vector<3>(0, 1, 0)).norm(), 1e-16);
  EXPECT_LE((Direction<3>(0.0, pi / 6).unit() - Vector<3>(std::sqrt(0.75), 0, 0.5)).norm(), 2e-16);
}

TEST(Direction, VectorAndAnglesGiveTheSameDirection) {
  for (const double azimuth : {-3.0, 0.0, 1.2})
    for (const double elevation : {-1.5, 0.0, 0.9})
      for (const double length : {1e-9, 1.0, 1e6}) {
        const Direction<3> d(azimuth, elevation), v(Vector<3>(length * d.unit()));
        EXPECT_LE((v.unit() - d.unit()).norm(), 4e-16);
        EXPECT_LE((v.axes() - d.axes()).norm(), 1e-14);  // the azimuth is accurate to 1e-16 / cos(elevation)
      }
  const Direction<3> up(Vector<3>(0.0, 0.0, 2.0));  // azimuth 0
  EXPECT_LE((up.unit() - Vector<3>(0, 0, 1)).norm(), 1e-16);
  EXPECT_LE((up.axes() - (Matrix<3, 2>() << 0, -1, 1, 0, 0, 0).finished()).norm(), 1e-16);
  EXPECT_LE((Direction<2>(Vector<2>(-3.0, 3.0)).unit() - Direction<2>(3 * pi / 4).unit()).norm(), 2e-16);
}

TEST(Direction, LogIsAccurateFromZeroToNearlyPi) {
  const Direction<3> d(0.8, -0.6);
  for (const double angle :
       {0.0, 1e-300, 1e-12, 1e-6, 0.03, 0.0316, 0.032, 0.5, 1.5, pi / 2, 2.0, 3.0, pi - 1e-3, pi - 1e-6})
    for (const double heading : {0.0, 0.4, 2.0, -2.9})
      for (const double length : {1e-6, 1.0, 1e4}) {
        const Vector<2> e = d.log(Vector<3>(length * turned(d, angle, heading)));
        // Rounding of the point causes an error across the direction, amplified by the angle over its sine.
        const Vector<2> expected = angle * Vector<2>(std::cos(heading), std::sin(heading));
        EXPECT_LE((e - expected).norm(), 4e-16 * std::max(1.0, angle / std::sin(angle))) << angle;
      }
}

TEST(Direction, LogHasCorrectDerivative) {
  using Jet = ceres::Jet<double, 3>;
  const Direction<3> d(0.8, -0.6);
  for (const double angle : {0.0, 1e-12, 1e-6, 0.03, 0.0316, 0.032, 0.5, 1.5, pi / 2, 2.0, 3.0, pi - 1e-3, pi - 1e-6})
    for (const double length : {1e-6, 1.0, 1e4}) {
      const Vector<3> p = length * turned(d, angle, 0.4);
      Vector<3, Jet> dual;
      for (int k = 0; k < 3; ++k) dual[k] = Jet(p[k], k);
      Matrix<2, 3> by_p;
      d.log(p, &by_p);
      const Vector<2, Jet> e = d.log(dual);
      // Near π both depend on the direction of rotation, which is accurate to 1e-16 / (π − angle) only.
      const double tolerance = 1e-14 + 2e-16 / (pi - angle);
      for (int i = 0; i < 2; ++i)
        EXPECT_LE((e[i].v.transpose() - by_p.row(i)).norm(), tolerance * by_p.norm()) << angle << ", " << length;
    }
}

TEST(Direction, LogThrowsAtTheOppositeDirection) {
  const Direction<3> d(0.8, -0.6);
  EXPECT_THROW(d.log(Vector<3>(-7.0 * d.unit())), Error);
  EXPECT_THROW(d.log(turned(d, pi - 1e-9, 1.0)), Error);
  EXPECT_NEAR(d.log(turned(d, pi - 1e-7, 1.0)).norm(), pi - 1e-7, 1e-15);
}

TEST(Direction, PlanarLogIsWrappedAngle) {
  const auto between = [](double from, double to) {
    return Direction<2>(from).log(Vector<2>(7.0 * std::cos(to), 7.0 * std::sin(to)))[0];
  };
  EXPECT_NEAR(between(0.2, 0.5), 0.3, 1e-15);
  EXPECT_NEAR(between(3.0, -3.0), 2.0 * pi - 6.0, 1e-15);
  EXPECT_NEAR(between(-3.0, 3.0), 6.0 - 2.0 * pi, 1e-15);
  EXPECT_NEAR(between(100.0, 100.1), 0.1, 1e-13);
}

TEST(Direction, RejectsZeroAndNonFiniteVectors) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  EXPECT_THROW(static_cast<void>(Direction<3>(Vector<3>::Zero())), Error);
  EXPECT_THROW(Direction<3>(Vector<3>(nan, 1.0, 0.0)), Error);
  EXPECT_THROW(Direction<3>(Vector<3>(infinity, 1.0, 0.0)), Error);
  EXPECT_THROW(Direction<3>(nan, 0.0), Error);
  EXPECT_THROW(Direction<3>(0.0, infinity), Error);
  EXPECT_THROW(static_cast<void>(Direction<2>(Vector<2>::Zero())), Error);
  EXPECT_THROW(Direction<2>{nan}, Error);
}

}  // namespace
}  // namespace tandem::testing
