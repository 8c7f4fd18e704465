#include <gmock/gmock.h>

#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/solvers/marginals.hpp>

#include "cases.hpp"
#include "problem/tracking/simulated_tracking.hpp"

/// Tests of requirements on every solver.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;

const Gaussian kUnit1{1.0};
const Gaussian kUnit3{1.0, 1.0, 1.0};
const Gaussian kUnit6{1.0, 1.0, 1.0, 1.0, 1.0, 1.0};

struct CustomException {};

/// Throws an exception other than Error when the counter `left` reaches zero.
struct ThrowingResidual {
  static constexpr std::string_view name = "throwing residual";
  static constexpr int dim = 2;
  using States = std::tuple<R2>;
  int* left;
  void operator()(const R2& x, Vector<2>& r, Matrix<2, 2>* J = nullptr) const {
    if (--*left == 0) throw CustomException();
    Rosenbrock()(x, r, J);
  }
};

class EverySolver : public ::testing::TestWithParam<AnySolver> {
 protected:
  const AnySolver& solver() const { return GetParam(); }
};
INSTANTIATE_TEST_SUITE_P(Solvers, EverySolver, ::testing::ValuesIn(main_solvers()), name_of);

TEST_P(EverySolver, MinimisesRosenbrocksFunction) {
  Problem problem;
  const auto x = problem.add(R2({-1.2, 1.0}));
  problem.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {x});
  const Summary s = solver()(problem);
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_DOUBLE_EQ(s.initial_cost, 0.5 * (19.36 + 4.84));
  EXPECT_LE((problem.value(x).vector() - Vector<2>(1.0, 1.0)).norm(), 1e-6);
  EXPECT_EQ(s.cost, cost_of(problem));
  EXPECT_EQ(s.max_violation, 0.0);
  EXPECT_EQ(s.worst_constraint, "");
  EXPECT_GT(s.iterations, 0);
  EXPECT_GT(s.evaluations, 0);
  EXPECT_GT(s.seconds, 0.0);
}

TEST_P(EverySolver, FindsTheMeanOfRotations) {
  Problem problem;
  const SO3 mean = SO3::Exp({0.5, -0.8, 0.3});
  const auto R = problem.add(SO3::Exp({-0.2, 0.4, 0.9}));
  double cost = 0;
  for (const Vector<3>& v : {Vector<3>(0.4, 0.0, 0.1), Vector<3>(-0.2, 0.3, 0.2), Vector<3>(0.0, 0.1, -0.6)}) {
    for (const double side : {1.0, -1.0}) problem.minimize(Prior<SO3>{mean * SO3::Exp(side * v)}, kUnit3, {R});
    cost += v.squaredNorm();
  }
  const Summary s = solver()(problem);
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_NEAR(s.cost, cost, 1e-9 * cost);
  // The cost is flat at the optimum, so its tolerance of 1e-10 leaves an angle of the order of the root.
  EXPECT_LE((mean.inverse() * problem.value(R)).Log().norm(), 2e-5);
}

/// The solution is up to 6 rad from the initial guess, so charts must be recentred.
TEST_P(EverySolver, ConvergesBeyondOneChart) {
  Problem problem;
  std::vector<Variable<SE3>> x;
  const SE3 step = SE3::Exp((Vector<6>() << 1.0, 0.2, -0.1, 0.3, -0.4, 1.4).finished());
  SE3 truth;
  for (int k = 0; k <= 4; ++k) {
    x.push_back(problem.add(SE3()));
    if (k > 0) problem.minimize(RelativePose<SE3>{step}, kUnit6, {x[std::size_t(k - 1)], x[std::size_t(k)]});
  }
  problem.minimize(Prior<SE3>{SE3()}, kUnit6, {x[0]});
  const Summary s = solver()(problem);
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_LE(s.cost, 1e-9);
  for (const auto& variable : x) {
    EXPECT_LE((truth.inverse() * problem.value(variable)).Log().norm(), 1e-4);
    truth = truth * step;
  }
}

TEST_P(EverySolver, RecoversTheTruthOfANoiselessTrackingProblem) {
  Simulation simulation;
  simulation.duration = 8.0;
  simulation.usbl_mount = SE3::Exp((Vector<6>() << 0.5, -0.2, 0.3, 0.4, 0.1, -0.9).finished());
  simulation.optical_mount = SE3::Exp((Vector<6>() << 1.2, 0.1, -0.4, -0.3, 0.5, 0.2).finished());
  simulation.marker = SE3::Exp((Vector<6>() << -0.8, 0.3, 0.2, 0.1, -0.2, 2.5).finished());
  simulation.beacon = {0.4, -0.1, 0.6};
  TrackingProblem tracking = make_tracking_problem(simulation.data());
  const Summary s = solver()(tracking.problem);
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_LE(s.cost, 1e-6);
  for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
    const SE3 truth = Simulation::target(tracking.keyframes[k].t);
    EXPECT_LE((truth.inverse() * tracking.problem.value(pose(tracking.target[k]))).Log().norm(), 1e-3);
  }
}

TEST_P(EverySolver, StopsAtTheIterationLimit) {
  Problem problem;
  const auto x = problem.add(R2({-1.2, 1.0}));
  problem.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {x});
  const Summary s = solver()(problem, {.max_iterations = 3});
  EXPECT_EQ(s.status, Status::max_iterations) << s.message;
  EXPECT_FALSE(s.converged());
  EXPECT_LE(s.iterations, 3);
  EXPECT_LE(s.cost, s.initial_cost);
  EXPECT_EQ(s.cost, cost_of(problem));
}

TEST_P(EverySolver, StopsAtTheTimeLimit) {
  Problem problem;
  const auto x = problem.add(R2({-1.2, 1.0}));
  problem.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {x});
  const Summary s = solver()(problem, {.time_limit = 0.0});
  EXPECT_EQ(s.status, Status::time_limit) << s.message;
  EXPECT_LE(s.cost, s.initial_cost);
  EXPECT_EQ(s.cost, cost_of(problem));
}

TEST_P(EverySolver, KeepsTheBestPointWhenInterrupted) {
  Problem problem;
  const auto x = problem.add(R2({-1.2, 1.0}));
  problem.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {x});
  std::atomic<bool> stop = false;
  double least = HUGE_VAL;
  int reports = 0;
  const Summary s = solver()(problem, {.stop = &stop, .progress = [&](const Progress& p) {
                                         least = std::min(least, p.cost);
                                         if (++reports == 6) stop = true;
                                       }});
  EXPECT_EQ(s.status, Status::interrupted) << s.message;
  EXPECT_EQ(s.message, sentence(Status::interrupted));
  EXPECT_EQ(reports, 6);
  EXPECT_LT(least, s.initial_cost);
  EXPECT_NEAR(s.cost, least, 1e-12 * least);
  EXPECT_EQ(s.cost, cost_of(problem));
}

TEST_P(EverySolver, PropagatesExceptionsOfResiduals) {
  for (const int evaluations : {1, 2, 3, 6, 9}) {
    Problem problem;
    int left = evaluations;
    const auto x = problem.add(R2({-1.2, 1.0}));
    problem.minimize(ThrowingResidual{&left}, Gaussian{1.0, 1.0}, {x});
    EXPECT_THROW(solver()(problem), CustomException) << evaluations;
    EXPECT_TRUE(solver()(problem).converged()) << "the problem is unchanged";
  }
}

TEST_P(EverySolver, PropagatesExceptionsOfTheProgressCallback) {
  Problem problem;
  const auto x = problem.add(R2({-1.2, 1.0}));
  problem.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {x});
  EXPECT_THROW(solver()(problem, {.progress = [](const Progress&) { throw std::logic_error("mine"); }}),
               std::logic_error);
  // An Error of a residual means that it is undefined; an Error of the callback must propagate.
  EXPECT_THROW(solver()(problem, {.progress = [](const Progress&) { throw Error("mine"); }}), Error);
  EXPECT_TRUE(solver()(problem).converged()) << "the problem is unchanged";
}

/// The callback must not change the problem; if it does, every solver throws Error.
TEST_P(EverySolver, RejectsChangesOfTheProblemInTheProgressCallback) {
  using Change = std::function<void(Problem&, Variable<R2>)>;
  const Change add_variable = [](Problem& problem, Variable<R2>) { problem.add(R2({0, 0})); };
  const Change add_block = [](Problem& problem, Variable<R2> x) {
    problem.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {x});
  };
  const Change fix_variable = [](Problem& problem, Variable<R2> x) { problem.fix(x); };
  for (const Change& change : {add_variable, add_block, fix_variable})
    for (const bool throws : {false, true}) {
      Problem problem;
      const auto x = problem.add(R2({-1.2, 1.0}));
      problem.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {x});
      const auto progress = [&](const Progress&) {
        change(problem, x);
        if (throws) throw Error("mine");
      };
      EXPECT_THROW(solver()(problem, {.progress = progress}), Error) << throws;
    }
}

TEST_P(EverySolver, SetsTheVariablesToTheIterateForTheProgressCallback) {
  Problem problem;
  const auto x = problem.add(R2({-1.2, 1.0}));
  problem.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {x});
  std::vector<double> costs;
  const Summary reporting = solver()(problem, {.progress = [&](const Progress& p) {
                                       Vector<2> r;
                                       Rosenbrock{}(problem.value(x), r);
                                       EXPECT_NEAR(0.5 * r.squaredNorm(), p.cost, 1e-12 * (1 + p.cost)) << p.iteration;
                                       costs.push_back(p.cost);
                                     }});
  EXPECT_GE(costs.size(), 3u);
  Problem silent;
  const auto y = silent.add(R2({-1.2, 1.0}));
  silent.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {y});
  const Summary other = solver()(silent);
  EXPECT_EQ(reporting.cost, other.cost) << "the callback has no effect on the solve";
  EXPECT_EQ(reporting.evaluations, other.evaluations);
}

TEST_P(EverySolver, IsUnaffectedByMarginalsInTheProgressCallback) {
  const auto solved = [&](bool looks) {
    Problem problem;
    const auto x = problem.add(R2({-1.2, 1.0}));
    problem.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {x});
    return solver()(problem, {.progress = [&](const Progress&) {
                      if (looks) EXPECT_GT(Marginals(problem).covariance(x).trace(), 0.0);
                    }});
  };
  const Summary alone = solved(false), watched = solved(true);
  EXPECT_TRUE(watched.converged()) << watched.message;
  EXPECT_EQ(watched.iterations, alone.iterations);
  EXPECT_EQ(watched.cost, alone.cost);
}

/// A full Gauss-Newton step from 10 leads to −36.
TEST_P(EverySolver, ShortensStepsToUndefinedResiduals) {
  Problem problem;
  const auto x = problem.add(R1(Vector<1>(10.0)));
  problem.minimize(Logarithm{0.1}, kUnit1, {x});
  const Summary s = solver()(problem);
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_NEAR(problem.value(x).vector()[0], 0.1, 1e-6);
}

/// A full step leads to a point where the cost is NaN.
TEST_P(EverySolver, ShortensStepsToNonfiniteCosts) {
  Problem problem;
  const auto x = problem.add(R1(Vector<1>(10.0)));
  problem.minimize(Logarithm{100.0}, kUnit1, {x});
  problem.minimize(Wall{30.0}, Gaussian{1e3}, {x});
  const Summary s = solver()(problem);
  EXPECT_LT(s.cost, s.initial_cost);
  EXPECT_TRUE(std::isfinite(problem.value(x).vector()[0]));
  EXPECT_EQ(s.cost, cost_of(problem));
}

TEST_P(EverySolver, NamesABlockThatIsNotFiniteAtTheInitialGuess) {
  Problem problem;
  const auto x = problem.add(R1(Vector<1>(10.0)), "x"), y = problem.add(R1(Vector<1>(3.0)), "y");
  problem.minimize(Prior<R1>{R1()}, kUnit1, {x});
  problem.minimize(Wall{5.0}, kUnit1, {y});
  problem.minimize(Wall{5.0}, kUnit1, {x});
  const Summary s = solver()(problem);
  EXPECT_EQ(s.status, Status::failed);
  EXPECT_THAT(s.message, HasSubstr("wall of x"));
  EXPECT_FALSE(std::isfinite(s.cost)) << "the cost is unknown";
}

TEST_P(EverySolver, ReportsAResidualThatIsUndefinedAtTheInitialGuess) {
  Problem problem;
  const auto x = problem.add(R1(Vector<1>(-1.0)), "x");
  problem.minimize(Logarithm{1.0}, kUnit1, {x});
  const Summary s = solver()(problem);
  EXPECT_EQ(s.status, Status::failed);
  EXPECT_THAT(s.message, HasSubstr("undefined where x is not positive"));
  EXPECT_FALSE(std::isfinite(s.cost)) << "the cost is unknown";
  EXPECT_EQ(problem.value(x).vector()[0], -1.0);
}

TEST_P(EverySolver, NamesAVariableThatNoResidualReads) {
  Problem problem;
  const auto x = problem.add(R2(), "x");
  problem.add(SE3(), "idle");
  problem.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {x});
  const Summary s = solver()(problem);
  EXPECT_EQ(s.status, Status::converged) << s.message;
  EXPECT_THAT(describe(s.unobservable),
              HasSubstr("idle in x, y, z, rotation about x, rotation about y, rotation about z"));
  EXPECT_LE((problem.value(x).vector() - Vector<2>(1.0, 1.0)).norm(), 1e-6) << "the other variables are solved";
}

TEST_P(EverySolver, NamesARotationThatPositionsDoNotObserve) {
  Problem problem;
  const auto chaser = problem.add(SE3(), "chaser"), target = problem.add(SE3(), "target");
  problem.minimize(Prior<SE3>{SE3()}, kUnit6, {chaser});
  problem.minimize(UsblPosition<SE3>{{1.0, 2.0, 3.0}}, kUnit3, {chaser, target});
  const Summary s = solver()(problem);
  EXPECT_EQ(s.status, Status::converged) << s.message;
  EXPECT_THAT(describe(s.unobservable), HasSubstr("target in rotation about x, rotation about y, rotation about z ("));
}

TEST_P(EverySolver, NamesAChainWithoutAnAbsolutePose) {
  Problem problem;
  std::vector<Variable<SE3>> x;
  const SE3 step = SE3::Exp((Vector<6>() << 1.0, 0.2, -0.1, 0.1, -0.1, 0.2).finished());
  for (int k = 0; k < 6; ++k) {
    x.push_back(problem.add(SE3(), "x" + std::to_string(k)));
    if (k > 0) problem.minimize(RelativePose<SE3>{step}, kUnit6, {x[std::size_t(k - 1)], x[std::size_t(k)]});
  }
  const Summary s = solver()(problem);
  EXPECT_EQ(s.status, Status::converged) << s.message;
  EXPECT_EQ(s.unobservable.size(), 6u);
  EXPECT_THAT(describe(s.unobservable), ::testing::StartsWith("x"));
  EXPECT_THAT(describe(s.unobservable), HasSubstr("and 3 more variables"));
}

TEST_P(EverySolver, IsDeterministic) {
  Simulation simulation;
  simulation.duration = 6.0;
  simulation.noise = 1.0;
  std::vector<Summary> summaries;
  std::vector<Eigen::MatrixXd> values;
  for (int run = 0; run < 2; ++run) {
    TrackingProblem tracking = make_tracking_problem(simulation.data(), {.loss = Cauchy(2.0)});
    summaries.push_back(solver()(tracking.problem));
    for (const auto& x : tracking.target) values.push_back(tracking.problem.value(pose(x)).matrix());
  }
  EXPECT_EQ(summaries[0].cost, summaries[1].cost);
  EXPECT_EQ(summaries[0].iterations, summaries[1].iterations);
  EXPECT_EQ(summaries[0].evaluations, summaries[1].evaluations);
  for (std::size_t k = 0; k < values.size() / 2; ++k) EXPECT_EQ(values[k], values[k + values.size() / 2]);
}

TEST_P(EverySolver, DoesNotChangeFixedVariables) {
  Problem problem;
  const SE3 held = SE3::Exp((Vector<6>() << 1.0, 2.0, 3.0, 0.4, 0.5, 0.6).finished());
  const auto x = problem.add(held), y = problem.add(SE3());
  problem.minimize(Prior<SE3>{SE3()}, kUnit6, {x});
  problem.minimize(RelativePose<SE3>{held}, kUnit6, {x, y});
  problem.fix(x);
  const Summary s = solver()(problem);
  EXPECT_TRUE(s.converged()) << s.message;
  EXPECT_TRUE(problem.value(x).matrix() == held.matrix());
  EXPECT_LE(((held * held).inverse() * problem.value(y)).Log().norm(), 1e-5);
}

TEST(Statuses, HaveUniqueNamesAndSentences) {
  std::vector<std::string> seen;
  for (const Status status : {Status::converged, Status::max_iterations, Status::time_limit, Status::interrupted,
                              Status::infeasible, Status::unsupported, Status::failed}) {
    for (const std::string_view text : {name(status), sentence(status)}) {
      EXPECT_FALSE(text.empty());
      EXPECT_THAT(seen, ::testing::Not(::testing::Contains(std::string(text))));
      seen.emplace_back(text);
    }
  }
}

}  // namespace
}  // namespace tandem::testing
