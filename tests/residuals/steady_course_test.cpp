#include <gtest/gtest.h>

#include <tandem/lie/se2.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/steady_course.hpp>
#include <tandem/residuals/usbl_position.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

template <class G>
class SteadyCourseTest : public ::testing::Test {};
using SteadyCourseGroups = ::testing::Types<SE2, SE3>;
TYPED_TEST_SUITE(SteadyCourseTest, SteadyCourseGroups);

TYPED_TEST(SteadyCourseTest, EqualsTheResidualAtThePredictedPose) {
  using G = TypeParam;
  const G chaser = G::Exp(tangent<G>(0.4, 3.0)), first = G::Exp(tangent<G>(-1.1, 20.0));
  typename G::Tangent way = G::Tangent::Zero();
  way[0] = 7.0 * 1.5;
  const RelativePose<G> pose{G::Exp(tangent<G>(0.9, 5.0))};
  typename G::Tangent expected, r;
  pose(chaser, first * G::Exp(way), expected);
  SteadyCourse{pose, 7.0}(chaser, first, Rn<1>(Vector<1>(1.5)), r);
  EXPECT_LE((r - expected).norm(), 1e-13);
}

TYPED_TEST(SteadyCourseTest, HasCorrectJacobians) {
  using G = TypeParam;
  for (const double t : {0.0, 1.0, 300.0}) {
    expect_correct_jacobians_at_random_states(SteadyCourse{RelativePose<G>{G::Exp(tangent<G>(0.9, 5.0))}, t}, 3);
    expect_correct_jacobians_at_random_states(SteadyCourse{UsblPosition<G>{Vector<G::point_dim>::Ones()}, t}, 4);
  }
}

}  // namespace
}  // namespace tandem::testing
