// Every Jacobian of operations.hpp against central differences.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include <tandem/lie/testing.hpp>

#include "samples.hpp"

namespace tandem {
namespace {

template <class G>
class Differences : public ::testing::Test {};
TYPED_TEST_SUITE(Differences, AllGroups);

TYPED_TEST(Differences, MatchAllJacobians) {
  using G = TypeParam;
  Samples samples;
  for (const double angle : test_angles()) {
    // Log is discontinuous at π, so the steps cover at most a quarter of the distance to it. At π − 1e-9 this leaves 7
    // digits.
    const double step = std::min(1e-3, (M_PI - angle) / 8.);
    check::Errors errors;
    for (const double s : {0., 0.3, 1., 1.5})
      for (int i = 0; i < 3; ++i)
        check::differences(samples.element<G>(), samples.tangent<G>(angle), samples.vector<G::point_dim>(), s, step,
                           errors);
    // Truncation: step⁴/30 f⁽⁵⁾ with f⁽⁵⁾ of order 10. Rounding: entries of order 5 have errors of a few 1e-15, and the
    // formula amplifies them by 1.5 / step.
    const double tolerance = std::pow(step, 4) + 5e-15 / step;
    EXPECT_EQ(errors.report(tolerance), "") << "angle " << angle;
  }
}

}  // namespace
}  // namespace tandem
