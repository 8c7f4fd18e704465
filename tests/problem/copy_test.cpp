#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/file/problem_file.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>

#include "mixed_problem.hpp"

/// Copies of a problem are bitwise equal and independent. Problems are compared by their file text.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

template <class Options>
void expect_same_solves(Problem& a, Problem& b, const Options& options) {
  const Summary of_a = solve(a, options), of_b = solve(b, options);
  EXPECT_EQ(of_a.status, of_b.status);
  EXPECT_EQ(of_a.iterations, of_b.iterations);
  EXPECT_EQ(of_a.evaluations, of_b.evaluations);
  EXPECT_EQ(of_a.cost, of_b.cost);
  EXPECT_EQ(of_a.initial_cost, of_b.initial_cost);
  EXPECT_EQ(of_a.max_violation, of_b.max_violation);
  EXPECT_EQ(problem_text(a), problem_text(b));
}

/// Chain of poses with relative poses and a robust prior on each pose.
struct Chain {
  Problem problem;
  std::vector<Variable<SE3>> x;
  std::vector<Block> steps, priors;

  explicit Chain(int n) {
    const Gaussian noise(Vector<6>::Constant(0.1));
    for (int i = 0; i < n; ++i)
      x.push_back(problem.add(SE3::Exp(0.1 * random_vector(6, 1, unsigned(i))), "x" + std::to_string(i)));
    for (int i = 0; i < n; ++i) {
      priors.push_back(problem.minimize(Prior<SE3>{SE3::Exp(random_vector(6, 1, unsigned(100 + i)))}, noise,
                                        {x[std::size_t(i)]}, Cauchy(2.0)));
      if (i > 0)
        steps.push_back(problem.minimize(RelativePose<SE3>{SE3::Exp(random_vector(6, 0.5, unsigned(200 + i)))}, noise,
                                         {x[std::size_t(i - 1)], x[std::size_t(i)]}));
    }
  }
};

TEST(ProblemCopy, IsEqualAndSolvesIdentically) {
  MixedProblem made;
  made.problem.fix(made.v.c);
  made.problem.scale_losses(1.7);
  Problem copy = made.problem.copy();
  EXPECT_EQ(problem_text(copy), problem_text(made.problem));
  AugmentedLagrangianOptions options;
  options.max_iterations = 30;
  expect_same_solves(made.problem, copy, options);
  // The results of a solve, including multipliers, are copied as well.
  Problem solved = made.problem.copy();
  EXPECT_EQ(problem_text(solved), problem_text(made.problem));
  options.from_multipliers = true;
  expect_same_solves(made.problem, solved, options);
}

TEST(ProblemCopy, IsIndependentOfTheOriginal) {
  MixedProblem made;
  const std::string before = problem_text(made.problem);
  const std::vector<Block> blocks = made.problem.blocks();
  const auto change = [&](Problem& problem, const MixedVariables& v) {
    problem.set_value(v.a, SE3());
    problem.fix(v.p);
    for (const Block& block : blocks) {
      const Eigen::Index rows = problem.linearization(block).residual.size();
      try {
        problem.set_noise(block, Gaussian(Eigen::VectorXd::Constant(rows, 0.123)));
        problem.set_loss(block, Tukey(9.0));
      } catch (const Error&) {  // a hard block
        problem.set_bounds(block, between(-7.0, 7.0));
        problem.set_multipliers(block, Eigen::VectorXd::Constant(rows, 0.5));
      }
    }
    problem.set_residual(blocks[0], Prior<SE3>{problem.value(v.b)});
    problem.scale_losses(3.0);
    problem.add(SE3(), "new");
    problem.remove(blocks[1]);
    problem.subject_to(Prior<R3>{R3()}, at_most(3.0), {v.p});
  };
  const auto own = [](const Problem& problem, const MixedVariables& v) {
    return MixedVariables{problem.counterpart(v.a), problem.counterpart(v.b), problem.counterpart(v.p),
                          problem.counterpart(v.q), problem.counterpart(v.c), problem.counterpart(v.s)};
  };
  Problem copy = made.problem.copy(), another = made.problem.copy();
  change(copy, own(copy, made.v));
  EXPECT_NE(problem_text(copy), before);
  EXPECT_EQ(problem_text(made.problem), before);
  change(made.problem, made.v);
  EXPECT_EQ(problem_text(another), before);
  EXPECT_EQ(problem_text(made.problem), problem_text(copy));
}

TEST(ProblemCopy, OutlivesTheOriginal) {
  std::optional<Chain> chain(std::in_place, 5);
  Problem copy = chain->problem.copy();
  const auto x = copy.counterpart(chain->x[4]);
  const Summary of_chain = solve(chain->problem, GaussNewtonOptions{});
  chain.reset();
  EXPECT_EQ(solve(copy, GaussNewtonOptions{}).cost, of_chain.cost);
  EXPECT_EQ(copy.name(copy.id(x)), "x4");
}

TEST(ProblemCopy, KeepsFreeSlots) {
  Chain chain(6);
  chain.problem.remove(chain.steps[0]);
  chain.problem.remove(chain.priors[0]);
  chain.problem.remove(chain.x[0]);
  const Variable<SE3> again = chain.problem.add(SE3(), "again");  // reuses the slot of x0
  chain.problem.remove(chain.steps[4]);
  chain.problem.remove(chain.priors[5]);
  chain.problem.remove(chain.x[5]);  // leaves a free slot
  Problem copy = chain.problem.copy();

  EXPECT_EQ(copy.num_variables(), 5);
  EXPECT_EQ(copy.id_bound(), 6);
  EXPECT_EQ(copy.sequence_number(copy.id(copy.counterpart(again))), 6);
  EXPECT_THAT([&] { copy.counterpart(chain.x[0]); }, ThrowsMessage<Error>(HasSubstr("no variable")));
  EXPECT_THAT([&] { copy.counterpart(chain.x[5]); }, ThrowsMessage<Error>(HasSubstr("no variable")));
  EXPECT_THROW(copy.remove(chain.steps[0]), Error);
  EXPECT_EQ(copy.weight(chain.priors[3]), chain.problem.weight(chain.priors[3]));
  // New variables and blocks get the same slots and IDs in both problems.
  const auto added = chain.problem.add(SE3()), in_copy = copy.add(SE3());
  EXPECT_EQ(added.slot, in_copy.slot);
  EXPECT_EQ(added.generation, in_copy.generation);
  EXPECT_EQ(chain.problem.id(added), copy.id(in_copy));
  const Gaussian noise(Vector<6>::Constant(0.2));
  const Block block = chain.problem.minimize(Prior<SE3>{SE3()}, noise, {added});
  const Block of_copy = copy.minimize(Prior<SE3>{SE3()}, noise, {in_copy});
  EXPECT_EQ(block.id, of_copy.id);
  EXPECT_EQ(block.generation, of_copy.generation);
  expect_same_solves(chain.problem, copy, GaussNewtonOptions{});
}

TEST(ProblemCopy, CopiesMarginalPriorWithItsAnchors) {
  Chain chain(6);
  chain.problem.marginalize(chain.x[0], chain.x[1]);
  // Moves away from the anchors, to detect a copy that takes the values as anchors.
  chain.problem.set_value(chain.x[2], SE3::Exp(random_vector(6, 0.7, 9)));
  Problem copy = chain.problem.copy();
  EXPECT_EQ(problem_text(copy), problem_text(chain.problem));
  EXPECT_EQ(copy.marginal_prior()->id, chain.problem.marginal_prior()->id);
  const std::string before = problem_text(copy);
  chain.problem.marginalize(chain.x[2]);
  EXPECT_EQ(problem_text(copy), before) << "the copy has its own prior";
  copy.marginalize(copy.counterpart(chain.x[2]));
  expect_same_solves(chain.problem, copy, GaussNewtonOptions{});
}

TEST(ProblemCopy, CounterpartReturnsTheHandleInTheOtherProblem) {
  Problem problem;
  const auto x = problem.add(SE3(), "x");
  Problem copy = problem.copy();
  const auto y = copy.counterpart(x);
  EXPECT_FALSE(copy.has(x));
  EXPECT_TRUE(copy.has(y));
  EXPECT_TRUE(problem.has(problem.counterpart(y))) << "counterpart of the counterpart";
  copy.set_value(y, SE3::Exp(Vector<6>::Ones()));
  EXPECT_TRUE(problem.value(x).Log().isZero());
  Problem with_point;
  const auto point = with_point.add(R3());
  EXPECT_THROW(copy.counterpart(point), Error) << "no variable of this group";
  EXPECT_THROW(copy.counterpart(Variable<SE3>()), Error);
}

TEST(ProblemHandles, AreListedInOrder) {
  MixedProblem made;
  Problem& problem = made.problem;
  problem.remove(problem.add(SE3()));
  const auto late = problem.add(SE3(), "late");
  const std::vector<Variable<SE3>> poses = problem.variables<SE3>();
  ASSERT_EQ(poses.size(), 4u);
  EXPECT_EQ(problem.id(poses[0]), problem.id(made.v.a));
  EXPECT_EQ(problem.id(poses[2]), problem.id(made.v.c));
  EXPECT_EQ(problem.id(poses[3]), problem.id(late));
  EXPECT_TRUE(problem.variables<SO2>().empty());
  const std::vector<Block> blocks = problem.blocks();
  EXPECT_EQ(int(blocks.size()), problem.num_soft_blocks() + problem.num_hard_blocks());
  EXPECT_EQ(problem.describe(blocks[0]), "prior of a");
  EXPECT_EQ(problem.describe(blocks.back()), "carried point of s, p");
  problem.remove(blocks[0]);
  EXPECT_EQ(problem.blocks().size(), blocks.size() - 1);
  EXPECT_THROW(problem.describe(blocks[0]), Error);
}

}  // namespace
}  // namespace tandem::testing
