#include <gtest/gtest.h>

#include <tandem/residuals/twist_components.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {
namespace {

template <class R>
class TwistComponentsTest : public ::testing::Test {};

/// A residual and its expected rows of the tangent.
template <class G, TwistAxes axes, int... rows>
struct Case {
  using Group = G;
  using Residual = TwistComponents<G, axes>;
  static constexpr std::array<int, sizeof...(rows)> expected{rows...};
};
using Cases = ::testing::Types<Case<SE3, surge, 0>, Case<SE3, sway | heave, 1, 2>, Case<SE3, yaw_rate, 5>,
                               Case<SE3, surge | roll_rate | yaw_rate, 0, 3, 5>,
                               Case<SE3, surge | sway | heave | roll_rate | pitch_rate | yaw_rate, 0, 1, 2, 3, 4, 5>,
                               Case<SE2, sway, 1>, Case<SE2, yaw_rate, 2>, Case<SE2, surge | yaw_rate, 0, 2>,
                               Case<SE2, surge | sway | yaw_rate, 0, 1, 2>>;
TYPED_TEST_SUITE(TwistComponentsTest, Cases);

TYPED_TEST(TwistComponentsTest, AreRowsOfTheMeanTwist) {
  using G = typename TypeParam::Group;
  static_assert(TypeParam::Residual::dim == TypeParam::expected.size());
  const G x0 = G::Exp(tangent<G>(1.3, 9.0));
  for (const double dt : {0.05, 1.0, 7.0})
    for (const auto& d : residual_sizes<G>()) {
      const G x1 = x0 * G::Exp(d);
      EXPECT_LE(difference(plain(x1), plain(x0) * expm<G>(d)), 1e-14);
      Vector<TypeParam::Residual::dim> r;
      typename TypeParam::Residual{dt}(x0, x1, r);
      for (std::size_t i = 0; i < TypeParam::expected.size(); ++i)
        EXPECT_NEAR(r[int(i)] * dt, d[TypeParam::expected[i]], 1e-14 * (1.0 + d.norm()));
    }
}

TYPED_TEST(TwistComponentsTest, HaveCorrectJacobians) {
  using G = typename TypeParam::Group;
  const G x0 = G::Exp(tangent<G>(1.3, 9.0));
  for (const auto& d : residual_sizes<G>())
    for (const double dt : {0.05, 1.0, 7.0}) {
      const typename TypeParam::Residual residual{dt};
      expect_correct_jacobians(residual, x0, G(x0 * G::Exp(d)));
    }
  const typename TypeParam::Residual residual{0.6};
  expect_correct_jacobians_at_random_states(residual, 1);
}

TEST(TwistComponents, MatchHandCalculationOnACircle) {
  // Half a circle of radius 2 m in 4 s to the left: surge π/2 m/s, no sway, yaw rate π/4 rad/s.
  using std::numbers::pi;
  const SE2 x0(SO2(0.0), Vector<2>(0.0, 0.0)), quarter(SO2(pi / 2), Vector<2>(2.0, 2.0));
  Vector<3> r;
  TwistComponents<SE2, surge | sway | yaw_rate>{2.0}(x0, quarter, r);
  EXPECT_LE((r - Vector<3>(pi / 2, 0.0, pi / 4)).norm(), 1e-15);
}

TEST(TwistComponents, OrderOfAxesIsIrrelevant) {
  static_assert(std::is_same_v<TwistComponents<SE3, sway | heave>, TwistComponents<SE3, heave | sway>>);
  static_assert(TwistComponents<SE3, sway | sway>::dim == 1);
}

}  // namespace
}  // namespace tandem::testing
