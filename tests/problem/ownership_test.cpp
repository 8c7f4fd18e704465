#include <optional>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/problem/subproblem.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>

#include "mixed_problem.hpp"

/// Handles cannot dangle: use of an invalid handle is an error, even if its problem was moved or destroyed. Contents of
/// problems move with their handles.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

R3 at(double x) { return R3(Vector<3>(x, 0, 0)); }

/// Two variables, a cost, a constraint, a second cost.
struct Line {
  Problem problem;
  Variable<R3> a = problem.add(at(1), "a"), b = problem.add(at(2), "b");
  Block prior = problem.minimize(Prior<R3>{at(0)}, kUnit3, {a}, Cauchy(1.0));
  Block bound = problem.subject_to(Prior<R3>{at(0)}, at_most(5.0), {b});
  Block step = problem.minimize(RelativePose<R3>{at(1)}, kUnit3, {a, b});
};

/// Expects every access with these handles to be an error of type StaleHandleError, and the problem to be unchanged.
void expect_stale(Problem& problem, const Variable<R3>& x, const Block& soft, const Block& hard) {
  const int variables = problem.num_variables(), blocks = problem.num_soft_blocks() + problem.num_hard_blocks();
  EXPECT_FALSE(problem.has(x));
  EXPECT_THROW(problem.value(x), StaleHandleError);
  EXPECT_THROW(problem.set_value(x, at(9)), StaleHandleError);
  EXPECT_THROW(problem.id(x), StaleHandleError);
  EXPECT_THROW(problem.is_fixed(x), StaleHandleError);
  EXPECT_THROW(problem.fix(x), StaleHandleError);
  EXPECT_THROW(problem.remove(x), StaleHandleError);
  EXPECT_THROW(problem.marginalize(x), StaleHandleError);
  EXPECT_THROW(problem.minimize(Prior<R3>{}, kUnit3, {x}), StaleHandleError);
  EXPECT_THROW(problem.subject_to(Prior<R3>{}, at_most(1.0), {x}), StaleHandleError);
  for (const Block& block : {soft, hard}) {
    EXPECT_FALSE(problem.has(block));
    EXPECT_THROW(problem.linearization(block), StaleHandleError);
    EXPECT_THROW(problem.describe(block), StaleHandleError);
    EXPECT_THROW(problem.set_residual(block, Prior<R3>{}), StaleHandleError);
    EXPECT_THROW(problem.remove(block), StaleHandleError);
  }
  EXPECT_THROW(problem.weight(soft), StaleHandleError);
  EXPECT_THROW(problem.noise(soft), StaleHandleError);
  EXPECT_THROW(problem.set_noise(soft, kUnit3), StaleHandleError);
  EXPECT_THROW(problem.loss(soft), StaleHandleError);
  EXPECT_THROW(problem.set_loss(soft, {}), StaleHandleError);
  EXPECT_THROW(problem.multipliers(hard), StaleHandleError);
  EXPECT_THROW(problem.set_multipliers(hard, Eigen::VectorXd::Zero(3)), StaleHandleError);
  EXPECT_THROW(problem.set_bounds(hard, at_most(1.0)), StaleHandleError);
  EXPECT_EQ(problem.num_variables(), variables);
  EXPECT_EQ(problem.num_soft_blocks() + problem.num_hard_blocks(), blocks);
}

TEST(Ownership, HandlesOfAnotherProblemAreErrors) {
  Line ours, theirs;  // the same slots, IDs and generations
  expect_stale(ours.problem, theirs.a, theirs.prior, theirs.bound);
  EXPECT_THAT([&] { ours.problem.value(theirs.b); }, ThrowsMessage<StaleHandleError>(HasSubstr("variable b belongs")));
  EXPECT_THAT([&] { ours.problem.weight(theirs.prior); }, ThrowsMessage<StaleHandleError>(HasSubstr("prior")));
  std::optional<Line> gone(std::in_place);
  const Line handles{Problem(), gone->a, gone->b, gone->prior, gone->bound, gone->step};
  gone.reset();
  expect_stale(ours.problem, handles.a, handles.prior, handles.bound);
}

TEST(Ownership, UnsetHandlesAreErrors) {
  Line line;
  expect_stale(line.problem, {}, {}, {});
}

TEST(Ownership, HandlesFollowTheContentsThatMove) {
  Line line;
  Problem moved = std::move(line.problem);
  EXPECT_EQ(moved.value(line.a).vector()[0], 1);
  EXPECT_EQ(moved.describe(line.step), "relative pose of a, b");
  expect_stale(line.problem, line.a, line.prior, line.bound);
  // A moved-from problem is empty and can be used again.
  EXPECT_EQ(line.problem.num_variables() + line.problem.id_bound() + line.problem.num_soft_blocks(), 0);
  const Variable<R3> again = line.problem.add(at(7));
  EXPECT_EQ(line.problem.value(again).vector()[0], 7);
  EXPECT_EQ(line.problem.name(line.problem.id(again)), "variable 0");
  EXPECT_FALSE(moved.has(again));
}

TEST(Ownership, AssignmentInvalidatesTheHandlesOfTheReplacedContents) {
  Line old, other;
  old.problem = std::move(other.problem);
  expect_stale(old.problem, old.a, old.prior, old.bound);
  EXPECT_EQ(old.problem.value(other.b).vector()[0], 2);
  EXPECT_TRUE(old.problem.has(other.prior));
}

TEST(Ownership, ACopyThatReplacesItsOriginalHasItsOwnHandles) {
  Line line;
  Problem copy = line.problem.copy();
  const Variable<R3> own = copy.counterpart(line.a);
  copy.set_value(own, at(8));
  line.problem = std::move(copy);
  EXPECT_EQ(line.problem.value(own).vector()[0], 8);
  EXPECT_THROW(line.problem.value(line.a), StaleHandleError);
  EXPECT_TRUE(line.problem.has(line.prior)) << "block handles are valid in copies";
}

TEST(Ownership, CopiesThatDivergedAreToldApart) {
  Line line;
  Problem copy = line.problem.copy();
  const Variable<R3> c = line.problem.add(at(3), "c"), d = copy.add(at(4), "d");
  const Block of_c = line.problem.minimize(Prior<R3>{}, kUnit3, {c});
  const Block of_d = copy.minimize(Prior<R3>{}, kUnit3, {d});
  EXPECT_THROW(copy.counterpart(c), StaleHandleError);
  EXPECT_THROW(line.problem.counterpart(d), StaleHandleError);
  EXPECT_FALSE(copy.has(of_c) || line.problem.has(of_d));
  EXPECT_TRUE(copy.has(copy.counterpart(of_c))) << "by place, as in problems that were built alike";
}

TEST(Ownership, SwapExchangesContentsAndHandles) {
  Line one, two;
  two.problem.set_value(two.a, at(5));
  swap(one.problem, two.problem);
  EXPECT_EQ(two.problem.value(one.a).vector()[0], 1);
  EXPECT_EQ(one.problem.value(two.a).vector()[0], 5);
  expect_stale(one.problem, one.a, one.prior, one.bound);
  std::swap(one.problem, two.problem);
  EXPECT_EQ(one.problem.value(one.a).vector()[0], 1);
  Problem& same = one.problem;
  one.problem = std::move(same);
  EXPECT_EQ(one.problem.value(one.a).vector()[0], 1) << "assignment to itself";
}

TEST(Ownership, AMovedFromProblemHasNoMarginalPrior) {
  Line line;
  line.problem.remove(line.bound);
  line.problem.marginalize(line.a);
  ASSERT_TRUE(line.problem.marginal_prior());
  Problem moved = std::move(line.problem);
  EXPECT_FALSE(line.problem.marginal_prior());
  EXPECT_EQ(line.problem.loss_scale(), 1.0);
  const Variable<R3> x = line.problem.add(R3()), y = line.problem.add(R3());
  line.problem.minimize(RelativePose<R3>{}, kUnit3, {x, y});
  line.problem.marginalize(x);
  EXPECT_TRUE(line.problem.has(*line.problem.marginal_prior()));
  EXPECT_TRUE(moved.has(*moved.marginal_prior()));
}

TEST(Ownership, EvaluatorsAndPartsOfReplacedContentsAreStale) {
  Line line, other;
  NlpEvaluator nlp(line.problem);
  const int ids[] = {line.problem.id(line.a)};
  Subproblem part(line.problem, ids);
  line.problem = std::move(other.problem);
  Eigen::VectorXd y(nlp.num_rows());
  EXPECT_FALSE(nlp.is_current());
  EXPECT_THROW(nlp.cost(), StaleHandleError);
  EXPECT_THROW(nlp.save(), StaleHandleError);
  EXPECT_THROW(nlp.largest_angle(), StaleHandleError);
  EXPECT_THROW(nlp.multipliers(y), StaleHandleError);
  EXPECT_THROW(nlp.set_multipliers(y), StaleHandleError);
  EXPECT_THROW(nlp.describe_row(0), StaleHandleError);
  EXPECT_THROW(nlp.describe_unknown(0), StaleHandleError);
  EXPECT_THROW(part.update_from_whole(), StaleHandleError);
  EXPECT_THROW(part.write_back(), StaleHandleError);
}

TEST(Ownership, IdsOfNoVariableAreErrors) {
  Line line;
  for (const int id : {-1, 2, 1000}) {
    const int ids[] = {id};
    EXPECT_THROW(line.problem.name(id), StaleHandleError);
    EXPECT_THROW(line.problem.is_fixed(id), StaleHandleError);
    EXPECT_THROW(line.problem.sequence_number(id), StaleHandleError);
    EXPECT_THROW(line.problem.soft_blocks_reading(ids), StaleHandleError);
    EXPECT_THROW(line.problem.marginalize(ids), StaleHandleError);
    EXPECT_THROW(Subproblem(line.problem, ids), StaleHandleError);
  }
}

/// Residual x − at; undefined for x > 3. It throws what a user may throw.
template <class Thrown>
struct Edge {
  static constexpr std::string_view name = "edge";
  static constexpr int dim = 1;
  using States = std::tuple<Rn<1>>;
  void operator()(const Rn<1>& x, Vector<1>& r, Matrix<1, 1>* J = nullptr) const {
    if (x.vector()[0] > 3) throw Thrown("edge: undefined beyond 3");
    r = x.vector();
    if (J) J->setIdentity();
  }
};

template <class Thrown>
UndefinedResidualError error_of_edge() {
  Problem problem;
  problem.minimize(Edge<Thrown>{}, Gaussian{1.0}, {problem.add(Rn<1>(Vector<1>(4.0)), "rim")});
  NlpEvaluator nlp(problem);
  EXPECT_THROW(problem.linearization(problem.blocks()[0]), UndefinedResidualError);
  try {
    nlp.cost();
  } catch (const UndefinedResidualError& error) {
    return error;
  }
  return UndefinedResidualError("none");
}

TEST(ResidualErrors, NameTheResidualAndItsVariables) {
  for (const auto& error :
       {error_of_edge<Error>(), error_of_edge<UndefinedResidualError>(), error_of_edge<BadInputError>()}) {
    EXPECT_STREQ(error.what(), "edge of rim: undefined beyond 3");
    EXPECT_EQ(error.residual(), "edge");
    EXPECT_THAT(error.variables(), ::testing::ElementsAre("rim"));
  }
  Problem problem;
  problem.minimize(Edge<StaleHandleError>{}, Gaussian{1.0}, {problem.add(Rn<1>(Vector<1>(4.0)))});
  EXPECT_THROW(NlpEvaluator(problem).cost(), StaleHandleError) << "not an undefined residual";
}

/// Residual that cannot be written to a file: fields() would not even compile.
struct Packed {
  static constexpr std::string_view name = "packed";
  static constexpr int dim = 1;
  using States = std::tuple<Rn<1>>;
  unsigned scale : 3;
  union {
    int as_integer;
    double as_number;
  };
  void operator()(const Rn<1>& x, Vector<1>& r, Matrix<1, 1>* J = nullptr) const {
    r = double(scale) * x.vector();
    if (J) J->setConstant(double(scale));
  }
};

TEST(ResidualTypes, NeedNotBeStorable) {
  Problem problem;
  const auto x = problem.add(Rn<1>(Vector<1>(1.0)));
  problem.minimize(Packed{2, {3}}, Gaussian{1.0}, {x});
  problem.subject_to(Packed{1, {0}}, at_most(5.0), {x});
  EXPECT_EQ(NlpEvaluator(problem).cost(), 0.5 * 4);
}

TEST(ResidualTypes, LossScalesMustBePositive) {
  Line line;
  Loss loss = Cauchy(1.0);
  for (const double scale : {0.0, -1.0, double(NAN)}) {
    loss.scale = scale;
    EXPECT_THROW(line.problem.set_loss(line.prior, loss), BadInputError);
    EXPECT_THROW(line.problem.minimize(Prior<R3>{}, kUnit3, {line.a}, loss), BadInputError);
  }
  EXPECT_EQ(line.problem.loss(line.prior).scale, 1.0);
}

TEST(Ownership, LinearizationChecksItsVariables) {
  Problem problem;
  const auto x = problem.add(R3()), y = problem.add(R3());
  const auto angle = problem.add(SO2());
  const int removed = problem.id(y);
  problem.remove(y);
  const Prior<R3> residual{};
  const auto linearize = [&](std::vector<int> ids) {
    return problem.linearization(detail::kResidualFunctions<Prior<R3>>, &residual, ids);
  };
  EXPECT_EQ(linearize({problem.id(x)}).residual.size(), 3);
  EXPECT_THROW(linearize({99}), StaleHandleError);
  EXPECT_THROW(linearize({-1}), StaleHandleError);
  EXPECT_THROW(linearize({removed}), StaleHandleError);
  EXPECT_THROW(linearize({problem.id(angle)}), BadInputError);
  EXPECT_THROW(linearize({}), BadInputError);
  EXPECT_THROW(linearize({problem.id(x), problem.id(x)}), BadInputError);
}

}  // namespace
}  // namespace tandem::testing
