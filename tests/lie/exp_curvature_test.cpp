#include <random>

#include <gtest/gtest.h>

#include <tandem/lie/exp_curvature.hpp>

namespace tandem {
namespace {

template <class G>
class ExpCurvatureTest : public ::testing::Test {
 protected:
  using Tangent = typename G::Tangent;

  Tangent random(double size) {
    return Tangent::NullaryExpr([&] { return size * normal_(random_); });
  }

 private:
  std::mt19937_64 random_{3};
  std::normal_distribution<double> normal_;
};
using Groups = ::testing::Types<SO3, SE3, SE23, R3, SE2>;
TYPED_TEST_SUITE(ExpCurvatureTest, Groups);

/// Angles from 0, across the series threshold (0.5 rad), to beyond π.
TYPED_TEST(ExpCurvatureTest, HessianMatchesDifferencesOfJr) {
  using G = TypeParam;
  for (const double angle : {0.0, 1e-9, 1e-3, 0.49999, 0.50001, 1.0, 2.0, 3.1, 3.14159265, 3.6}) {
    typename G::Tangent v = this->random(1.0);
    if (G::angle(v) > 0) v.template tail<3>() *= angle / G::angle(v);
    const typename G::Tangent lambda = this->random(2.0);
    typename G::Jacobian D;
    constexpr double h = 1e-5;
    for (int k = 0; k < G::dof; ++k) {
      const typename G::Tangent step = h * G::Tangent::Unit(k);
      D.col(k) = (G::Jr(v + step) - G::Jr(v - step)).transpose() * lambda / (2 * h);
    }
    const typename G::Jacobian expected = 0.5 * (D + D.transpose());
    EXPECT_LE((ExpCurvature<G>::hessian(v, lambda) - expected).cwiseAbs().maxCoeff(), 2e-9) << angle;
  }
}

TYPED_TEST(ExpCurvatureTest, BracketMatchesAd) {
  using G = TypeParam;
  const typename G::Tangent a = this->random(1.0), b = this->random(1.0), lambda = this->random(1.0);
  const double expected = lambda.dot(G::ad(a) * b);
  EXPECT_NEAR(a.dot(ExpCurvature<G>::bracket(lambda) * b), expected, 1e-13);
}

}  // namespace
}  // namespace tandem
