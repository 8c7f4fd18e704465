#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <tandem/residuals/bounds.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/evidence_deviation.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem::testing {
namespace {

using Number = Rn<1>;

Number number(double x) { return Number(Vector<1>(x)); }

/// A state seen as so many times as large.
struct Magnified {
  static constexpr std::string_view name = "magnified";
  static constexpr int dim = 1;
  using States = std::tuple<Number, Number>;
  double z;
  void operator()(const Number& by, const Number& state, Vector<1>& r, Matrix<1, 1>* Jb = nullptr,
                  Matrix<1, 1>* Js = nullptr) const {
    r[0] = by.vector()[0] * state.vector()[0] - z;
    if (Jb) *Jb << state.vector()[0];
    if (Js) *Js << by.vector()[0];
  }
};

/// States of a standard deviation of 1, seen magnified: of each z = by · state + noise.
struct Magnification {
  static constexpr double kNoise = 0.3;
  Problem problem;
  Variable<Number> by = problem.add(number(2));
  std::vector<double> z;

  Magnification() {
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 200; ++i) {
      z.push_back(2 * normal(random) + kNoise * normal(random));
      const auto state = problem.add(number(0.5 * z.back()));
      problem.minimize(Prior<Number>{Number()}, {1.0}, {state});
      problem.minimize(Magnified{z.back()}, {kNoise}, {by, state});
    }
    problem.minimize(Prior<Number>{number(2)}, {0.5}, {by});
    EXPECT_TRUE(solve(problem, GaussNewtonOptions{}).converged());
  }
  double value() const { return problem.value(by).vector()[0]; }
  /// With the states integrated out exactly: of each z a variance of by² + noise².
  double exact(double x) const {
    double sum = -0.5 * std::pow((x - 2) / 0.5, 2);
    for (const double zi : z) {
      const double variance = x * x + kNoise * kNoise;
      sum -= 0.5 * (zi * zi / variance + std::log(variance));
    }
    return sum;
  }
};

TEST(EvidenceDeviation, IsByTheDensityWithAllElseIntegratedOut) {
  const Magnification m;
  const double x = m.value();
  const auto found = evidence_deviation(m.problem, m.by, 0.05, 5);
  ASSERT_TRUE(found);
  const double h = *found;  // over which the parabola is
  const double second = (m.exact(x + h) - 2 * m.exact(x) + m.exact(x - h)) / (h * h);
  ASSERT_LT(second, 0);
  EXPECT_NEAR(h, 1 / std::sqrt(-second), 0.1 * h);
  EXPECT_EQ(m.value(), x) << "the problem is as it was";
}

TEST(EvidenceDeviation, TheEvidenceAlongIsThatDensity) {
  const Magnification m;
  const double x = m.value();
  const std::vector<double> values = {x - 0.2, x, x + 0.3};
  const std::vector<double> along = evidence_along(m.problem, m.by, values);
  ASSERT_EQ(along.size(), 3u);
  for (std::size_t i = 0; i < values.size(); ++i)
    EXPECT_NEAR(along[i], m.exact(values[i]) - m.exact(x), 1e-6 * (1 + std::abs(along[i]))) << values[i];
  EXPECT_EQ(m.value(), x);
}

TEST(EvidenceDeviation, IsTheMarginalOneOfALinearProblem) {
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
  EXPECT_NEAR(evidence_deviation(problem, x, marginal, 10).value(), marginal, 1e-8);
  problem.subject_to(Prior<Number>{number(1)}, equal_to(0), {before});
  EXPECT_FALSE(evidence_deviation(problem, x, marginal, 10)) << "not under hard constraints";
}

/// A state, or, farther from x = 0 to either side, more of another in its place: a mean, which has less noise.
struct Blended {
  static constexpr std::string_view name = "blended";
  static constexpr int dim = 1;
  using States = std::tuple<Number, Number, Number>;
  double z;
  void operator()(const Number& x, const Number& a, const Number& b, Vector<1>& r, Matrix<1, 1>* Jx = nullptr,
                  Matrix<1, 1>* Ja = nullptr, Matrix<1, 1>* Jb = nullptr) const {
    const double w = std::pow(x.vector()[0], 2);
    r[0] = (1 - w) * a.vector()[0] + w * b.vector()[0] - z;
    if (Jx) *Jx << 2 * x.vector()[0] * (b.vector()[0] - a.vector()[0]);
    if (Ja) *Ja << 1 - w;
    if (Jb) *Jb << w;
  }
};

/// The cost has its least where there is most noise to explain what is seen, which is little.
TEST(EvidenceDeviation, IsInfiniteWhereTheEvidenceRisesAllTheWay) {
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
  EXPECT_EQ(evidence_deviation(problem, x, 0.1, 0.5).value(), HUGE_VAL);
}

}  // namespace
}  // namespace tandem::testing
