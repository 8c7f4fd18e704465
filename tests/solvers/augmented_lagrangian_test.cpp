#include <Eigen/Dense>
#include <gmock/gmock.h>

#include <tandem/residuals/twist_components.hpp>
#include <tandem/solvers/augmented_model.hpp>

#include "allocation_count.hpp"
#include "cases.hpp"
#include "problem/tracking/simulated_tracking.hpp"

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;

/// Equalities, and lower and upper bounds, some of which are active at the solution.
const TrackingOptions kConstrained{
    .roll_pitch = Role::hard, .non_holonomic = Role::hard, .surge = between(0.0, 0.85), .max_yaw_rate = 0.05};

AugmentedLagrangianOptions with_progress(std::function<void(const Progress&)> progress) {
  AugmentedLagrangianOptions options;
  options.progress = std::move(progress);
  return options;
}

TEST(AugmentedLagrangian, RejectsInvalidOptions) {
  Problem problem;
  const auto x = problem.add(R1(), "x");
  problem.minimize(Prior<R1>{R1()}, Gaussian{1.0}, {x});
  EXPECT_EQ(why_unsupported(problem, AugmentedLagrangianOptions{}), "");
  AugmentedLagrangianOptions options;
  options.initial_penalty = 0.0;
  EXPECT_THROW(solve(problem, options), Error);
  options = {};
  options.cost_tolerance = -1.0;
  EXPECT_THROW(solve(problem, options), Error);
}

TEST(AugmentedLagrangian, EqualsGaussNewtonWithoutHardConstraints) {
  TrackingProblem first = make_tracking_problem(noisy(6.0).data()), second = make_tracking_problem(noisy(6.0).data());
  const Summary a = solve(first.problem, GaussNewtonOptions{}), b = solve(second.problem, AugmentedLagrangianOptions{});
  EXPECT_EQ(a.cost, b.cost);
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_EQ(a.evaluations, b.evaluations);
  EXPECT_EQ(b.solver, "augmented-lagrangian");
}

/// min ½‖x − p‖² subject to x ≥ 1, y ≤ 0.5, z = 2, for p = (0, −1, 5). Only the first inequality is active.
TEST(AugmentedLagrangian, FindsTheActiveSet) {
  Problem problem;
  const auto x = problem.add(R3({7.0, 7.0, 7.0}));
  problem.minimize(Prior<R3>{R3({0.0, -1.0, 5.0})}, Gaussian{1.0, 1.0, 1.0}, {x});
  problem.subject_to(Prior<R3>{R3()}, Bounds<3>{{1.0, -HUGE_VAL, 2.0}, {HUGE_VAL, 0.5, 2.0}}, {x});
  const Summary s = solve(problem, AugmentedLagrangianOptions{});
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_LE((problem.value(x).vector() - Vector<3>(1.0, -1.0, 2.0)).norm(), 1e-8);
  EXPECT_NEAR(s.cost, 0.5 * (1.0 + 9.0), 1e-7);
  EXPECT_LE(s.iterations, 10);
}

/// The multiplier estimate keeps its digits even if y / w is as small as the rounding of c.
TEST(AugmentedLagrangian, EstimatesMultipliersWithoutRoundingErrors) {
  Problem problem;
  const auto x = problem.add(R3({0.3, -0.3, 2.5}));
  problem.minimize(Prior<R3>{R3()}, Gaussian{1.0, 1.0, 1.0}, {x});
  problem.subject_to(Prior<R3>{R3()}, Bounds<3>{{-0.3, -0.3, 2.5}, {0.3, 0.3, 2.5}}, {x});
  NlpEvaluator nlp(problem);
  detail::AugmentedTerm term(nlp);
  term.linearize();
  term.start(Vector<3>::Constant(1e3));
  term.set_penalty(1e10);
  const Eigen::VectorXd y = Vector<3>(1403.012345678, -488.512345678, 74.612345678);
  term.set_multipliers(y);
  Eigen::VectorXd estimated(3);
  term.estimate(estimated);
  EXPECT_LE((estimated - y).norm(), 1e-12 * y.norm());
  term.begin_step();
  Eigen::VectorXd g = Eigen::VectorXd::Zero(3);
  term.add_gradient(g);
  EXPECT_LE((g - y).norm(), 1e-12 * y.norm());
}

TEST(AugmentedLagrangian, ShortensStepsToNonfiniteConstraints) {
  Problem problem;
  const auto x = problem.add(R1(Vector<1>(10.0)));
  problem.minimize(Prior<R1>{R1(Vector<1>(100.0))}, Gaussian{1.0}, {x});
  problem.subject_to(Wall{30.0}, between(-1e3, 200.0), {x});
  const Summary s = solve(problem, AugmentedLagrangianOptions{});
  EXPECT_LT(s.cost, s.initial_cost);
  EXPECT_GT(problem.value(x).vector()[0], 25.0);
  EXPECT_LE(problem.value(x).vector()[0], 30.0);
}

TEST(AugmentedLagrangian, UsesTheExactHessianOnlyWhileStepsAreStronglyDamped) {
  Problem problem;
  const auto x = problem.add(R3({2.0, 2.0, 2.0}));
  problem.minimize(Prior<R3>{R3({2.0, -1.0, 2.0})}, Gaussian{1.0, 1.0, 1.0}, {x});
  problem.subject_to(SquaredNorm{}, equal_to(4.0), {x});
  NlpEvaluator nlp(problem);
  const AugmentedLagrangianOptions options;
  detail::Session session("test", options);
  detail::AugmentedModel model(nlp, session, options, options.initial_penalty);
  session.summary.cost = model.linearize();
  model.begin();
  const auto step = [&] {
    EXPECT_TRUE(model.find_step(1e-5));
    return model.step();
  };
  const detail::SoftModel::StepQuality damped{.strongly_damped = true}, undamped{.undamped = true}, neither{};
  const Eigen::VectorXd gauss_newton = step();
  for (int k = 0; k < 3; ++k) model.choose_hessian(damped);
  model.choose_hessian(neither);  // not consecutive
  for (int k = 0; k < 3; ++k) model.choose_hessian(damped);
  EXPECT_EQ(step(), gauss_newton);
  model.choose_hessian(damped);
  EXPECT_GT((step() - gauss_newton).norm(), 0.1);
  for (int k = 0; k < 4; ++k) model.choose_hessian(undamped);
  EXPECT_EQ(step(), gauss_newton);
}

TEST(AugmentedLagrangian, ConvergesWithoutInitialDamping) {
  for (const double damping : {0.0, 1e-12}) {
    TrackingProblem tracking = make_tracking_problem(noisy(6.0).data(), kConstrained);
    AugmentedLagrangianOptions options;
    options.initial_damping = damping;
    const Summary s = solve(tracking.problem, options);
    EXPECT_TRUE(s.converged()) << s.message;
    EXPECT_LE(s.iterations, 50);
  }
}

/// At the solution, multipliers of the active rows cancel the gradient of the cost and have the right signs.
TEST(AugmentedLagrangian, SatisfiesTheOptimalityConditions) {
  TrackingProblem tracking = make_tracking_problem(noisy(6.0).data(), kConstrained);
  const Summary s = solve(tracking.problem, AugmentedLagrangianOptions{});
  ASSERT_TRUE(s.converged()) << s.message;
  NlpEvaluator nlp(tracking.problem);
  Eigen::VectorXd g(nlp.num_unknowns()), c(nlp.num_rows()), values(nlp.jacobian_pattern().row.size());
  nlp.gradient(g);
  nlp.linearize_constraints(c, values);
  ASSERT_LE(nlp.violation(c).size, 1e-8);
  std::vector<int> at_bound(std::size_t(c.size()), -1);
  std::vector<int> rows;
  int lower = 0, upper = 0, slack = 0;
  for (int i = 0; i < c.size(); ++i) {
    const bool low = c[i] - nlp.lower()[i] <= 1e-7, high = nlp.upper()[i] - c[i] <= 1e-7;
    lower += low && !high;
    upper += high && !low;
    slack += !low && !high;
    if (!low && !high) continue;
    at_bound[std::size_t(i)] = static_cast<int>(rows.size());
    rows.push_back(i);
  }
  EXPECT_GT(lower + upper, 0);
  EXPECT_GT(slack, 0);
  Eigen::MatrixXd JT = Eigen::MatrixXd::Zero(g.size(), Eigen::Index(rows.size()));
  for (std::size_t k = 0; k < nlp.jacobian_pattern().row.size(); ++k)
    if (const int column = at_bound[std::size_t(nlp.jacobian_pattern().row[k])]; column >= 0)
      JT(nlp.jacobian_pattern().column[k], column) += values[Eigen::Index(k)];
  const Eigen::VectorXd y = JT.colPivHouseholderQr().solve(-g);
  EXPECT_LE((g + JT * y).norm(), 1e-4 * g.norm());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const int i = rows[k];
    if (nlp.lower()[i] == nlp.upper()[i]) continue;
    const double sign = nlp.upper()[i] - c[i] <= 1e-7 ? 1.0 : -1.0;
    EXPECT_GE(sign * y[Eigen::Index(k)], -1e-4 * y.norm()) << nlp.describe_row(i);
  }
}

TEST(AugmentedLagrangian, IsDeterministic) {
  std::vector<Summary> summaries;
  std::vector<Eigen::MatrixXd> last;
  for (int run = 0; run < 2; ++run) {
    TrackingProblem tracking = make_tracking_problem(noisy(6.0).data(), kConstrained);
    summaries.push_back(solve(tracking.problem, AugmentedLagrangianOptions{}));
    last.push_back(tracking.problem.value(pose(tracking.target.back())).matrix());
  }
  EXPECT_EQ(summaries[0].cost, summaries[1].cost);
  EXPECT_EQ(summaries[0].iterations, summaries[1].iterations);
  EXPECT_EQ(last[0], last[1]);
}

/// SquaredNorm in units of 1e-3.
struct ScaledSquaredNorm {
  static constexpr std::string_view name = "scaled squared norm";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  void operator()(const R3& p, Vector<1>& r, Matrix<1, 3>* J = nullptr) const {
    SquaredNorm()(p, r, J);
    r *= 1e3;
    if (J) *J *= 1e3;
  }
};

TEST(AugmentedLagrangian, IteratesDoNotDependOnUnits) {
  std::vector<double> costs[2];
  for (const bool milli : {false, true}) {
    Problem problem;
    const auto x = problem.add(R3({1.0, 1.0, 1.0}));
    problem.minimize(Prior<R3>{R3({2.0, -1.0, 2.0})}, Gaussian{1.0, 1.0, 1.0}, {x});
    if (milli) problem.subject_to(ScaledSquaredNorm{}, equal_to(4e3), {x});
    if (!milli) problem.subject_to(SquaredNorm{}, equal_to(4.0), {x});
    solve(problem, with_progress([&](const Progress& p) { costs[milli].push_back(p.cost); }));
  }
  const std::size_t common = std::min(costs[0].size(), costs[1].size());
  EXPECT_GE(common, 4u);
  for (std::size_t k = 0; k < common; ++k) EXPECT_NEAR(costs[0][k], costs[1][k], 1e-9) << k;
}

TEST(AugmentedLagrangian, NamesTheInfeasibleBlock) {
  TrackingProblem tracking = make_tracking_problem(noisy(6.0).data(), {.non_holonomic = Role::hard});
  const auto from = pose(tracking.target[3]), to = pose(tracking.target[4]);
  using Surge = TwistComponents<SE3, surge>;
  tracking.problem.subject_to(Surge{1.0}, at_least(2.0), {from, to});
  tracking.problem.subject_to(Surge{1.0}, at_most(1.0), {from, to});
  const Summary s = solve(tracking.problem, AugmentedLagrangianOptions{});
  EXPECT_EQ(s.status, Status::infeasible) << s.message;
  EXPECT_THAT(s.message, HasSubstr("twist components of target 3, target 4"));
  EXPECT_EQ(s.worst_constraint, "twist components of target 3, target 4");
  EXPECT_NEAR(s.max_violation, 0.5, 0.05);
  EXPECT_LE(s.iterations, 100);
}

/// From a feasible initial guess, the result is feasible and does not cost more, for every cause that ends the solve.
TEST(AugmentedLagrangian, KeepsTheBestFeasiblePoint) {
  double first = 0;
  for (int most = 0; most < 12; ++most) {
    Problem problem;
    const auto x = problem.add(R3({0.0, 0.0, 2.0}));
    problem.minimize(Prior<R3>{R3({2.0, -1.0, 2.0})}, Gaussian{1.0, 1.0, 1.0}, {x});
    problem.subject_to(SquaredNorm{}, equal_to(4.0), {x});
    AugmentedLagrangianOptions options;
    options.max_iterations = most;
    const Summary s = solve(problem, options);
    if (most == 0) first = s.cost;
    EXPECT_LE(s.max_violation, 1e-8) << most;
    EXPECT_LE(s.cost, first) << most;
    EXPECT_EQ(s.cost, cost_of(problem));
    EXPECT_TRUE(s.converged() || s.status == Status::max_iterations) << s.message;
  }
}

TEST(AugmentedLagrangian, IteratesWithoutAllocating) {
  TrackingProblem tracking = make_tracking_problem(noisy(6.0).data(), kConstrained);
  std::array<long, 100> counts;
  std::size_t reports = 0;
  AugmentedLagrangianOptions options = with_progress([&](const Progress&) { counts[reports++] = allocations; });
  options.max_iterations = int(counts.size()) - 1;
  EXPECT_TRUE(solve(tracking.problem, options).converged());
  ASSERT_GE(reports, 4u);
  for (std::size_t k = 1; k < reports; ++k) EXPECT_EQ(counts[k] - counts[k - 1], 0) << k;
}

class ShrinkingSigma : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Constraints, ShrinkingSigma, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "NonHolonomic" : "RollPitch"; });

/// If a soft residual has ever smaller σ, the solution converges to that of the hard constraint as σ².
TEST_P(ShrinkingSigma, ConvergesToTheHardSolution) {
  const bool non_holonomic = GetParam();
  TrackingData data = noisy(6.0).data();
  const auto solution = [&](Role role) {
    TrackingOptions options;
    (non_holonomic ? options.non_holonomic : options.roll_pitch) = role;
    TrackingProblem tracking = make_tracking_problem(data, options);
    AugmentedLagrangianOptions exact;
    exact.cost_tolerance = 1e-14;
    const Summary s = solve(tracking.problem, exact);
    EXPECT_TRUE(s.converged()) << s.message;
    std::vector<SE3> target;
    for (const auto& x : tracking.target) target.push_back(tracking.problem.value(pose(x)));
    return target;
  };
  const std::vector<SE3> hard = solution(Role::hard);
  std::vector<double> distances;
  for (const double sigma : {1e-2, 3e-3, 1e-3, 3e-4}) {
    (non_holonomic ? data.noise.non_holonomic : data.noise.roll_pitch) = {sigma, sigma};
    const std::vector<SE3> soft = solution(Role::soft);
    double largest = 0;
    for (std::size_t k = 0; k < hard.size(); ++k)
      largest = std::max(largest, (hard[k].inverse() * soft[k]).Log().norm());
    if (!distances.empty()) {
      EXPECT_LE(largest, 0.2 * distances.back()) << sigma;
    }
    distances.push_back(largest);
  }
  EXPECT_GT(distances.front(), 1e-4) << "the constraint is active";
  EXPECT_LE(distances.back(), 1e-4);
}

}  // namespace
}  // namespace tandem::testing
