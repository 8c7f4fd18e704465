#pragma once

#include <tandem/residuals/constant_twist.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {

template <class G>
class ConstantTwistTest : public ::testing::Test {
 protected:
  const G t0 = G::Exp(tangent<G>(1.1, 12.0));

  /// Steps from zero to rotations by nearly π, with different ratios dt2 / dt1.
  static std::vector<std::pair<typename G::Tangent, ConstantTwist<G>>> steps() {
    using std::numbers::pi;
    return {{tangent<G>(0.0, 0.0), {1.0, 1.0}},        {tangent<G>(1e-9, 1e-9), {1.0, 0.7}},
            {tangent<G>(0.05, 1.5), {0.9, 1.3}},       {tangent<G>(1.4, 6.0), {2.0, 0.5}},
            {tangent<G>(pi - 1e-3, 2.0), {1.0, 1.25}}, {tangent<G>(pi - 1e-6, 2.0), {4.0, 3.0}}};
  }
};

TYPED_TEST_SUITE_P(ConstantTwistTest);

TYPED_TEST_P(ConstantTwistTest, IsLogOfTheLastStepError) {
  using G = TypeParam;
  for (const auto& [d1, residual] : this->steps())
    for (const auto& e : residual_sizes<G>()) {
      const double alpha = residual.dt2 / residual.dt1;
      const G t1 = this->t0 * G::Exp(d1), t2 = t1 * G::Exp(alpha * d1) * G::Exp(e);
      typename G::Tangent r;
      residual(this->t0, t1, t2, r);
      // Near π, Log amplifies the rounding errors of the product, by at most about 1e2.
      EXPECT_LE(difference(e, r), 1e-13);
      EXPECT_LE(difference(plain(t2), plain(this->t0) * expm<G>(d1) * expm<G>(alpha * d1) * expm<G>(r)), 1e-13);
    }
}

TYPED_TEST_P(ConstantTwistTest, VanishesAlongConstantTwist) {
  using G = TypeParam;
  const typename G::Tangent twist = tangent<G>(0.3, 1.2);  // per second; a circular arc or a helix
  for (const auto& [dt1, dt2] : {std::pair{1.0, 1.0}, {0.2, 1.7}, {3.0, 0.01}}) {
    const G t1 = this->t0 * G::Exp(dt1 * twist), t2 = this->t0 * G::Exp((dt1 + dt2) * twist);
    typename G::Tangent r;
    ConstantTwist<G>{dt1, dt2}(this->t0, t1, t2, r);
    // Positions of about 20 m with errors of a few units in the last place, amplified by the extrapolation factor α.
    EXPECT_LE(r.norm(), 2e-14 * (1.0 + dt2 / dt1)) << dt1 << ", " << dt2;
  }
}

TYPED_TEST_P(ConstantTwistTest, HasCorrectJacobians) {
  using G = TypeParam;
  for (const auto& [d1, residual] : this->steps())
    for (const auto& e : residual_sizes<G>()) {
      const G t1 = this->t0 * G::Exp(d1), t2 = t1 * G::Exp(residual.dt2 / residual.dt1 * d1) * G::Exp(e);
      expect_correct_jacobians(residual, this->t0, t1, t2);
    }
}

TYPED_TEST_P(ConstantTwistTest, HasCorrectJacobiansAtRandomStates) {
  expect_correct_jacobians_at_random_states(ConstantTwist<TypeParam>{1.0, 1.0}, 1);
  expect_correct_jacobians_at_random_states(ConstantTwist<TypeParam>{0.4, 0.9}, 2);
  expect_correct_jacobians_at_random_states(ConstantTwist<TypeParam>{1.0, 0.15}, 3);
}

REGISTER_TYPED_TEST_SUITE_P(ConstantTwistTest, IsLogOfTheLastStepError, VanishesAlongConstantTwist, HasCorrectJacobians,
                            HasCorrectJacobiansAtRandomStates);

}  // namespace tandem::testing
