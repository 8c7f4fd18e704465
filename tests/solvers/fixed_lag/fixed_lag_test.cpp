#include <cmath>
#include <map>
#include <random>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

#include "biased_step.hpp"
#include "seconds_of.hpp"

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Optional;
using ::testing::ThrowsMessage;

/// Simulates a data stream for a window and for a batch of all data. Points move at nearly constant velocity, with
/// odometry, an odometry bias that is a variable without a time, and position measurements, some of them late.
class Stream {
 public:
  static constexpr int kLate = 4;  // number of steps by which late measurements are delayed

  /// Adds the data of step k at time t. `add` adds a point, `problem` gets the blocks.
  template <class Add>
  void arrive(Problem& problem, int k, double t, Add add, std::map<int, Variable<R3>>& x, Variable<R3>& bias) {
    std::mt19937_64 random(std::uint64_t(k) + 5);
    std::normal_distribution<double> normal;
    const auto some = [&] { return Vector<3>{normal(random), normal(random), normal(random)}; };
    if (k == 0) {
      bias = problem.add(R3(), "bias");
      problem.minimize(Prior<R3>{R3()}, noise(3, 2.0), {bias});
    }
    x[k] = add(t, R3(some()));
    if (k == 0) problem.minimize(Prior<R3>{R3()}, noise(3, 1.0), {x[k]});
    if (k > 0) problem.minimize(BiasedStep{some()}, noise(3, 0.3), {x[k - 1], x[k], bias});
    if (k > 1) problem.minimize(ConstantTwist<R3>{1.0, 1.0}, noise(3, 0.7), {x[k - 2], x[k - 1], x[k]});
    if (k % 7 == 3) problem.minimize(Prior<R3>{R3(some())}, noise(3, 0.5), {x[k]});
    if (k % 11 == 5) problem.minimize(Prior<R3>{R3(some())}, noise(3, 0.4), {x[k - kLate]});
  }
};

struct Batch {
  Problem problem;
  std::map<int, Variable<R3>> x;
  Variable<R3> bias;
  void arrive(int k, double t) {
    Stream().arrive(
        problem, k, t, [&](double, const R3& initial) { return problem.add(initial); }, x, bias);
  }
  void solve_fully() {
    GaussNewtonOptions options;
    options.initial_damping = 0;  // the problem is linear: one undamped step is exact
    ASSERT_TRUE(solve(problem, options).converged());
  }
};

struct Window {
  explicit Window(FixedLagOptions options) : lag(std::move(options)) {}
  FixedLag lag;
  std::map<int, Variable<R3>> x;
  Variable<R3> bias;
  void arrive(int k, double t) {
    Stream().arrive(
        lag.problem(), k, t, [&](double at, const R3& initial) { return lag.add(at, initial); }, x, bias);
  }
};

/// Compares the states, the cost and the joint covariances with the batch at each update.
void expect_batch(Window& window, const std::function<double(int)>& time, int steps) {
  Batch batch;
  for (int k = 0; k < steps; ++k) {
    SCOPED_TRACE(k);
    window.arrive(k, time(k));
    batch.arrive(k, time(k));
    const Summary summary = window.lag.update();
    ASSERT_TRUE(summary.converged()) << summary.message;
    batch.solve_fully();
    for (const auto& [i, x] : window.x) {
      if (!window.lag.problem().has(x)) continue;
      EXPECT_LE((window.lag.problem().value(x).vector() - batch.problem.value(batch.x[i]).vector()).norm(), 1e-9) << i;
    }
    EXPECT_LE((window.lag.problem().value(window.bias).vector() - batch.problem.value(batch.bias).vector()).norm(),
              1e-9);
    EXPECT_NEAR(summary.cost, NlpEvaluator(batch.problem).cost(), 1e-9 * (1 + summary.cost));
    const Marginals marginals(batch.problem);
    const Matrix<6, 6> S = window.lag.covariance(window.x[k], window.bias);
    EXPECT_LE((S - marginals.joint(batch.x[k], batch.bias)).norm(), 1e-9);
    if (k > 0 && window.lag.problem().has(window.x[k - 1])) {
      const Matrix<6, 6> two = window.lag.covariance(window.x[k], window.x[k - 1]);
      EXPECT_LE((two - marginals.joint(batch.x[k], batch.x[k - 1])).norm(), 1e-9);
    }
  }
}

TEST(FixedLag, LinearProblemsMatchTheBatch) {
  Window window(seconds_of(6.0));
  expect_batch(
      window, [](int k) { return double(k); }, 60);
  EXPECT_EQ(window.lag.problem().num_variables(), 7 + 1);
  EXPECT_EQ(window.lag.oldest(), 53.0);
}

TEST(FixedLag, LimitsTheNumberOfKeyframes) {
  FixedLagOptions options = seconds_of(HUGE_VAL);
  options.max_keyframes = 6;
  Window window(options);
  expect_batch(
      window, [](int k) { return 0.3 * k + 0.1 * std::sin(k); }, 40);
  EXPECT_EQ(window.lag.problem().num_variables(), 6 + 1);
}

TEST(FixedLag, MarginalizesTheWholeWindowAfterALongGap) {
  Window window(seconds_of(8.0));
  expect_batch(
      window, [](int k) { return k < 11 ? 1.0 * k : 100.0; }, 12);
  EXPECT_EQ(window.lag.problem().num_variables(), 1 + 1);
  EXPECT_EQ(window.lag.marginalized().size(), 9u);
}

TEST(FixedLag, PosesWithLittleNoiseMatchTheBatch) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal(0.0, 1e-4);
  FixedLag lag(seconds_of(5.0));
  Problem batch;
  std::vector<Variable<SE3>> x, y;
  const SE3 step = SE3::Exp(Vector<6>(1.0, 0.1, 0, 0, 0.02, 0.05));
  const auto noisy = [&] {
    Vector<6> v;
    for (auto& e : v) e = normal(random);
    return SE3::Exp(v);
  };
  SE3 truth;
  for (int k = 0; k < 40; ++k) {
    x.push_back(lag.add(k, k == 0 ? SE3() : lag.problem().value(x.back()) * step));
    y.push_back(batch.add(k == 0 ? SE3() : batch.value(y.back()) * step));
    const SE3 odometry = step * noisy(), seen = truth * noisy();
    const auto blocks = [&](Problem& p, const std::vector<Variable<SE3>>& v) {
      if (k == 0) p.minimize(Prior<SE3>{SE3()}, noise(6, 1e-4), {v[0]});
      if (k > 0) p.minimize(RelativePose<SE3>{odometry}, noise(6, 1e-4), {v[v.size() - 2], v.back()});
      if (k > 1) p.minimize(ConstantTwist<SE3>{1.0, 1.0}, noise(6, 1e-3), {v[v.size() - 3], v[v.size() - 2], v.back()});
      if (k % 5 == 4) p.minimize(Prior<SE3>{seen}, noise(6, 1e-4), {v.back()}, Huber(3.0));
    };
    blocks(lag.problem(), x);
    blocks(batch, y);
    ASSERT_TRUE(lag.update().converged());
    ASSERT_TRUE(solve(batch, GaussNewtonOptions{}).converged());
    // The poses deviate from a linear problem by about 1e-4, which causes errors of 1e-8. Solves stop at a relative
    // cost of 1e-6.
    EXPECT_LE(minus(lag.problem().value(x.back()), batch.value(y.back())).norm(), 5e-7) << k;
    const Matrix<6, 6> S = lag.covariance(x.back()), full = Marginals(batch).covariance(y.back());
    EXPECT_LE((S - full).norm(), 1e-3 * full.norm()) << k;
    truth = truth * step;
  }
}

TEST(FixedLag, MemoryIsBounded) {
  FixedLag lag(seconds_of(3.5));
  auto& problem = lag.problem();
  const auto bias = problem.add(R3(), "bias");
  problem.minimize(Prior<R3>{R3()}, noise(3, 1.0), {bias});
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  covariance(0, 1) = covariance(1, 0) = 0.5;
  const Gaussian full = Gaussian::covariance(covariance);
  Variable<R3> last;
  int bound = 0, largest_block = 0;
  for (int k = 0; k < 10100; ++k) {
    const auto x = lag.add(k, R3());
    Block block;
    if (k == 0) {
      block = problem.minimize(Prior<R3>{R3()}, full, {x});
    } else {
      block = problem.minimize(BiasedStep{{1, 0, 0}}, full, {last, x, bias});
    }
    if (k % 3 == 0) problem.minimize(Prior<R3>{R3({double(k), 0, 0})}, full, {x});
    ASSERT_TRUE(lag.update().converged());
    last = x;
    ASSERT_LE(problem.num_variables(), 5);
    ASSERT_LE(problem.num_soft_blocks(), 1 + 4 + 2);
    if (k == 100) {
      bound = problem.id_bound();
    }
    if (k > 100) largest_block = std::max(largest_block, block.id);
  }
  EXPECT_EQ(problem.id_bound(), bound);
  EXPECT_LE(largest_block, 5);
  EXPECT_LE((problem.value(last).vector() - Vector<3>(10099, 0, 0)).norm(), 1e-3);
}

TEST(FixedLag, ReportsLeavingVariablesAndTheBeginOfTheWindow) {
  std::vector<double> left;
  FixedLagOptions options = seconds_of(2.1);
  FixedLag* self = nullptr;
  std::map<double, std::pair<Variable<R3>, Variable<R3>>> x;
  options.before_marginalize = [&](double t) {
    left.push_back(t);
    EXPECT_TRUE(self->problem().has(x.at(t).first) && self->problem().has(x.at(t).second));
  };
  FixedLag lag(options);
  self = &lag;
  EXPECT_EQ(lag.oldest(), -HUGE_VAL);
  EXPECT_FALSE(lag.why_too_late(-1e9));
  for (const double t : {0.0, 1.0, 2.0, 3.5}) {
    x[t] = {lag.add(t, R3(), "a"), lag.add(t + 5e-4, R3(), "b")};  // one keyframe
    lag.problem().minimize(Prior<R3>{R3({t, 0, 0})}, noise(3, 1.0), {x[t].first});
    lag.problem().minimize(RelativePose<R3>{R3()}, noise(3, 1.0), {x[t].first, x[t].second});
    if (t < 3) {
      EXPECT_FALSE(lag.why_too_late(-5.0)) << "no variable has left yet";
    }
    EXPECT_TRUE(lag.update().converged());
    EXPECT_EQ(lag.marginalized().size(), t < 3 ? 0u : 4u);
  }
  EXPECT_EQ(left, (std::vector<double>{0.0, 1.0}));
  EXPECT_EQ(lag.marginalized()[2].t, 1.0);
  EXPECT_FALSE(lag.problem().has(x[1.0].second));
  EXPECT_TRUE(lag.problem().has(x[2.0].first));
  EXPECT_EQ(lag.oldest(), 2.0);
  EXPECT_EQ(lag.newest(), 3.5005);
  EXPECT_FALSE(lag.why_too_late(2.0));
  EXPECT_THAT(lag.why_too_late(1.9), Optional(HasSubstr("t = 1.9 s is before the window, which begins at 2 s")));
  EXPECT_THAT(lag.why_too_late(std::nan("")), Optional(HasSubstr("not finite")));
  EXPECT_THAT([&] { lag.add(1.9, R3()); }, ThrowsMessage<Error>(HasSubstr("before the window")));
  const auto late = lag.add(2.5, R3());  // between the others
  lag.problem().minimize(RelativePose<R3>{R3()}, noise(3, 1.0), {x[2.0].first, late});
  EXPECT_TRUE(lag.update().converged());
  EXPECT_EQ(lag.marginalized().size(), 0u);
  EXPECT_NEAR(lag.problem().value(late).vector()[0], 2.0, 1e-12);
}

TEST(FixedLag, RecoversFromAFailedSolve) {
  FixedLag lag(seconds_of(1.0));
  const auto x = lag.add(0.0, R3(), "x"), y = lag.add(5.0, R3());
  const Block bad = lag.problem().minimize(Prior<R3>{R3({NAN, 0, 0})}, noise(3, 1.0), {x});
  const Summary summary = lag.update();
  EXPECT_EQ(summary.status, Status::failed);
  EXPECT_THAT(summary.message, HasSubstr("prior of x"));
  EXPECT_TRUE(lag.problem().has(x));
  EXPECT_THROW(lag.covariance(x), Error);
  lag.problem().remove(bad);
  lag.problem().minimize(RelativePose<R3>{R3({1, 0, 0})}, noise(3, 1.0), {x, y});
  lag.problem().minimize(Prior<R3>{R3({1, 0, 0})}, noise(3, 1.0), {x});
  EXPECT_TRUE(lag.update().converged());
  EXPECT_NEAR(lag.problem().value(y).vector()[0], 2.0, 1e-9);
}

TEST(FixedLag, ConvergesOverSeveralUpdates) {
  FixedLag lag(seconds_of(100.0));
  std::vector<Variable<SE3>> x;
  const SE3 step = SE3::Exp(Vector<6>(1.0, 0, 0, 0, 0, 0.4));
  SE3 truth;
  for (int k = 0; k < 12; ++k, truth = truth * step) {
    x.push_back(lag.add(k, SE3()));  // poor initial guess
    if (k == 0) lag.problem().minimize(Prior<SE3>{SE3()}, noise(6, 0.01), {x[0]});
    if (k > 0) lag.problem().minimize(RelativePose<SE3>{step}, noise(6, 0.01), {x[std::size_t(k) - 1], x.back()});
  }
  int updates = 0;
  while (!lag.update().converged() && updates < 10) ++updates;
  EXPECT_LE(updates, 8);
  lag.update();
  EXPECT_LE(minus(lag.problem().value(x.back()), truth * step.inverse()).norm(), 1e-4);
}

TEST(FixedLag, IsDeterministic) {
  const auto run = [] {
    Window window(seconds_of(5.0));
    for (int k = 0; k < 30; ++k) {
      window.arrive(k, k);
      window.lag.update();
    }
    return window.lag.problem().value(window.x[29]).vector();
  };
  EXPECT_EQ(run(), run());
}

TEST(FixedLag, RejectsInvalidOptions) {
  for (const auto spoil :
       {+[](FixedLagOptions& o) { o.window = 0; }, +[](FixedLagOptions& o) { o.window = NAN; },
        +[](FixedLagOptions& o) { o.max_keyframes = -1; }, +[](FixedLagOptions& o) { o.max_iterations = 0; },
        +[](FixedLagOptions& o) { o.patience = -1; }, +[](FixedLagOptions& o) { o.cost_tolerance = -1; },
        +[](FixedLagOptions& o) { o.initial_damping = NAN; }}) {
    FixedLagOptions options;
    spoil(options);
    EXPECT_THROW(FixedLag{options}, Error);
  }
  FixedLag lag;
  EXPECT_THROW(lag.add(NAN, R3()), Error);
}

}  // namespace
}  // namespace tandem::testing
