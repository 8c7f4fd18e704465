#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <tandem/residuals/bounds.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/profile_evidence.hpp>

namespace tandem::testing {
namespace {

using Number = Rn<1>;

Number number(double x) { return Number(Vector<1>(x)); }

/// Measures factor · state − z.
struct Magnified {
  static constexpr std::string_view name = "magnified";
  static constexpr int dim = 1;
  using States = std::tuple<Number, Number>;
  double z;
  void operator()(const Number& factor, const Number& state, Vector<1>& r, Matrix<1, 1>* Jf = nullptr,
                  Matrix<1, 1>* Js = nullptr) const {
    r[0] = factor.vector()[0] * state.vector()[0] - z;
    if (Jf) *Jf << state.vector()[0];
    if (Js) *Js << factor.vector()[0];
  }
};

/// States with standard deviation 1, and one measurement z = factor · state + noise of each.
struct Magnification {
  static constexpr double kNoise = 0.3;
  Problem problem;
  Variable<Number> factor = problem.add(number(2));
  std::vector<double> z;

  Magnification() {
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 200; ++i) {
      z.push_back(2 * normal(random) + kNoise * normal(random));
      const auto state = problem.add(number(0.5 * z.back()));
      problem.minimize(Prior<Number>{Number()}, {1.0}, {state});
      problem.minimize(Magnified{z.back()}, {kNoise}, {factor, state});
    }
    problem.minimize(Prior<Number>{number(2)}, {0.5}, {factor});
    EXPECT_TRUE(solve(problem, GaussNewtonOptions{}).converged());
  }
  double value() const { return problem.value(factor).vector()[0]; }
  /// Log density with the states integrated out exactly: each z has the variance factor² + noise².
  double exact(double x) const {
    double sum = -0.5 * std::pow((x - 2) / 0.5, 2);
    for (const double zi : z) {
      const double variance = x * x + kNoise * kNoise;
      sum -= 0.5 * (zi * zi / variance + std::log(variance));
    }
    return sum;
  }
};

TEST(ProfileEvidence, MatchesTheExactMarginalDensity) {
  const Magnification m;
  const double x = m.value();
  const auto found = profile_evidence_sigma(m.problem, m.factor, 0.05, 5);
  ASSERT_TRUE(found);
  const double h = *found;  // step of the central differences
  const double second = (m.exact(x + h) - 2 * m.exact(x) + m.exact(x - h)) / (h * h);
  ASSERT_LT(second, 0);
  EXPECT_NEAR(h, 1 / std::sqrt(-second), 0.1 * h);
  EXPECT_EQ(m.value(), x) << "the problem is unchanged";
}

TEST(ProfileEvidence, EvidenceAlongMatchesTheExactMarginalDensity) {
  const Magnification m;
  const double x = m.value();
  const std::vector<double> values = {x - 0.2, x, x + 0.3};
  const std::vector<double> along = profile_evidence(m.problem, m.factor, values);
  ASSERT_EQ(along.size(), 3u);
  for (std::size_t i = 0; i < values.size(); ++i)
    EXPECT_NEAR(along[i], m.exact(values[i]) - m.exact(x), 1e-6 * (1 + std::abs(along[i]))) << values[i];
  EXPECT_EQ(m.value(), x);
}

TEST(ProfileEvidence, EqualsMarginalsForALinearProblem) {
  Problem problem;
  const auto x = problem.add(Number());
  auto before = x;
  for (int i = 0; i < 5; ++i) {
    const auto next = problem.add(Number());
    problem.minimize(RelativePose<Number>{number(0.3)}, {0.2 + i}, {before, next});
    before = next;
  }
  problem.minimize(Prior<Number>{number(1)}, {0.5}, {before});
  problem.minimize(Prior<Number>{Number()}, {3.0}, {x});
  ASSERT_TRUE(solve(problem, GaussNewtonOptions{}).converged());
  const double marginal = std::sqrt(Marginals(problem).covariance(x)(0, 0));
  EXPECT_NEAR(profile_evidence_sigma(problem, x, marginal, 10).value(), marginal, 1e-8);
  problem.subject_to(Prior<Number>{number(1)}, equal_to(0), {before});
  EXPECT_FALSE(profile_evidence_sigma(problem, x, marginal, 10)) << "hard constraints are not supported";
}

/// Measures a state `a`, or for x ≠ 0 the mean (1 − x²) a + x² b, which has a smaller variance.
struct Blended {
  static constexpr std::string_view name = "blended";
  static constexpr int dim = 1;
  using States = std::tuple<Number, Number, Number>;
  double z;
  void operator()(const Number& x, const Number& a, const Number& b, Vector<1>& r, Matrix<1, 1>* Jx = nullptr,
                  Matrix<1, 1>* Ja = nullptr, Matrix<1, 1>* Jf = nullptr) const {
    const double w = std::pow(x.vector()[0], 2);
    r[0] = (1 - w) * a.vector()[0] + w * b.vector()[0] - z;
    if (Jx) *Jx << 2 * x.vector()[0] * (b.vector()[0] - a.vector()[0]);
    if (Ja) *Ja << 1 - w;
    if (Jf) *Jf << w;
  }
};

/// The cost has its minimum where the predicted variance is largest, but the measurements are small. The evidence thus
/// increases in both directions.
TEST(ProfileEvidence, IsInfiniteIfTheEvidenceDoesNotDecrease) {
  Problem problem;
  const auto x = problem.add(Number());
  for (int i = 0; i < 50; ++i) {
    const auto a = problem.add(Number()), b = problem.add(Number());
    problem.minimize(Prior<Number>{Number()}, {1.0}, {a});
    problem.minimize(Prior<Number>{Number()}, {1.0}, {b});
    problem.minimize(Blended{0.3}, {0.1}, {x, a, b});
  }
  problem.minimize(Prior<Number>{Number()}, {1.0}, {x});
  const double least = solve(problem, GaussNewtonOptions{}).cost;
  problem.set_value(x, number(0.2));
  problem.fix(x);
  EXPECT_GT(solve(problem, GaussNewtonOptions{}).cost, least + 0.1);
  problem.fix(x, false);
  ASSERT_TRUE(solve(problem, GaussNewtonOptions{}).converged());
  EXPECT_EQ(profile_evidence_sigma(problem, x, 0.1, 0.5).value(), HUGE_VAL);
}

}  // namespace
}  // namespace tandem::testing
