#pragma once

#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/damped_twist.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {

template <class G>
class DampedTwistTest : public ::testing::Test {
 protected:
  using Tangent = typename G::Tangent;

  /// Time constants from 0.7 s, increasing from component to component; the last one is infinite.
  static Vector<G::dof> time_constants() {
    Vector<G::dof> tau;
    for (int i = 0; i < G::dof; ++i) tau[i] = 0.7 * std::pow(1.8, i);
    tau[G::dof - 1] = HUGE_VAL;
    return tau;
  }
  static Vector<G::dof> mean() { return tangent<G>(0.2, 0.4); }
};

TYPED_TEST_SUITE_P(DampedTwistTest);

TYPED_TEST_P(DampedTwistTest, EqualsConstantTwistWithoutDecay) {
  using G = TypeParam;
  std::mt19937_64 random(5);
  const Vector<G::dof> never = Vector<G::dof>::Constant(HUGE_VAL), late = Vector<G::dof>::Constant(1e9);
  for (int i = 0; i < 12; ++i) {
    const auto [x0, x1, x2] = random_states<std::tuple<G, G, G>>(random, StateDistance(i % 4));
    typename G::Tangent r, expected;
    std::array<typename G::Jacobian, 3> J, K;
    ConstantTwist<G>{0.8, 1.3}(x0, x1, x2, expected, &K[0], &K[1], &K[2]);
    // The mean is irrelevant without decay.
    for (const auto& [tau, within] : {std::pair{never, 1e-13}, {late, 1e-6}}) {
      DampedTwist<G>::over(0.8, 1.3, tau, this->mean())(x0, x1, x2, r, &J[0], &J[1], &J[2]);
      EXPECT_LE((r - expected).norm(), within * (1 + expected.norm()));
      for (std::size_t j = 0; j < 3; ++j) EXPECT_LE((J[j] - K[j]).norm(), within * (1 + K[j].norm()));
    }
  }
  // At keyframes 1 s apart the noise equals that of constant twist, dt2 Σ̄.
  EXPECT_EQ((DampedTwist<G>::noise_scale(1.0, 1.0, never)), Vector<G::dof>::Ones());
  EXPECT_LE((DampedTwist<G>::noise_scale(1.0, 1.0, late) - Vector<G::dof>::Ones()).norm(), 1e-8);
}

TYPED_TEST_P(DampedTwistTest, VanishesAlongDecayingTwist) {
  using G = TypeParam;
  const typename G::Tangent twist = tangent<G>(0.3, 1.2);
  const auto tau = this->time_constants();
  for (const auto& [dt1, dt2] : {std::pair{1.0, 1.0}, {0.2, 1.7}, {3.0, 0.5}}) {
    const double h = 0.5 * (dt1 + dt2);
    typename G::Tangent later = this->mean();
    for (int i = 0; i < G::dof; ++i) later[i] += std::exp(-h / tau[i]) * (twist[i] - this->mean()[i]);
    const G t0 = G::Exp(tangent<G>(1.1, 12.0)), t1 = t0 * G::Exp(dt1 * twist), t2 = t1 * G::Exp(dt2 * later);
    typename G::Tangent r;
    DampedTwist<G>::over(dt1, dt2, tau, this->mean())(t0, t1, t2, r);
    EXPECT_LE(r.norm(), 2e-14 * (1.0 + dt2 / dt1)) << dt1 << ", " << dt2;
  }
}

TYPED_TEST_P(DampedTwistTest, HasCorrectJacobians) {
  using G = TypeParam;
  using std::numbers::pi;
  const G t0 = G::Exp(tangent<G>(1.1, 12.0));
  const auto residual = DampedTwist<G>::over(0.9, 1.3, this->time_constants(), this->mean());
  for (const auto& d1 :
       {tangent<G>(0.0, 0.0), tangent<G>(1e-9, 1e-9), tangent<G>(1.4, 6.0), tangent<G>(pi - 1e-3, 2.0)})
    for (const auto& e : residual_sizes<G>()) {
      const typename G::Tangent d2 = 1.3 / 0.9 * residual.decay.cwiseProduct(d1);
      const G t1 = t0 * G::Exp(d1), t2 = t1 * G::Exp(d2) * G::Exp(e);
      expect_correct_jacobians(residual, t0, t1, t2);
    }
  expect_correct_jacobians_at_random_states(residual, 1);
  expect_correct_jacobians_at_random_states(DampedTwist<G>::over(1.0, 0.15, this->time_constants()), 2);
}

REGISTER_TYPED_TEST_SUITE_P(DampedTwistTest, EqualsConstantTwistWithoutDecay, VanishesAlongDecayingTwist,
                            HasCorrectJacobians);

}  // namespace tandem::testing
