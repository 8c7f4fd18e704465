#include <gtest/gtest.h>

#include <tandem/lie/se2.hpp>
#include <tandem/residuals/boundary.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

TEST(Boundary, IsPosePositionMinusPoint) {
  Vector<3> r;
  Boundary<>{}(SE3(SO3::Exp({0.3, -2.0, 1.0}), Vector<3>(1.0, 2.0, 3.0)), R3(Vector<3>(0.5, 4.0, 3.0)), r);
  EXPECT_EQ(r, Vector<3>(0.5, -2.0, 0.0));
  Vector<2> planar;
  Boundary<SE2>{}(SE2(SO2(2.0), Vector<2>(1.0, 2.0)), R2(Vector<2>(4.0, 0.0)), planar);
  EXPECT_EQ(planar, Vector<2>(-3.0, 2.0));
}

TEST(Boundary, HasCorrectJacobians) {
  for (const double angle : {0.0, 1e-9, 0.5, 3.0, std::numbers::pi - 1e-6}) {
    expect_correct_jacobians(Boundary<>{}, SE3::Exp(tangent<SE3>(angle, 20.0)), R3(Vector<3>(1.0, -3.0, 300.0)));
    expect_correct_jacobians(Boundary<SE2>{}, SE2::Exp(tangent<SE2>(angle, 20.0)), R2(Vector<2>(1.0, 300.0)));
  }
  expect_correct_jacobians_at_random_states(Boundary<>{}, 1);
  expect_correct_jacobians_at_random_states(Boundary<SE2>{}, 2);
  expect_correct_jacobians_at_random_states(Boundary<SE23>{}, 3);
}

}  // namespace
}  // namespace tandem::testing
