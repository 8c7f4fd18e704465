#include <cmath>
#include <limits>
#include <stdexcept>

#include <gmock/gmock.h>

#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>

#include "cases.hpp"

/// Tests that the status "converged" occurs only at a minimum.
namespace tandem::testing {
namespace {

using ::testing::HasSubstr;

/// Residual x − 3 with a Jacobian of the wrong sign: no step lowers the cost.
struct WrongSign {
  static constexpr std::string_view name = "wrong sign";
  static constexpr int dim = 1;
  using States = std::tuple<R1>;

  void operator()(const R1& x, Vector<1>& r, Matrix<1, 1>* J = nullptr) const {
    r[0] = x.vector()[0] - 3.0;
    if (J) (*J)(0, 0) = -1.0;
  }
};

/// Distance to the origin minus 1, whose Jacobian is 0/0 at the origin.
struct Distance {
  static constexpr std::string_view name = "distance";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;

  void operator()(const R3& x, Vector<1>& r, Matrix<1, 3>* J = nullptr) const {
    r[0] = x.vector().norm() - 1.0;
    if (J) *J = x.vector().transpose() / x.vector().norm();
  }
};

/// Residual x − 3, whose derivative is undefined for x > `at`.
struct Ledge {
  static constexpr std::string_view name = "ledge";
  static constexpr int dim = 1;
  using States = std::tuple<R1>;
  double at;

  void operator()(const R1& x, Vector<1>& r, Matrix<1, 1>* J = nullptr) const {
    r[0] = x.vector()[0] - 3.0;
    if (J && x.vector()[0] > at) throw Error("ledge: undefined derivative");
    if (J) (*J)(0, 0) = 1.0;
  }
};

class CorrectStatus : public ::testing::TestWithParam<AnySolver> {};

TEST_P(CorrectStatus, DoesNotConvergeWithAWrongJacobian) {
  Problem problem;
  const auto x = problem.add(R1(), "x");
  problem.minimize(WrongSign{}, Gaussian{0.1}, {x});
  const Summary s = GetParam()(problem);
  EXPECT_NE(s.status, Status::converged) << s.message;
  EXPECT_LE(s.cost, s.initial_cost);
}

TEST_P(CorrectStatus, NamesAJacobianThatIsNotFinite) {
  Problem problem;
  const auto x = problem.add(R3(), "beacon");
  problem.minimize(Distance{}, Gaussian{1.0}, {x});
  const Summary s = GetParam()(problem);
  EXPECT_EQ(s.status, Status::failed) << s.message;
  EXPECT_THAT(s.message, HasSubstr("distance of beacon"));
}

TEST_P(CorrectStatus, ConvergesOnALongChainWithALoosePrior) {
  Problem problem;
  std::vector<Variable<SE3>> poses;
  for (int k = 0; k < 45; ++k) poses.push_back(problem.add(SE3(), "pose " + std::to_string(k)));
  problem.minimize(Prior<SE3>{SE3()}, Gaussian(Eigen::VectorXd::Constant(6, 1000.0)), {poses[0]});
  for (std::size_t k = 1; k < poses.size(); ++k)
    problem.minimize(RelativePose<SE3>{SE3()}, Gaussian(Eigen::VectorXd::Constant(6, 1e-4)), {poses[k - 1], poses[k]});
  const Summary s = GetParam()(problem);
  EXPECT_EQ(s.status, Status::converged) << s.message;
}

TEST_P(CorrectStatus, RejectsAProblemWithoutFreeVariables) {
  Problem problem;
  const auto x = problem.add(R1());
  problem.minimize(Prior<R1>{R1()}, Gaussian{1.0}, {x});
  problem.fix(x);
  const Summary s = GetParam()(problem);
  EXPECT_EQ(s.status, Status::unsupported);
  EXPECT_THAT(s.message, HasSubstr("no free variable"));
  EXPECT_TRUE(std::isnan(s.max_violation) && std::isnan(s.cost)) << "not computed";
  Problem empty;
  EXPECT_EQ(GetParam()(empty).status, Status::unsupported);
}

TEST_P(CorrectStatus, NamesAViolatedConstraintOnFixedVariablesOnly) {
  if (!GetParam().hard) return;  // rejects all constraints
  Problem problem;
  const auto x = problem.add(R1(), "x");
  problem.subject_to(Prior<R1>{R1()}, at_least(2.0), {x});
  problem.fix(x);
  const Summary s = GetParam()(problem);
  EXPECT_EQ(s.status, Status::unsupported);
  EXPECT_THAT(s.message, HasSubstr("no free variable, and a hard constraint is violated: prior of x"));
}

/// Undefined derivatives must end a solve with a status, not with an exception.
TEST_P(CorrectStatus, FailsWithAStatusIfADerivativeIsUndefined) {
  Problem problem;
  const auto x = problem.add(R1(), "x");
  problem.minimize(Ledge{1.0}, Gaussian{1.0}, {x});
  const Summary s = GetParam()(problem);
  EXPECT_NE(s.status, Status::converged) << s.message;
  EXPECT_LE(s.cost, s.initial_cost);
  EXPECT_EQ(s.cost, cost_of(problem));
}

class CorrectHardStatus : public CorrectStatus {};

TEST_P(CorrectHardStatus, FailsWithAStatusIfADerivativeOfAConstraintIsUndefined) {
  for (const double start : {0.0, 2.0}) {
    Problem problem;
    const auto x = problem.add(R1(Vector<1>(start)), "x");
    problem.minimize(Prior<R1>{R1()}, Gaussian{1.0}, {x});
    problem.subject_to(Ledge{1.0}, equal_to(0), {x});
    const Summary s = GetParam()(problem);
    EXPECT_NE(s.status, Status::converged) << s.message;
    EXPECT_FALSE(s.message.empty());
  }
}

TEST_P(CorrectHardStatus, InactiveInequalitiesAreNotInformation) {
  Problem problem;
  const auto x = problem.add(R1(), "x"), y = problem.add(R1(), "y");
  problem.minimize(Prior<R1>{R1()}, Gaussian{1.0}, {y});
  problem.subject_to(Prior<R1>{R1()}, between(-5, 5), {x});
  const Summary s = GetParam()(problem);
  EXPECT_EQ(s.status, Status::converged) << s.message;
  EXPECT_THAT(describe(s.unobservable), HasSubstr("x in x"));
}

TEST_P(CorrectHardStatus, ChecksConstraintsOnFixedVariables) {
  for (const double at : {0.0, 1.0}) {
    Problem problem;
    const auto held = problem.add(R3(Vector<3>::Constant(at)), "held");
    const auto x = problem.add(R1(), "x");
    problem.fix(held);
    problem.subject_to(Prior<R3>{R3()}, equal_to(0), {held});
    problem.minimize(Prior<R1>{R1(Vector<1>(2.0))}, Gaussian{1.0}, {x});
    const Summary s = GetParam()(problem);
    if (at == 0.0) {
      EXPECT_EQ(s.status, Status::converged) << s.message;
      EXPECT_NEAR(problem.value(x).vector()[0], 2.0, 1e-6);
    } else {
      EXPECT_EQ(s.status, Status::infeasible) << s.message;
      EXPECT_THAT(s.message, HasSubstr("prior of held"));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Solvers, CorrectStatus, ::testing::ValuesIn(main_solvers()), name_of);
INSTANTIATE_TEST_SUITE_P(Solvers, CorrectHardStatus, ::testing::ValuesIn(hard_solvers()), name_of);

}  // namespace
}  // namespace tandem::testing
