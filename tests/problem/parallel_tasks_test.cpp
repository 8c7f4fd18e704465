#include <array>
#include <atomic>

#include <gtest/gtest.h>

#include <tandem/problem/parallel_tasks.hpp>

#include "mixed_problem.hpp"
#include "sanitized.hpp"

namespace tandem::testing {
namespace {

TEST(TaskRunner, RunsEachTaskOnceAndRethrowsTheFirstError) {
  const ThreadLimit more_than_cores(7);
  for (const int threads : {0, 1, 2, 3, 7}) {
    detail::TaskRunner tasks;
    tasks.use_threads(threads);
    std::array<std::atomic<int>, 3 * detail::kMaxTasks + 1> runs{};
    tasks.run(int(runs.size()), [&](int task) { ++runs[std::size_t(task)]; });
    for (const auto& n : runs) EXPECT_EQ(n, 1);
    try {
      tasks.run(detail::kMaxTasks, [](int task) {
        if (task % 5 == 3) throw Error("task " + std::to_string(task));
      });
      FAIL() << "nothing was thrown";
    } catch (const Error& e) {
      EXPECT_STREQ(e.what(), "task 3");
    }
  }
  EXPECT_THROW(detail::TaskRunner().use_threads(-1), Error);
  EXPECT_THROW(ThreadLimit(0), Error);
}

TEST(ChunkedLoop, CoversTheRangeIndependentlyOfThreads) {
  const ThreadLimit more_than_cores(7);
  for (const std::int64_t size : {0, 1, 9, 10, 33, 1000}) {
    const Eigen::VectorXd x = random_vector(int(size), 1.0, 3);
    double first = 0;
    for (const int threads : {1, 2, 7}) {
      detail::TaskRunner tasks;
      tasks.use_threads(threads);
      const detail::ChunkedLoop chunks(tasks, size, 5);
      EXPECT_EQ(chunks.count(), size < 5 ? 1 : detail::kMaxTasks);
      std::vector<int> visits(std::size_t(size), 0);
      chunks.each([&](int, Eigen::Index begin, Eigen::Index n) {
        for (Eigen::Index i = begin; i < begin + n; ++i) ++visits[std::size_t(i)];
      });
      EXPECT_EQ(visits, std::vector<int>(std::size_t(size), 1));
      const double sum = chunks.sum([&](Eigen::Index begin, Eigen::Index n) { return x.segment(begin, n).sum(); });
      EXPECT_NEAR(sum, x.sum(), 1e-12);
      if (threads == 1) first = sum;
      EXPECT_EQ(sum, first) << "bitwise";
      EXPECT_EQ(
          chunks.max([&](Eigen::Index begin, Eigen::Index n) { return n ? x.segment(begin, n).maxCoeff() : -9.0; }),
          size ? x.maxCoeff() : -9.0);
    }
  }
}

/// Long chain with a beacon that many blocks read, robust losses, equalities and inequalities. Blocks are added in an
/// order that `stride`, coprime to their number, shuffles.
struct LongChain {
  static constexpr int kPoses = 900;

  explicit LongChain(int stride) {
    const Gaussian noise{0.3, 0.2, 0.4, 0.05, 0.04, 0.1};
    const SE3 step = SE3::Exp(Vector<6>(1.0, 0.05, -0.02, 0.02, -0.03, 0.1));
    for (int k = 0; k < kPoses; ++k) x.push_back(problem.add(SE3::Exp(0.3 * random_vector(6, 1.0, unsigned(k)))));
    beacon = problem.add(R3(Vector<3>(4.0, -2.0, 1.0)));
    problem.minimize(Prior<SE3>{SE3()}, noise, {x[0]});
    for (int n = 0; n < kPoses; ++n) {
      const std::size_t k = std::size_t(n * stride % kPoses);
      problem.minimize(RollPitch<SE3>{}, Gaussian{0.1, 0.1}, {x[k]});
      if (k % 4 == 0)
        problem.minimize(UsblPosition<SE3, R3>{Vector<3>(1.0, 2.0, 3.0)}, kUnit3, {x[k], beacon}, Huber(1.0));
      if (k < 1) continue;
      problem.minimize(RelativePose<SE3>{step}, noise, {x[k - 1], x[k]}, Cauchy(2.0));
      if (k % 3 == 0) problem.subject_to(TwistComponents<SE3, sway | heave>{1.0}, equal_to(0.0), {x[k - 1], x[k]});
      problem.subject_to(TwistComponents<SE3, surge>{1.0}, between(0.0, 2.0), {x[k - 1], x[k]});
      if (k > 1) problem.minimize(ConstantTwist<SE3>{1.0, 1.1}, noise, {x[k - 2], x[k - 1], x[k]});
    }
  }

  Problem problem;
  std::vector<Variable<SE3>> x;
  Variable<R3> beacon;
};

/// All results of an NlpEvaluator at a point away from X̄.
struct Evaluated {
  double cost, linearized_cost;
  Eigen::VectorXd gradient, hessian, rows, jacobian, with_constraints, exact;

  explicit Evaluated(Problem& problem, int threads) {
    NlpEvaluator nlp(problem);
    nlp.use_threads(threads);
    const int n = nlp.num_unknowns(), m = nlp.num_rows();
    nlp.move_to(random_vector(n, 0.2, 1));
    cost = nlp.cost();
    hessian = exact = Eigen::VectorXd(nlp.hessian_pattern().nonzeros());
    gradient.resize(n);
    linearized_cost = nlp.linearize(gradient, hessian);
    rows.resize(m);
    jacobian.resize(Eigen::Index(nlp.jacobian_pattern().row.size()));
    nlp.constraints(rows);
    nlp.constraint_jacobian(jacobian);
    with_constraints = hessian;
    nlp.add_constraint_hessian(random_vector(m, 2.0, 2).cwiseAbs(), jacobian, with_constraints);
    nlp.exact_hessian(1.5, random_vector(m, 3.0, 3), exact);
  }
};

TEST(TaskRunner, ResultsAreBitwiseIndependentOfThreads) {
  const ThreadLimit more_than_cores(7);
  for (const int stride : {1, 257}) {
    LongChain chain(stride);
    const Evaluated one(chain.problem, 1);
    EXPECT_EQ(one.cost, one.linearized_cost);
    for (const int threads : {3, 0, 2, 7}) {
      if (kSanitized && threads != 3) break;
      const Evaluated many(chain.problem, threads);
      EXPECT_EQ(many.cost, one.cost);
      EXPECT_EQ(many.linearized_cost, one.linearized_cost);
      EXPECT_EQ(many.gradient, one.gradient);
      EXPECT_EQ(many.hessian, one.hessian);
      EXPECT_EQ(many.rows, one.rows);
      EXPECT_EQ(many.jacobian, one.jacobian);
      EXPECT_EQ(many.with_constraints, one.with_constraints);
      EXPECT_EQ(many.exact, one.exact);
    }
  }
}

TEST(TaskRunner, ResultsDoNotDependOnTheOrderOfBlocks) {
  LongChain in_order(1), shuffled(257);
  const Evaluated a(in_order.problem, 2), b(shuffled.problem, 2);
  EXPECT_NEAR(a.cost, b.cost, 1e-12 * a.cost);
  EXPECT_LE((a.gradient - b.gradient).norm(), 1e-12 * a.gradient.norm());
  EXPECT_LE((a.hessian - b.hessian).norm(), 1e-12 * a.hessian.norm());
}

}  // namespace
}  // namespace tandem::testing
