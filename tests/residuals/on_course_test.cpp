#include <gtest/gtest.h>

#include <tandem/lie/se2.hpp>
#include <tandem/residuals/on_course.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/usbl_position.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

template <class G>
class OnCourseTest : public ::testing::Test {};
using OnCourseGroups = ::testing::Types<SE2, SE3>;
TYPED_TEST_SUITE(OnCourseTest, OnCourseGroups);

TYPED_TEST(OnCourseTest, is_the_residual_at_the_place_along_the_course) {
  using G = TypeParam;
  const G chaser = G::Exp(tangent<G>(0.4, 3.0)), first = G::Exp(tangent<G>(-1.1, 20.0));
  typename G::Tangent way = G::Tangent::Zero();
  way[0] = 7.0 * 1.5;
  const RelativePose<G> pose{G::Exp(tangent<G>(0.9, 5.0))};
  typename G::Tangent expected, r;
  pose(chaser, first * G::Exp(way), expected);
  OnCourse{pose, 7.0}(chaser, first, Rn<1>(Vector<1>(1.5)), r);
  EXPECT_LE((r - expected).norm(), 1e-13);
}

TYPED_TEST(OnCourseTest, has_the_right_jacobians) {
  using G = TypeParam;
  for (const double t : {0.0, 1.0, 300.0}) {
    expect_right_jacobians_at_random(OnCourse{RelativePose<G>{G::Exp(tangent<G>(0.9, 5.0))}, t}, 3);
    expect_right_jacobians_at_random(OnCourse{UsblPosition<G>{Vector<G::point_dim>::Ones()}, t}, 4);
  }
}

}  // namespace
}  // namespace tandem::testing
