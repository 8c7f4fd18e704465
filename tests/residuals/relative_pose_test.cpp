#include <gtest/gtest.h>

#include <tandem/lie/se2.hpp>
#include <tandem/residuals/relative_pose.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

template <class G>
class RelativePoseTest : public ::testing::Test {
 protected:
  const G z = G::Exp(tangent<G>(0.8, 4.0)), B = G::Exp(tangent<G>(2.1, 0.6)), F = G::Exp(tangent<G>(-1.4, 1.1)),
          x = G::Exp(tangent<G>(1.9, 30.0));
};
using RelativePoseGroups = ::testing::Types<SE3, SE2, SO3>;
TYPED_TEST_SUITE(RelativePoseTest, RelativePoseGroups);

TYPED_TEST(RelativePoseTest, IsLogOfItsDefinition) {
  using G = TypeParam;
  for (const bool extrinsics : {false, true}) {
    const RelativePose<G> residual = extrinsics ? RelativePose<G>{this->z, this->B, this->F} : RelativePose<G>{this->z};
    for (const auto& e : residual_sizes<G>()) {
      const G y = this->x * residual.B * this->z * G::Exp(e) * residual.F.inverse();
      typename G::Tangent r;
      residual(this->x, y, r);
      EXPECT_LE(difference(e, r), 3e-14);  // a few units in the last place of 30 m
      // Z⁻¹ (X B)⁻¹ (Y F) = expm(e), with the inverses moved to the other side.
      EXPECT_LE(
          difference(plain(y) * plain(residual.F), plain(this->x) * plain(residual.B) * plain(this->z) * expm<G>(r)),
          1e-14);
    }
  }
}

TYPED_TEST(RelativePoseTest, HasCorrectJacobians) {
  using G = TypeParam;
  for (const auto& e : residual_sizes<G>()) {
    expect_correct_jacobians(RelativePose<G>{this->z}, this->x, G(this->x * this->z * G::Exp(e)));
    expect_correct_jacobians(RelativePose<G>{this->z, this->B, this->F}, this->x,
                             G(this->x * this->B * this->z * G::Exp(e) * this->F.inverse()));
    expect_correct_jacobians(RelativePose<G>{}, this->x, G(this->x * G::Exp(e)));
  }
  expect_correct_jacobians_at_random_states(RelativePose<G>{}, 1);
  expect_correct_jacobians_at_random_states(RelativePose<G>{this->z}, 2);
  expect_correct_jacobians_at_random_states(RelativePose<G>{this->z, this->B, this->F}, 3);
}

TEST(RelativePose, MatchesHandCalculation) {
  // The chaser at (10, 0, 0) looks along +y; the target 5 m along +y with the same heading is 5 m ahead.
  const SO3 left = SO3::Exp({0.0, 0.0, std::numbers::pi / 2});
  const SE3 chaser(left, Vector<3>(10.0, 0.0, 0.0)), target(left, Vector<3>(10.0, 5.0, 0.0));
  const SE3 ahead(SO3(), Vector<3>(5.0, 0.0, 0.0));
  Vector<6> r;
  RelativePose<>{ahead}(chaser, target, r);
  EXPECT_LE(r.norm(), 4e-15);  // two units in the last place of 10 m
  // With a camera 1 m ahead of the chaser's origin and a marker 2 m behind the target's, 2 m remain.
  const SE3 camera(SO3(), Vector<3>(1.0, 0.0, 0.0)), marker(SO3(), Vector<3>(-2.0, 0.0, 0.0));
  RelativePose<>{SE3(), camera, marker}(chaser, target, r);
  EXPECT_LE((r - (Vector<6>() << 2.0, 0.0, 0.0, 0.0, 0.0, 0.0).finished()).norm(), 4e-15);
}

}  // namespace
}  // namespace tandem::testing
