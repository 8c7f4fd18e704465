#include <map>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/solvers/marginals.hpp>

#include "cases.hpp"
#include "problem/tracking/simulated_tracking.hpp"
#include "sanitized.hpp"

namespace tandem::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class IpoptTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!ipopt_present()) GTEST_SKIP() << why_unsupported(Problem(), IpoptOptions{});
  }
  Problem problem;
  Variable<R2> x = problem.add(R2({-1.2, 1.0}), "x");
  Block block = problem.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {x});

  Summary with(const std::string& key, const std::string& value) {
    IpoptOptions options;
    options.options[key] = value;
    return solve(problem, options);
  }
};

TEST_F(IpoptTest, SuggestsAKnownOption) {
  EXPECT_THAT([&] { with("mu_stratgy", "adaptive"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("no option 'mu_stratgy'"), HasSubstr("did you mean mu_strategy?"))));
  EXPECT_THAT([&] { with("qqqqqqqqqq", "1"); }, ThrowsMessage<Error>(HasSubstr("no option 'qqqqqqqqqq'")));
  IpoptOptions options;
  options.options["mu_stratgy"] = "adaptive";
  EXPECT_THROW(why_unsupported(problem, options), Error);
}

TEST_F(IpoptTest, RejectsInvalidOptionValues) {
  const std::vector<std::pair<std::string, std::string>> rejected{{"mu_init", "small"}, {"tol", "-1"},
                                                                  {"tol", ""},          {"tol", "nan"},
                                                                  {"max_soc", "1.5"},   {"max_soc", "4294967297"},
                                                                  {"max_soc", "-3"},    {"mu_strategy", "adaptative"}};
  for (const auto& [key, value] : rejected)
    EXPECT_THAT(([this, k = key, v = value] { with(k, v); }), ThrowsMessage<Error>(HasSubstr("ipopt option " + key)));
}

TEST_F(IpoptTest, PassesOptionsToIpopt) {
  EXPECT_TRUE(with("mu_strategy", "adaptive").converged());
  EXPECT_EQ(problem.value(x).vector().norm() > 1.0, true);
  problem.set_value(x, R2({-1.2, 1.0}));
  const Summary s = with("max_iter", "2");
  EXPECT_EQ(s.status, Status::max_iterations) << s.message;
  EXPECT_EQ(s.iterations, 2);
}

TEST_F(IpoptTest, RejectsLinearSolversThatAreNotInstalled) {
  for (const char* name : {"ma27", "ma57", "ma77", "ma86", "ma97", "pardiso", "wsmp"})
    EXPECT_THAT([&] { with("linear_solver", name); },
                ThrowsMessage<Error>(AllOf(HasSubstr("linear_solver"), HasSubstr(name), HasSubstr("mumps"))))
        << name;
  EXPECT_THROW(with("linear_solver", "MA97"), Error);
  EXPECT_THROW(with("nlp_scaling_method", "equilibration-based"), Error);
  for (const char* file : {"output_file", "option_file_name"})
    EXPECT_THROW(with(file, "x"), Error) << "it would write or read a file";
  EXPECT_THROW(with("resto.linear_solver", "ma97"), Error);
  EXPECT_TRUE(with("linear_solver", "mumps").converged());
}

/// Ipopt looks for mc19, a library of others, when it first scales.
TEST_F(IpoptTest, ScalingThatIsNotInstalledFails) {
  IpoptOptions options;
  options.options = {{"linear_system_scaling", "mc19"}, {"linear_scaling_on_demand", "no"}};
  const Summary s = solve(problem, options);
  EXPECT_EQ(s.status, Status::failed) << s.message;
}

TEST_F(IpoptTest, RejectsTwoLinearSolvers) {
  IpoptOptions options;
  options.linear_solver = IpoptLinearSolver::block_cholesky;
  EXPECT_EQ(why_unsupported(problem, options), "");
  options.options["linear_solver"] = "mumps";
  EXPECT_THAT(why_unsupported(problem, options), HasSubstr("given twice"));
  EXPECT_EQ(solve(problem, options).status, Status::unsupported);
}

/// The curvatures of these chains span many decades, which a few steps cannot represent. Small changes of the data
/// change the number of iterations between 66 and 313.
TEST_F(IpoptTest, LimitedMemoryConvergesOnTrackingProblems) {
  for (const double noise : {1.0, 1.0001, 1.0003, 1.0005}) {
    if (kSanitized && noise > 1) break;
    Simulation simulation;
    simulation.duration = kSanitized ? 60.0 : 300.0;
    simulation.noise = noise;
    std::map<Hessian, Summary> summaries;
    for (const auto hessian : {Hessian::gauss_newton, Hessian::limited_memory}) {
      TrackingProblem tracking = make_tracking_problem(simulation.data(), {});
      IpoptOptions options;
      options.hessian = hessian;
      options.max_iterations = 500;
      summaries[hessian] = solve(tracking.problem, options);
      EXPECT_TRUE(summaries[hessian].converged()) << summaries[hessian].message;
    }
    EXPECT_NEAR(summaries[Hessian::limited_memory].cost, summaries[Hessian::gauss_newton].cost,
                1e-8 * summaries[Hessian::gauss_newton].cost);
  }
}

TEST_F(IpoptTest, LimitedMemoryRejectsHardConstraints) {
  IpoptOptions options;
  options.hessian = Hessian::limited_memory;
  problem.subject_to(Prior<R2>{R2()}, at_most(1.0), {x});
  EXPECT_THAT(why_unsupported(problem, options), HasSubstr("limited-memory Hessian takes no hard constraints"));
  EXPECT_EQ(solve(problem, options).status, Status::unsupported);
}

/// Ipopt scales the matrix that the linear solver has analysed; the factorisation must still succeed.
TEST_F(IpoptTest, AcceptsScalingOfTheLinearSystems) {
  EXPECT_TRUE(with("linear_system_scaling", "slack-based").converged());
}

/// Both linear solvers give the same iterates for soft, constrained and nearly degenerate problems.
TEST_F(IpoptTest, LinearSolversAgree) {
  Simulation simulation;
  simulation.duration = 20.0;
  simulation.noise = 1.0;
  const std::map<std::string, TrackingOptions> cases{
      {"soft", {}},
      {"hard", {.non_holonomic = Role::hard, .surge = between(0.0, 2.5), .max_yaw_rate = 0.3}},
      {"limits alone", {.surge = between(0.0, 0.9)}},
      {"roll and pitch", {.roll_pitch = Role::hard}}};
  for (const auto& [name, tracking_options] : cases)
    for (const Hessian hessian : {Hessian::gauss_newton, Hessian::exact}) {
      std::vector<Summary> summaries;
      for (const auto linear_solver : {IpoptLinearSolver::block_cholesky, IpoptLinearSolver::mumps}) {
        TrackingProblem tracking = make_tracking_problem(simulation.data(), tracking_options);
        IpoptOptions options;
        options.hessian = hessian;
        options.linear_solver = linear_solver;
        summaries.push_back(solve(tracking.problem, options));
        EXPECT_TRUE(summaries.back().converged()) << name << ": " << summaries.back().message;
      }
      EXPECT_NEAR(summaries[0].cost, summaries[1].cost, 1e-8 * summaries[1].cost) << name;
      EXPECT_EQ(summaries[0].iterations, summaries[1].iterations) << name;
    }
}

/// With redundant constraints, the solution is unique although the multipliers are not.
TEST_F(IpoptTest, SolvesRedundantConstraints) {
  for (const AnySolver& solver : {ipopt(Hessian::automatic), ipopt_mumps()}) {
    Problem redundant;
    const auto a = redundant.add(R3({1, 2, 3})), b = redundant.add(R3());
    redundant.minimize(Prior<R3>{R3({1, 2, 3})}, Gaussian{1.0, 1.0, 1.0}, {a});
    redundant.minimize(Prior<R3>{R3()}, Gaussian{1.0, 1.0, 1.0}, {b});
    redundant.subject_to(SquaredNorm{}, equal_to(4.0), {a});
    redundant.subject_to(SquaredNorm{}, equal_to(4.0), {a});
    redundant.subject_to(RelativePose<R3>{R3({0, 0, 1})}, equal_to(0.0), {a, b});
    const Summary s = solver(redundant);
    EXPECT_TRUE(s.converged()) << solver << ": " << s.message;
    EXPECT_LE(s.max_violation, 1e-7) << solver;
    EXPECT_NEAR(redundant.value(a).vector().norm(), 2.0, 1e-6) << solver;
  }
}

/// Marginalisation takes inequalities with a multiplier for equalities.
TEST_F(IpoptTest, InactiveInequalitiesHaveNoMultipliers) {
  for (const double scale : {1e-4, 1.0, 1e4}) {
    Problem problem;
    const auto a = problem.add(R3()), b = problem.add(R3());
    problem.minimize(Prior<R3>{R3(Vector<3>(scale * Vector<3>(1, 2, 3)))}, Gaussian{scale, scale, scale}, {a});
    problem.minimize(RelativePose<R3>{}, Gaussian{scale, scale, scale}, {a, b});
    const Block far = problem.subject_to(Prior<R3>{}, between(-50 * scale, 50 * scale), {a});
    const Block near = problem.subject_to(Prior<R3>{}, at_most(2.5 * scale), {a});
    ASSERT_TRUE(solve(problem, IpoptOptions{}).converged());
    EXPECT_TRUE(problem.multipliers(far).isZero(0)) << scale;
    EXPECT_TRUE(problem.multipliers(near).head<2>().isZero(0)) << scale;
    EXPECT_NEAR(problem.multipliers(near)[2] * scale, 0.5, 1e-4) << scale;
    problem.marginalize(a);
    problem.minimize(Prior<R3>{R3(Vector<3>(scale * Vector<3>(1, 2, 3)))}, Gaussian{scale, scale, scale}, {b});
    ASSERT_TRUE(solve(problem, GaussNewtonOptions{}).converged());
    EXPECT_LE((problem.value(b).vector() / scale - Vector<3>(1, 2, 2.75)).norm(), 1e-4) << scale;
  }
}

/// A solve from a callback of another solve has its own linear systems.
TEST_F(IpoptTest, SolvesFromACallback) {
  const auto inner = [] {
    Problem other;
    const auto y = other.add(R2({-1.2, 1.0}));
    other.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {y});
    return solve(other, IpoptOptions{});
  };
  const Summary alone = solve(problem, IpoptOptions{});
  problem.set_value(x, R2({-1.2, 1.0}));
  IpoptOptions options;
  int inner_solved = 0;
  options.progress = [&](const Progress&) { inner_solved += inner().converged(); };
  const Summary s = solve(problem, options);
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_EQ(s.iterations, alone.iterations);
  EXPECT_EQ(s.cost, alone.cost);
  EXPECT_GT(inner_solved, s.iterations - 1);
}

/// Marginals in the callback move the variables of the problem that is being solved. Ipopt must continue from its own
/// point.
TEST_F(IpoptTest, IsUnaffectedByMarginalsInACallback) {
  Simulation simulation;
  simulation.duration = 8.0;
  simulation.noise = 4.0;
  for (const Hessian hessian : {Hessian::exact, Hessian::gauss_newton, Hessian::limited_memory}) {
    const auto solved = [&](bool looks) {
      TrackingProblem tracking = make_tracking_problem(simulation.data(), {.non_holonomic = Role::soft});
      IpoptOptions options;
      options.hessian = hessian;
      int reports = 0;
      if (looks)
        options.progress = [&](const Progress&) {
          const Marginals marginals(tracking.problem);
          EXPECT_GT(marginals.covariance(std::get<Variable<SE3>>(tracking.chaser.back())).trace(), 0.0);
          ++reports;
        };
      const Summary s = solve(tracking.problem, options);
      EXPECT_EQ(reports > 0, looks);
      return s;
    };
    const Summary alone = solved(false), watched = solved(true);
    EXPECT_TRUE(watched.converged()) << watched.message;
    EXPECT_EQ(watched.iterations, alone.iterations);
    EXPECT_EQ(watched.cost, alone.cost);
  }
}

TEST_F(IpoptTest, PrintsNothing) {
  ::testing::internal::CaptureStdout();
  solve(problem, IpoptOptions{});
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
}

/// Block-cholesky solves run in parallel; those of MUMPS run one after the other.
TEST_F(IpoptTest, SolvesInTwoThreads) {
  Simulation simulation;
  simulation.duration = 10.0;
  simulation.noise = 1.0;
  const TrackingOptions constrained{.non_holonomic = Role::hard, .surge = at_least(0.0)};
  const auto cost = [&](const TrackingOptions& options) {
    TrackingProblem tracking = make_tracking_problem(simulation.data(), options);
    const Summary s = solve(tracking.problem, IpoptOptions{});
    return s.converged() ? s.cost : -1.0;
  };
  const double soft = cost({}), hard = cost(constrained);
  EXPECT_GT(soft, 0.0);
  EXPECT_GT(hard, soft);
  std::vector<double> soft_costs(8), hard_costs(8);
  std::thread first([&] {
    for (double& c : soft_costs) c = cost({});
  });
  std::thread second([&] {
    for (double& c : hard_costs) c = cost(constrained);
  });
  first.join();
  second.join();
  EXPECT_THAT(soft_costs, ::testing::Each(soft));
  EXPECT_THAT(hard_costs, ::testing::Each(hard));
}

/// Ipopt itself refuses such programs, even if they are consistent.
TEST_F(IpoptTest, AcceptsMoreEqualitiesThanUnknowns) {
  for (int k = 0; k < 3; ++k) problem.subject_to(Prior<R2>{R2()}, equal_to(1.0), {x});
  for (const auto linear_solver : {IpoptLinearSolver::automatic, IpoptLinearSolver::mumps}) {
    IpoptOptions options;
    options.linear_solver = linear_solver;
    const Summary s = solve(problem, options);
    EXPECT_TRUE(s.converged()) << s.message;
    EXPECT_LE((problem.value(x).vector() - Vector<2>(1.0, 1.0)).norm(), 1e-8);
  }
  problem.subject_to(Prior<R2>{R2()}, equal_to(2.0), {x});
  const Summary s = solve(problem, IpoptOptions{});
  EXPECT_EQ(s.status, Status::infeasible) << s.message;
}

/// With large residuals, the exact Hessian converges quadratically, Gauss-Newton only linearly.
TEST_F(IpoptTest, TheExactHessianSavesIterations) {
  Simulation simulation;
  simulation.duration = 8.0;
  simulation.noise = 4.0;
  std::map<Hessian, Summary> summaries;
  for (const auto hessian : {Hessian::gauss_newton, Hessian::exact}) {
    TrackingProblem tracking = make_tracking_problem(simulation.data(), {.non_holonomic = Role::hard});
    IpoptOptions options;
    options.hessian = hessian;
    summaries[hessian] = solve(tracking.problem, options);
    EXPECT_TRUE(summaries[hessian].converged()) << summaries[hessian].message;
    EXPECT_NEAR(summaries[hessian].cost, summaries[Hessian::gauss_newton].cost, 1e-6 * summaries[hessian].cost);
    EXPECT_LE(summaries[hessian].max_violation, 1e-6);
  }
  EXPECT_LT(summaries[Hessian::exact].iterations, summaries[Hessian::gauss_newton].iterations);
}

/// The solution is 2.8 rad away. Ipopt must be stopped, recentred and restarted.
TEST_F(IpoptTest, RecentresWithHardConstraints) {
  Problem turning;
  std::vector<Variable<SO3>> R;
  for (int k = 0; k < 3; ++k) R.push_back(turning.add(SO3()));
  turning.minimize(Prior<SO3>{SO3()}, Gaussian{1.0, 1.0, 1.0}, {R[0]});
  turning.subject_to(RelativePose<SO3>{SO3::Exp({0.0, 0.3, 1.4})}, equal_to(0.0), {R[0], R[1]});
  turning.subject_to(RelativePose<SO3>{SO3::Exp({0.0, 0.3, 1.4})}, equal_to(0.0), {R[1], R[2]});
  const Summary s = solve(turning, IpoptOptions{});
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_LE(s.max_violation, 1e-7);
  const SO3 expected = SO3::Exp({0.0, 0.6, 2.8});
  EXPECT_LE((expected.inverse() * turning.value(R[2])).Log().norm(), 1e-6);
}

}  // namespace
}  // namespace tandem::testing
