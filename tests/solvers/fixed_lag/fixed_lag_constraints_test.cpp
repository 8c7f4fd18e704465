#include <cmath>
#include <fstream>
#include <map>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag.hpp>
#include <tandem/solvers/marginals.hpp>

#include "biased_step.hpp"
#include "dense_program.hpp"
#include "sanitized.hpp"
#include "seconds_of.hpp"

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;

/// Step along one axis, r = (y − x)ᵢ.
struct AxisStep {
  static constexpr std::string_view name = "axis step";
  static constexpr int dim = 1;
  using States = std::tuple<R3, R3>;
  int axis;
  void operator()(const R3& x, const R3& y, Vector<1>& r, Matrix<1, 3>* Jx = nullptr,
                  Matrix<1, 3>* Jy = nullptr) const {
    r[0] = y.vector()[axis] - x.vector()[axis];
    if (Jx) *Jx = -Vector<3>::Unit(axis).transpose();
    if (Jy) *Jy = Vector<3>::Unit(axis).transpose();
  }
};

/// Coordinate of a point along one axis.
struct Coordinate {
  static constexpr std::string_view name = "coordinate";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  int axis;
  void operator()(const R3& x, Vector<1>& r, Matrix<1, 3>* J = nullptr) const {
    r[0] = x.vector()[axis];
    if (J) *J = Vector<3>::Unit(axis).transpose();
  }
};

enum class Hard { equalities, inequalities };

/// Points at nearly constant velocity with noisy positions, and hard rows:
/// - equalities: the step along x is 0.4, y is 0 at every ninth point, and all coordinates are given at the first one;
/// - inequalities: the step along x is within ±`limit`, and z is at least −1.
struct ConstrainedStream {
  Hard hard;
  double limit = 0.4;
  unsigned seed = 5;

  template <class Add>
  void arrive(Problem& problem, int k, Add add, std::map<int, Variable<R3>>& x) const {
    std::mt19937_64 random(std::uint64_t(k) + 1000 * seed);
    std::normal_distribution<double> normal;
    const auto some = [&] { return Vector<3>{normal(random), normal(random), normal(random)}; };
    x[k] = add(double(k), R3(some()));
    const Vector<3> course(4 * std::sin(0.25 * k), std::cos(0.1 * k), std::sin(0.15 * k));
    if (k % 2 == 0) problem.minimize(Prior<R3>{R3(course + 0.3 * some())}, noise(3, 0.5), {x[k]});
    if (k == 0) problem.minimize(Prior<R3>{R3()}, noise(3, 3.0), {x[k]});
    if (k > 0) problem.minimize(RelativePose<R3>{R3(some())}, noise(3, 1.5), {x[k - 1], x[k]});
    if (k > 1) problem.minimize(ConstantTwist<R3>{1.0, 1.0}, noise(3, 0.7), {x[k - 2], x[k - 1], x[k]});
    if (hard == Hard::equalities) {
      if (k == 0) problem.subject_to(Prior<R3>{R3(Vector<3>(0.1, 0, -0.2))}, equal_to(0), {x[k]});
      if (k > 0) problem.subject_to(AxisStep{0}, equal_to(0.4), {x[k - 1], x[k]});
      if (k % 9 == 4) problem.subject_to(Coordinate{1}, equal_to(0), {x[k]});
      if (k % 9 == 7) problem.subject_to(AxisStep{2}, equal_to(0.1), {x[k - 2], x[k]});
    } else {
      if (k > 0) problem.subject_to(AxisStep{0}, between(-limit, limit), {x[k - 1], x[k]});
      problem.subject_to(Coordinate{2}, at_least(-1), {x[k]});
    }
  }
};

struct ConstrainedWindow {
  explicit ConstrainedWindow(double seconds, ConstrainedStream stream) : lag(seconds_of(seconds)), stream(stream) {}
  FixedLag lag;
  ConstrainedStream stream;
  std::map<int, Variable<R3>> x;
  void arrive(int k) {
    stream.arrive(
        lag.problem(), k, [&](double t, const R3& initial) { return lag.add(t, initial); }, x);
  }
};

struct ConstrainedBatch {
  ConstrainedStream stream;
  Problem problem{};
  std::map<int, Variable<R3>> x{};
  void arrive(int k) {
    stream.arrive(
        problem, k, [&](double, const R3& initial) { return problem.add(initial); }, x);
  }
};

Vector<3> difference(const ConstrainedWindow& window, const ConstrainedBatch& batch, int k) {
  return window.lag.problem().value(window.x.at(k)).vector() - batch.problem.value(batch.x.at(k)).vector();
}

TEST(FixedLagConstraints, EqualitiesMatchTheBatch) {
  for (const double seconds : {1.0, 5.0}) {
    ConstrainedWindow window(seconds, {Hard::equalities});
    ConstrainedBatch batch{{Hard::equalities}};
    for (int k = 0; k < 50; ++k) {
      SCOPED_TRACE(k);
      window.arrive(k);
      batch.arrive(k);
      const Summary summary = window.lag.update();
      ASSERT_TRUE(summary.converged()) << summary.message;
      EXPECT_LE(summary.max_violation, 1e-10);
      const DenseProgram solution(batch.problem);
      for (const auto& [i, x] : window.x)
        if (window.lag.problem().has(x)) EXPECT_LE(difference(window, batch, i).norm(), 1e-9) << i;
      EXPECT_NEAR(summary.cost, NlpEvaluator(batch.problem).cost(), 1e-9 * (1 + summary.cost));
      const Eigen::Index at = solution.first_unknown(batch.problem, batch.x[k]);
      const Matrix<3, 3> S = window.lag.covariance(window.x[k]);
      EXPECT_LE((S - solution.covariance().block<3, 3>(at, at)).norm(), 1e-9);
      EXPECT_NEAR(S(0, 0), 0, 1e-9);  // x is known from the steps
    }
    EXPECT_EQ(window.lag.problem().num_variables(), int(seconds) + 1);
  }
}

/// Returns whether each row on points before `first` has the same state in the batch as it had when it left.
bool same_active_set(const std::map<std::pair<int, int>, int>& left, const std::map<std::pair<int, int>, int>& now,
                     int first) {
  for (const auto& [row, state] : left)
    if (row.second < first && now.at(row) != state) return false;
  return true;
}

TEST(FixedLagConstraints, InequalitiesMatchTheBatchWhileTheOldActiveSetIsUnchanged) {
  const ConstrainedStream stream{Hard::inequalities};
  ConstrainedWindow window(12.0, stream);
  ConstrainedBatch batch{stream};
  std::map<std::pair<int, int>, int> left;  // (step 0 or height 1, point) → sign of the multiplier
  const auto sign = [](double y) { return (y > 0) - (y < 0); };
  const auto states = [&](const Problem& problem, const std::map<int, Variable<R3>>& x, int k, auto f) {
    const std::vector<int> ids{problem.id(x.at(k))};
    for (const Block& block : problem.hard_blocks_reading(ids)) {
      const auto read = problem.linearization(block).variable_ids;
      if (read.back() == ids[0]) f(read.size() == 1 ? 1 : 0, block);
    }
  };
  int compared = 0, active = 0;
  for (int k = 0; k < 50; ++k) {
    SCOPED_TRACE(k);
    window.arrive(k);
    batch.arrive(k);
    const Summary summary = window.lag.update();
    ASSERT_TRUE(summary.converged()) << summary.message;
    const DenseProgram solution(batch.problem);
    for (int i = 0; i <= k; ++i)
      if (window.lag.problem().has(window.x.at(i)))
        states(window.lag.problem(), window.x, i, [&](int kind, const Block& block) {
          left[{kind, i}] = sign(window.lag.problem().multipliers(block)[0]);
        });
    std::map<std::pair<int, int>, int> now;
    Eigen::Index row = 0;  // rows are grouped by residual, in the order of their first use
    for (int kind : {1, 0})
      for (int i = kind == 0 ? 1 : 0; i <= k; ++i) now[{kind, i}] = sign(solution.multipliers()[row++]);
    for (const auto& [which, state] : now) active += state != 0;
    if (!same_active_set(left, now, k + 1)) continue;
    ++compared;
    for (const auto& [i, x] : window.x)
      if (window.lag.problem().has(x)) EXPECT_LE(difference(window, batch, i).norm(), 1e-9) << i;
    const Eigen::Index at = solution.first_unknown(batch.problem, batch.x[k]);
    EXPECT_LE((window.lag.covariance(window.x[k]) - solution.covariance().block<3, 3>(at, at)).norm(), 1e-9);
  }
  EXPECT_GE(compared, 25);
  EXPECT_GE(active, 100);
}

/// Returns how far the newest state is from the batch of all data at most, relative to its standard deviation without
/// constraints.
double largest_difference(double seconds) {
  double largest = 0;
  for (unsigned seed = 0; seed < 4; ++seed) {
    const ConstrainedStream stream{Hard::inequalities, 0.3, seed};
    ConstrainedWindow window(seconds, stream);
    ConstrainedBatch batch{stream};
    for (int k = 0; k < 50; ++k) {
      window.arrive(k);
      batch.arrive(k);
      EXPECT_TRUE(window.lag.update().converged());
      if (k < 20) continue;
      const DenseProgram solution(batch.problem);
      Problem free = batch.problem.copy();
      for (const Block& block : free.blocks())
        if (block.residual == AxisStep::name || block.residual == Coordinate::name) free.remove(block);
      const double sigma = std::sqrt(Marginals(free).covariance(free.counterpart(batch.x[k])).trace() / 3);
      largest = std::max(largest, difference(window, batch, k).norm() / sigma);
    }
  }
  return largest;
}

/// The window cannot revise the active set of rows that have left. Figures of docs/concepts.md: the motion is beyond its
/// limits half of the time, and rows become active and inactive in intervals of about ten steps.
TEST(FixedLagConstraints, StaysNearTheBatchWhenTheActiveSetChanges) {
  EXPECT_LE(largest_difference(6.0), 1.0);
  EXPECT_LE(largest_difference(16.0), 1e-8);
}

/// Returns the resident memory of this process [MB].
double resident_memory() {
  std::ifstream file("/proc/self/statm");
  double size = 0, resident = 0;
  file >> size >> resident;
  return resident * 4096 / 1e6;
}

TEST(FixedLagConstraints, LongRunsKeepFeasibilityAndMemory) {
  FixedLag lag(seconds_of(2.0));
  Problem& problem = lag.problem();
  std::vector<Variable<R3>> x;
  double violation = 0, memory = 0, height = 0;
  const int updates = kSanitized ? 2000 : 100000;
  for (int k = 0; k < updates; ++k) {
    const double t = 1e-3 * k;
    x.push_back(lag.add(double(k), k ? problem.value(x.back()) : R3()));
    problem.minimize(Prior<R3>{R3(Vector<3>(std::sin(t), 0.2 * k, std::cos(30 * t)))}, noise(3, 0.5), {x.back()});
    if (k == 0) problem.subject_to(Prior<R3>{R3()}, equal_to(0), {x[0]});
    if (k > 0) {
      problem.minimize(RelativePose<R3>{R3()}, noise(3, 1.0), {x[x.size() - 2], x.back()});
      problem.subject_to(AxisStep{0}, equal_to(1e-3), {x[x.size() - 2], x.back()});
      problem.subject_to(AxisStep{2}, between(-0.01, 0.01), {x[x.size() - 2], x.back()});
    }
    const Summary summary = lag.update();
    ASSERT_TRUE(summary.converged()) << k << ": " << summary.message;
    violation = std::max(violation, summary.max_violation);
    if (x.size() > 4) x.erase(x.begin());
    height = problem.value(x.back()).vector()[0];
    ASSERT_NEAR(height, 1e-3 * k, 1e-8) << k;  // the sum of all steps since the given first point
    if (k == 1000) memory = resident_memory();
  }
  EXPECT_LE(violation, 1e-8);
  if (!kSanitized) EXPECT_LE(resident_memory(), memory + 2);  // AddressSanitizer keeps freed memory
  EXPECT_LE(problem.num_hard_blocks(), 6);
}

TEST(FixedLagConstraints, PosesOnACurvedCourseMatchTheBatch) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal(0.0, 0.02);
  const auto noisy = [&] {
    Vector<6> v;
    for (auto& e : v) e = normal(random);
    return SE3::Exp(v);
  };
  FixedLag lag(seconds_of(6.0));
  Problem batch;
  std::vector<Variable<SE3>> x, y;
  const SE3 step = SE3::Exp(Vector<6>(1.0, 0, 0, 0, 0, 0.1));
  const SE3 error = SE3::Exp(Vector<6>(0, 0.03, 0.03, 0.03, 0.03, 0));  // of the initial guess
  SE3 truth;
  double largest = 0;
  int iterations = 0;
  for (int k = 0; k < 40; ++k) {
    x.push_back(lag.add(k, k == 0 ? SE3() : lag.problem().value(x.back()) * step * error));
    y.push_back(batch.add(k == 0 ? SE3() : batch.value(y.back()) * step));
    const SE3 odometry = step * noisy(), seen = truth * noisy();
    const auto blocks = [&](Problem& p, const std::vector<Variable<SE3>>& v) {
      p.subject_to(RollPitch<SE3>{}, equal_to(0), {v.back()});
      if (k == 0) p.minimize(Prior<SE3>{SE3()}, noise(6, 0.01), {v[0]});
      if (k % 3 == 0) p.minimize(Prior<SE3>{seen}, noise(6, 0.05), {v.back()});
      if (k == 0) return;
      const VariablesOf<RelativePose<SE3>> pair{v[v.size() - 2], v.back()};
      p.minimize(RelativePose<SE3>{odometry}, noise(6, 0.03), pair);
      p.subject_to(TwistComponents<SE3, sway | heave>{1.0}, equal_to(0), pair);
      p.subject_to(TwistComponents<SE3, surge>{1.0}, between(0.5, 1.01), pair);
    };
    blocks(lag.problem(), x);
    blocks(batch, y);
    const Summary summary = lag.update();
    ASSERT_TRUE(summary.converged()) << k << ": " << summary.message;
    EXPECT_LE(summary.max_violation, 1e-8);
    ASSERT_TRUE(solve(batch, AugmentedLagrangianOptions{}).converged());
    largest = std::max(largest, minus(lag.problem().value(x.back()), batch.value(y.back())).norm());
    iterations += summary.iterations;
    truth = truth * step;
  }
  EXPECT_LE(largest, 5e-3);
  EXPECT_LE(iterations, 70);  // the curvature of the rows alone takes no iteration
}

/// The heading is unobservable until the vehicle has turned, and turns far when it becomes observable.
TEST(FixedLagConstraints, UnobservableHeadingNeedsNoOtherSolver) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const auto twist = [](int k) { return Vector<6>(0.8, 0, 0, 0, 0, k < 15 ? 0.0 : 0.1); };
  FixedLag lag(seconds_of(30));
  Problem& problem = lag.problem();
  const Variable<SE3> origin = problem.add(SE3());
  problem.fix(origin);
  std::vector<Variable<SE3>> x;
  SE3 truth = SE3::Exp(Vector<6>(1, 2, 0, 0, 0, 1.2));
  for (int k = 0; k < 60; ++k) {
    SCOPED_TRACE(k);
    truth = k == 0 ? truth : truth * SE3::Exp(twist(k));
    const Vector<3> seen = truth.translation() + 0.1 * Vector<3>{normal(random), normal(random), normal(random)};
    x.push_back(lag.add(k, SE3(k == 0 ? SO3() : problem.value(x.back()).rotation(), seen)));
    problem.minimize(UsblPosition<SE3>{seen}, noise(3, 0.1), {origin, x.back()});
    problem.subject_to(RollPitch<SE3>{}, equal_to(0), {x.back()});
    if (k >= 1)
      problem.subject_to(TwistComponents<SE3, sway | heave>{1.0}, equal_to(0), {x[std::size_t(k) - 1], x.back()});
    if (k >= 2)
      problem.minimize(ConstantTwist<SE3>{1, 1}, noise(6, 0.1),
                       {x[std::size_t(k) - 2], x[std::size_t(k) - 1], x.back()});
    const Summary summary = lag.update();
    EXPECT_TRUE(summary.converged()) << summary.message;
    EXPECT_LE(summary.max_violation, 1e-8);
    EXPECT_LE(summary.iterations, 12);
  }
  EXPECT_LE(minus(problem.value(x.back()), truth).norm(), 0.5);
}

TEST(FixedLagConstraints, ExtendedCovarianceIncludesEqualities) {
  ConstrainedWindow window(5.0, {Hard::equalities});
  for (int k = 0; k < 20; ++k) {
    window.arrive(k);
    ASSERT_TRUE(window.lag.update().converged());
  }
  window.arrive(20);
  ASSERT_TRUE(window.lag.extend());
  const Matrix<3, 3> extended = window.lag.linearized_covariance({window.lag.problem().id(window.x[20])}, {3});
  ASSERT_TRUE(window.lag.relinearize());
  const Matrix<3, 3> full = window.lag.covariance(window.x[20]);
  EXPECT_LE((extended - full).norm(), 1e-7);
  EXPECT_NEAR(full(0, 0), 0, 1e-9);
}

TEST(FixedLagConstraints, InfeasibleConstraintsAreNamedAndNothingLeaves) {
  ConstrainedWindow window(3.0, {Hard::inequalities});
  for (int k = 0; k < 10; ++k) {
    window.arrive(k);
    ASSERT_TRUE(window.lag.update().converged());
  }
  Problem& problem = window.lag.problem();
  window.arrive(10);
  const int variables = problem.num_variables();
  const Block clash = problem.subject_to(Coordinate{2}, at_most(-2), {window.x[10]});
  const Summary summary = window.lag.update();
  EXPECT_EQ(summary.status, Status::infeasible);
  EXPECT_THAT(summary.message, HasSubstr("coordinate of"));
  EXPECT_EQ(problem.num_variables(), variables);
  problem.remove(clash);
  EXPECT_TRUE(window.lag.update().converged());
}

TEST(FixedLagConstraints, RejectsAConstraintOnAVariableThatHasLeft) {
  ConstrainedWindow window(3.0, {Hard::equalities});
  for (int k = 0; k < 10; ++k) {
    window.arrive(k);
    ASSERT_TRUE(window.lag.update().converged());
  }
  try {
    window.lag.problem().subject_to(Coordinate{1}, equal_to(0), {window.x[2]});
    FAIL();
  } catch (const StaleHandleError& error) {
    EXPECT_THAT(error.what(), HasSubstr("variable 2 has been removed from the problem"));
  }
}

}  // namespace
}  // namespace tandem::testing
