#pragma once

#include <tandem/residuals/white_noise_acceleration.hpp>

#include "residuals/autodiff.hpp"

namespace tandem::testing {

template <class G>
class WhiteNoiseAccelerationTest : public ::testing::Test {
 protected:
  using Prior = WhiteNoiseAcceleration<G>;
  using Twist = Rn<G::dof>;
  const G t0 = G::Exp(tangent<G>(1.1, 12.0));
  const Twist w0{tangent<G>(0.3, 1.2)}, w1{tangent<G>(-0.7, 0.4)};  // per second
};

TYPED_TEST_SUITE_P(WhiteNoiseAccelerationTest);

TYPED_TEST_P(WhiteNoiseAccelerationTest, VanishesAlongConstantTwist) {
  using G = TypeParam;
  for (const double dt : {0.01, 1.0, 5.0}) {
    Vector<2 * G::dof> r;
    WhiteNoiseAcceleration<G>{dt}(this->t0, this->w0, this->t0 * G::Exp(dt * this->w0.vector()), this->w0, r);
    EXPECT_LE(r.norm(), 4e-14) << dt;
  }
}

TYPED_TEST_P(WhiteNoiseAccelerationTest, MatchesItsDefinition) {
  using G = TypeParam;
  constexpr int n = G::dof;
  for (const auto& d : residual_sizes<G>()) {
    Vector<2 * n> r, expected;
    WhiteNoiseAcceleration<G>{0.8}(this->t0, this->w0, this->t0 * G::Exp(d), this->w1, r);
    expected << d - 0.8 * this->w0.vector(), G::Jr_inverse(d) * this->w1.vector() - this->w0.vector();
    EXPECT_LE(difference(expected, r), 1e-13);
  }
}

TYPED_TEST_P(WhiteNoiseAccelerationTest, ComparesRatesOfTheLogarithm) {
  // d/dt Log(T0⁻¹ T(t)) = Jr⁻¹ ϖ, where ϖ is the twist of T(t); here by differences along T1 Exp(h ϖ1).
  using G = TypeParam;
  constexpr int n = G::dof;
  const G t1 = this->t0 * G::Exp(tangent<G>(1.9, 3.0));
  const auto log_at = [&](double h, double* v) {
    const typename G::Tangent log = (this->t0.inverse() * t1 * G::Exp(h * this->w1.vector())).Log();
    std::copy_n(log.data(), n, v);
  };
  const auto [rate, uncertainty] = detail::differentiate(n, log_at, 10.0);
  Vector<2 * n> r;
  WhiteNoiseAcceleration<G>{0.8}(this->t0, this->w0, t1, this->w1, r);
  EXPECT_LE((r.template tail<n>() + this->w0.vector() - rate).norm(), 1e-10 + uncertainty);
}

TYPED_TEST_P(WhiteNoiseAccelerationTest, HasCorrectJacobians) {
  using G = TypeParam;
  const WhiteNoiseAcceleration<G> prior{0.8};
  for (const auto& d : residual_sizes<G>())
    expect_correct_jacobians(prior, this->t0, this->w0, G(this->t0 * G::Exp(d)), this->w1);
}

TYPED_TEST_P(WhiteNoiseAccelerationTest, HasCorrectJacobiansAtRandomStates) {
  expect_correct_jacobians_at_random_states(WhiteNoiseAcceleration<TypeParam>{0.8}, 1);
}

REGISTER_TYPED_TEST_SUITE_P(WhiteNoiseAccelerationTest, VanishesAlongConstantTwist, MatchesItsDefinition,
                            ComparesRatesOfTheLogarithm, HasCorrectJacobians, HasCorrectJacobiansAtRandomStates);

}  // namespace tandem::testing
