#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/residuals/loss.hpp>
#include <tandem/residuals/testing.hpp>

namespace tandem {
namespace {

struct Named {
  std::string name;
  Loss loss;
};
std::vector<Named> losses() {
  std::vector<Named> all{{"none", Loss{}}};
  for (const double c : {0.1, 1.0, 4.7})
    for (const auto& [name, make] :
         {std::pair{"Huber", &Huber}, {"Cauchy", &Cauchy}, {"Geman-McClure", &GemanMcClure}, {"Tukey", &Tukey}})
      all.push_back({std::string(name) + " " + std::to_string(c), make(c)});
  all.push_back({"Student-t 4", StudentT(4, 3)});
  return all;
}

TEST(Loss, EqualsLeastSquaresNearZero) {
  for (const auto& [name, loss] : losses()) {
    EXPECT_EQ(loss(0.0).rho, 0.0) << name;
    EXPECT_EQ(loss(0.0).d1, 1.0) << name;
    const double s = 1e-9 * loss.scale * loss.scale;
    EXPECT_NEAR(loss(s).rho / s, 1.0, 2e-9) << name;
  }
}

TEST(Loss, HasCorrectDerivatives) {
  for (const auto& [name, one] : losses())
    for (const double at :
         {1e-3, 0.3, 0.9, 1.15, 2.0, 50.0}) {  // times scale²; the threshold of Huber and Tukey is at 1
      const Loss& loss = one;
      const double c2 = loss.scale * loss.scale, s = at * c2;
      const double unit = 0.8 * std::min(at, 1.0) * c2;
      const auto rho = [&](double h, double* f) { *f = loss(s + h * unit).rho; };
      const auto d1 = [&](double h, double* f) { *f = loss(s + h * unit).d1; };
      EXPECT_NEAR(loss(s).d1, detail::differentiate(1, rho, c2).first[0] / unit, 1e-10 / std::min(at, 1.0))
          << name << " at " << at;
      EXPECT_NEAR(loss(s).d2 * c2, detail::differentiate(1, d1, 1.0).first[0] / unit * c2, 1e-10 / std::min(at, 1.0))
          << name << " at " << at;
    }
}

TEST(Loss, IsContinuouslyDifferentiableAtTheThreshold) {
  for (const auto& [name, loss] : losses()) {
    const double c2 = loss.scale * loss.scale;
    const auto below = loss(c2 * (1.0 - 1e-12)), above = loss(c2 * (1.0 + 1e-12));
    EXPECT_NEAR(below.rho, above.rho, 3e-12 * c2) << name;
    EXPECT_NEAR(below.d1, above.d1, 3e-12) << name;
  }
}

TEST(Loss, GrowsMonotonicallyBelowLeastSquares) {
  for (const auto& [name, loss] : losses()) {
    double last = 0.0, last_d1 = 1.0;
    for (double s = 1e-6; s < 1e6; s *= 1.3) {
      const auto [rho, d1, d2] = loss(s);
      EXPECT_GE(rho, last) << name << " at " << s;
      EXPECT_LE(rho, s * (1.0 + 1e-15)) << name << " at " << s;
      EXPECT_GE(d1, 0.0) << name << " at " << s;
      EXPECT_LE(d1, last_d1) << name << " at " << s;
      EXPECT_LE(d2, 0.0) << name << " at " << s;
      last = rho, last_d1 = d1;
    }
  }
}

TEST(Loss, BoundedLossesReachTheirBounds) {
  for (const double c : {0.1, 1.0, 4.7}) {
    const double c2 = c * c;
    for (const double s : {c2, 4.0 * c2, 1e6 * c2}) {
      EXPECT_LE(GemanMcClure(c)(s).rho, c2);
      EXPECT_NEAR(Tukey(c)(s).rho, c2 / 3.0, 1e-16 * c2);
      EXPECT_EQ(Tukey(c)(s).d1, 0.0);
      EXPECT_EQ(Tukey(c)(s).d2, 0.0);
    }
    EXPECT_NEAR(GemanMcClure(c)(1e12 * c2).rho, c2, 2e-12 * c2);
  }
}

TEST(Loss, MatchesKnownValues) {
  EXPECT_EQ(Huber(2.0)(3.0).rho, 3.0);
  EXPECT_DOUBLE_EQ(Huber(2.0)(9.0).rho, 2 * 2.0 * 3.0 - 4.0);    // 2 c √s − c²
  EXPECT_DOUBLE_EQ(Cauchy(2.0)(12.0).rho, 4.0 * std::log(4.0));  // c² ln(1 + s/c²)
  EXPECT_DOUBLE_EQ(GemanMcClure(2.0)(4.0).rho, 2.0);             // c² s / (c² + s)
  EXPECT_DOUBLE_EQ(Tukey(2.0)(2.0).rho, 4.0 / 3.0 * (1.0 - 0.125));
  // (ν + d) ln(1 + s'/ν), where s' uses the scale of the t distribution.
  EXPECT_DOUBLE_EQ(StudentT(5, 2)(3.0).rho, 7 * std::log(1 + 3.0 * (5.0 / 7.0) / 5.0));
  EXPECT_EQ(Loss{}(1e8).rho, 1e8);
}

TEST(Loss, PropagatesNan) {
  for (const auto& [name, loss] : losses()) EXPECT_TRUE(std::isnan(loss(std::nan("")).rho)) << name;
}

TEST(Loss, IsFiniteForLargeResiduals) {
  for (const auto& [name, loss] : losses())
    for (const double s : {1e30, 1e100}) {
      const auto [rho, d1, d2] = loss(s);
      EXPECT_TRUE(std::isfinite(rho) && std::isfinite(d1) && std::isfinite(d2)) << name << " at " << s;
    }
}

TEST(Loss, RejectsInvalidScale) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  for (const auto make : {&Huber, &Cauchy, &GemanMcClure, &Tukey})
    for (const double bad : {0.0, -1.0, infinity, std::nan("")}) {
      try {
        make(bad);
        ADD_FAILURE() << bad << " was accepted";
      } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("not positive and finite"), std::string::npos) << error.what();
      }
    }
}

}  // namespace
}  // namespace tandem
