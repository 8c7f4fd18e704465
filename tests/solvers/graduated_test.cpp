#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/solvers/graduated.hpp>

#include "cases.hpp"

/// Tests that graduated non-convexity finds the minimum of the inliers where the plain solver does not.
namespace tandem::testing {
namespace {

using Graduated = std::function<Summary(Problem&, const Limits&)>;
struct Pair {
  std::string name;
  AnySolver plain;
  Graduated graduated;
};
std::ostream& operator<<(std::ostream& out, const Pair& pair) { return out << pair.name; }

template <class Options>
Pair pair(const std::string& name, const Options& options) {
  return {name, any_solver(name, false, options), [options](Problem& problem, const Limits& limits) {
            Options o = options;
            o.max_iterations = limits.max_iterations.value_or(o.max_iterations);
            o.time_limit = limits.time_limit.value_or(o.time_limit);
            o.stop = limits.stop;
            o.progress = limits.progress;
            return solve_graduated(problem, o);
          }};
}
std::vector<Pair> pairs() {
  std::vector<Pair> all{pair("gauss_newton", GaussNewtonOptions{})};
  if (ipopt_present()) all.push_back(pair("ipopt", IpoptOptions{}));
  for (const char* algorithm : {"lbfgs", "slsqp"}) {
    NloptOptions options;
    options.algorithm = algorithm;
    if (nlopt_present()) all.push_back(pair(std::string("nlopt_") + algorithm, options));
  }
  return all;
}

/// A state with many direct measurements, the first of which are outliers.
template <LieGroup G>
struct Averaging {
  Problem problem;
  Variable<G> x;
  std::vector<Block> outliers, inliers;

  double error(const G& truth) const { return (truth.inverse() * problem.value(x)).Log().norm(); }
};

constexpr double kSigma = 0.1;
const R3 kPoint({3.0, -2.0, 1.0});
const SO3 kRotation = SO3::Exp({0.4, -0.7, 1.2});

/// 60 % of the measurements are outliers. A third of these agree on a wrong point, which is the initial guess; the
/// others are spread over 20 m.
Averaging<R3> points(const Loss& loss) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> anywhere(-20.0, 20.0);
  std::normal_distribution<double> noise(0.0, kSigma);
  const auto draw = [&](auto& of) { return Vector<3>{of(random), of(random), of(random)}; };
  const R3 wrong({-9.0, 4.0, -2.0});
  Averaging<R3> a;
  a.x = a.problem.add(wrong, "x");
  const Gaussian sigma{kSigma, kSigma, kSigma};
  for (int i = 0; i < 100; ++i) {
    const R3 z(i >= 20 && i < 60 ? draw(anywhere) : Vector<3>((i < 20 ? wrong : kPoint).vector() + draw(noise)));
    (i < 60 ? a.outliers : a.inliers).push_back(a.problem.minimize(Prior<R3>{z}, sigma, {a.x}, loss));
  }
  return a;
}

/// 40 % of the measurements, and the initial guess, are turned by 180° about z.
Averaging<SO3> rotations(const Loss& loss) {
  std::mt19937_64 random(6);
  std::normal_distribution<double> noise(0.0, kSigma);
  const SO3 turned = SO3::Exp({0.0, 0.0, std::numbers::pi});
  Averaging<SO3> a;
  a.x = a.problem.add(kRotation * turned, "x");
  for (int i = 0; i < 50; ++i) {
    const SO3 z = (i < 20 ? kRotation * turned : kRotation) * SO3::Exp({noise(random), noise(random), noise(random)});
    (i < 20 ? a.outliers : a.inliers)
        .push_back(a.problem.minimize(Prior<SO3>{z}, Gaussian{kSigma, kSigma, kSigma}, {a.x}, loss));
  }
  return a;
}

std::vector<Loss> redescending() { return {Cauchy(2.0), GemanMcClure(4.0), Tukey(6.0)}; }

class GraduatedSolve : public ::testing::TestWithParam<Pair> {};
INSTANTIATE_TEST_SUITE_P(Solvers, GraduatedSolve, ::testing::ValuesIn(pairs()),
                         [](const auto& info) { return info.param.name; });

template <LieGroup G>
void expect_found(const Pair& solver, const Loss& loss, Averaging<G> (*make)(const Loss&), const G& truth) {
  Averaging<G> plain = make(loss), graduated = make(loss);
  const double initial_cost = cost_of(graduated.problem);
  const Summary wrong = solver.plain(plain.problem);
  const Summary right = solver.graduated(graduated.problem, {});
  EXPECT_TRUE(right.converged()) << right.message;
  EXPECT_GT(plain.error(truth), 1.0) << "the initial guess is in the wrong basin";
  EXPECT_LT(graduated.error(truth), 5.0 * kSigma / std::sqrt(double(graduated.inliers.size())));
  EXPECT_LT(right.cost, wrong.cost);
  EXPECT_EQ(right.cost, cost_of(graduated.problem)) << "cost with the original losses";
  EXPECT_EQ(right.initial_cost, initial_cost);
  EXPECT_EQ(graduated.problem.loss_scale(), 1.0);

  for (const Block& block : graduated.inliers) EXPECT_GT(graduated.problem.weight(block), 0.1);
  for (const Block& block : graduated.outliers) EXPECT_LT(graduated.problem.weight(block), 0.1);
}

TEST_P(GraduatedSolve, FindsAPointAmongGrossOutliers) {
  for (const Loss& loss : redescending()) expect_found(GetParam(), loss, points, kPoint);
}

TEST_P(GraduatedSolve, FindsARotationAmongOutliers) {
  for (const Loss& loss : redescending()) expect_found(GetParam(), loss, rotations, kRotation);
}

TEST_P(GraduatedSolve, EqualsThePlainSolveWithoutRobustLosses) {
  Averaging<R3> plain = points({}), graduated = points({});
  const Summary a = GetParam().plain(plain.problem), b = GetParam().graduated(graduated.problem, {});
  EXPECT_EQ(plain.problem.value(plain.x).vector(), graduated.problem.value(graduated.x).vector());
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_EQ(a.evaluations, b.evaluations);
  EXPECT_EQ(a.initial_cost, b.initial_cost);
}

TEST_P(GraduatedSolve, AppliesLimitsToAllSolvesTogether) {
  const Pair& solver = GetParam();
  Averaging<R3> a = points(GemanMcClure(4.0));
  const int whole = solver.graduated(a.problem, {}).iterations;
  for (const int most : {1, whole / 2}) {
    a = points(GemanMcClure(4.0));
    const Summary s = solver.graduated(a.problem, {.max_iterations = most});
    EXPECT_EQ(s.status, Status::max_iterations) << s.message;
    EXPECT_LE(s.iterations, most + 1) << "NLopt needs at least one evaluation";
    EXPECT_EQ(s.cost, cost_of(a.problem));
  }
  a = points(GemanMcClure(4.0));
  EXPECT_EQ(solver.graduated(a.problem, {.time_limit = 0.0}).status, Status::time_limit);

  a = points(GemanMcClure(4.0));
  std::atomic<bool> stop = false;
  std::vector<int> seen;
  const auto progress = [&](const Progress& p) {
    seen.push_back(p.iteration);
    stop = stop || p.iteration >= whole / 2;
  };
  const Summary s = solver.graduated(a.problem, {.stop = &stop, .progress = progress});
  EXPECT_EQ(s.status, Status::interrupted);
  EXPECT_LT(s.iterations, whole);
  EXPECT_EQ(s.cost, cost_of(a.problem));
  EXPECT_EQ(a.problem.loss_scale(), 1.0);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end())) << ::testing::PrintToString(seen);
}

TEST_P(GraduatedSolve, RestoresTheLossScaleAfterAnException) {
  Averaging<R3> a = points(GemanMcClure(4.0));
  a.problem.scale_losses(1.5);
  const auto progress = [&](const Progress&) {
    if (a.problem.loss_scale() < 20.0) throw std::runtime_error("enough");
  };
  EXPECT_THROW(GetParam().graduated(a.problem, {.progress = progress}), std::runtime_error);
  EXPECT_EQ(a.problem.loss_scale(), 1.5);
  GetParam().graduated(a.problem, {});
  EXPECT_EQ(a.problem.loss_scale(), 1.5) << "the original loss scale";
}

TEST_P(GraduatedSolve, ReportsTheReasonOfAFailure) {
  Problem undefined;
  const auto x = undefined.add(R1(Vector<1>(-1.0)), "x");
  undefined.minimize(Logarithm{2.0}, Gaussian{0.1}, {x}, Cauchy(1.0));
  const Summary s = GetParam().graduated(undefined, {});
  EXPECT_EQ(s.status, Status::failed);
  EXPECT_THAT(s.message, ::testing::HasSubstr("logarithm"));
  EXPECT_EQ(undefined.loss_scale(), 1.0);

  Averaging<R3> fixed = points(Cauchy(1.0));
  fixed.problem.fix(fixed.x);
  EXPECT_EQ(GetParam().graduated(fixed.problem, {}).status, Status::unsupported);
}

TEST(Graduated, DoesNotChangeTheOptimumOfHuber) {
  Averaging<R3> plain = points(Huber(1.0)), graduated = points(Huber(1.0));
  solve(plain.problem, GaussNewtonOptions{});
  const Summary s = solve_graduated(graduated.problem, GaussNewtonOptions{});
  EXPECT_TRUE(s.converged());
  EXPECT_LT((plain.problem.value(plain.x).vector() - graduated.problem.value(graduated.x).vector()).norm(), 1e-3);
}

TEST(Graduated, RejectsInvalidOptions) {
  Averaging<R3> a = points(Cauchy(1.0));
  EXPECT_THROW(solve_graduated(a.problem, GaussNewtonOptions{}, {.divide = 1.0}), Error);
  EXPECT_THROW(solve_graduated(a.problem, GaussNewtonOptions{}, {.tolerance = -1.0}), Error);
}

}  // namespace
}  // namespace tandem::testing
