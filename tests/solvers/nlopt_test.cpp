#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cases.hpp"

namespace tandem::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class NloptTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!nlopt_present()) GTEST_SKIP() << why_unsupported(Problem(), NloptOptions{});
  }
  Problem problem;
  Variable<R2> x = problem.add(R2({-1.2, 1.0}), "x");
  Block block = problem.minimize(Rosenbrock{}, Gaussian{1.0, 1.0}, {x});

  static NloptOptions options(const std::string& algorithm) {
    NloptOptions o;
    o.algorithm = algorithm;
    return o;
  }
  std::string why(const std::string& algorithm) const { return why_unsupported(problem, options(algorithm)); }
};

TEST_F(NloptTest, SuggestsAKnownAlgorithm) {
  EXPECT_THAT([&] { solve(problem, options("slqsp")); },
              ThrowsMessage<Error>(AllOf(HasSubstr("no algorithm 'slqsp'"), HasSubstr("did you mean slsqp?"))));
  EXPECT_THAT([&] { why("auglag_lbfgs"); }, ThrowsMessage<Error>(HasSubstr("did you mean auglag-lbfgs?")));
}

TEST_F(NloptTest, AlgorithmsSolveRosenbrock) {
  for (const std::string& algorithm : nlopt_algorithms())
    for (const bool precondition : {true, false}) {
      problem.set_value(x, R2({-1.2, 1.0}));
      NloptOptions o = options(algorithm);
      o.precondition = precondition;
      const Summary s = solve(problem, o);
      SCOPED_TRACE(algorithm + (precondition ? ", preconditioned" : ""));
      // Algorithms with separable models converge slowly along a curved valley, and may stop early with another status.
      if ((algorithm == "mma" || algorithm == "ccsaq") && !s.converged()) continue;
      EXPECT_TRUE(s.converged()) << s.message;
      EXPECT_EQ(s.solver, "nlopt:" + algorithm);
      EXPECT_LE((problem.value(x).vector() - Vector<2>(1.0, 1.0)).norm(), 1e-3) << s.cost;
    }
}

TEST_F(NloptTest, RejectsUnsupportedConstraints) {
  problem.subject_to(Prior<R2>{R2()}, at_most(0.5), {x});
  for (const char* algorithm : {"lbfgs", "tnewton", "var1", "var2"})
    EXPECT_THAT(why(algorithm), AllOf(HasSubstr(std::string("nlopt:") + algorithm + " takes no hard inequalities"),
                                      HasSubstr("nlopt:slsqp")));
  for (const char* algorithm : {"mma", "ccsaq", "slsqp", "auglag-lbfgs"}) EXPECT_EQ(why(algorithm), "");
  problem.subject_to(Prior<R2>{R2()}, equal_to(0.5), {x});
  for (const char* algorithm : {"lbfgs", "mma", "ccsaq"})
    EXPECT_THAT(why(algorithm), HasSubstr("takes no hard equalities"));
  for (const char* algorithm : {"slsqp", "auglag-lbfgs", "auglag-tnewton"}) EXPECT_EQ(why(algorithm), "");
  const Summary s = solve(problem, options("lbfgs"));
  EXPECT_EQ(s.status, Status::unsupported);
  EXPECT_EQ(s.message, why("lbfgs"));
}

TEST_F(NloptTest, MmaAndCcsaqSupportInequalities) {
  for (const char* algorithm : {"mma", "ccsaq"}) {
    Problem bounded;
    const auto p = bounded.add(R3({0.1, 0.2, 0.3}));
    bounded.minimize(Prior<R3>{R3({2.0, -1.0, 2.0})}, Gaussian{1.0, 1.0, 1.0}, {p});
    bounded.subject_to(SquaredNorm{}, at_most(4.0), {p});
    const Summary s = solve(bounded, options(algorithm));
    EXPECT_TRUE(s.converged()) << algorithm << ": " << s.message;
    EXPECT_NEAR(s.cost, 0.5, 1e-6) << algorithm;
    EXPECT_LE(s.max_violation, 1e-7) << algorithm;
  }
}

TEST_F(NloptTest, SlsqpRejectsLargeProblems) {
  Problem large;
  for (int i = 0; i < 51; ++i) large.minimize(Prior<SE3>{SE3()}, Gaussian(Vector<6>::Ones()), {large.add(SE3())});
  EXPECT_THAT(why_unsupported(large, options("slsqp")),
              AllOf(HasSubstr("300 unknowns at most, not 306"), HasSubstr("nlopt:auglag-lbfgs")));
  EXPECT_EQ(why_unsupported(large, options("auglag-lbfgs")), "");
  EXPECT_EQ(why_unsupported(large, options("lbfgs")), "");
  EXPECT_EQ(solve(large, options("slsqp")).status, Status::unsupported);
}

TEST_F(NloptTest, RejectsATooLargeDenseJacobian) {
  Problem large;
  for (int i = 0; i < 2000; ++i) large.subject_to(Prior<SE3>{SE3()}, equal_to(0.0), {large.add(SE3())});
  EXPECT_THAT(why_unsupported(large, options("auglag-lbfgs")), HasSubstr("12000 rows and 12000 columns"));
}

/// Residual x y.
struct Product {
  static constexpr std::string_view name = "product";
  static constexpr int dim = 1;
  using States = std::tuple<R2>;
  void operator()(const R2& p, Vector<1>& r, Matrix<1, 2>* J = nullptr) const {
    r[0] = p.vector().prod();
    if (J) *J << p.vector()[1], p.vector()[0];
  }
};

/// Near the axis x = 0, the gradients of x ≥ 0 and x y ≤ 0 are nearly dependent: with huge multipliers they cancel any
/// gradient. The minimum is at (0, 2).
TEST_F(NloptTest, DoesNotConvergeAtADegenerateCorner) {
  for (const Vector<2>& start : {Vector<2>(1.0, 1.0), Vector<2>(0.5, 1.0), Vector<2>(2.0, 1.5)})
    for (const UniformBounds& bounds : {at_most(0.0), equal_to(0.0)}) {
      Problem corner;
      const auto z = corner.add(R2(start));
      corner.minimize(Prior<R2>{R2({1.0, 2.0})}, Gaussian{1.0, 1.0}, {z});
      corner.subject_to(Prior<R2>{R2()}, at_least(0.0), {z});
      corner.subject_to(Product{}, bounds, {z});
      const Summary s = solve(corner, options("slsqp"));
      const Vector<2> end = corner.value(z).vector();
      const double distance = std::min((end - Vector<2>(0.0, 2.0)).norm(), (end - Vector<2>(1.0, 0.0)).norm());
      EXPECT_TRUE(!s.converged() || distance < 1e-3) << end.transpose() << ": " << s.message;
    }
}

TEST_F(NloptTest, PrintsNothing) {
  ::testing::internal::CaptureStdout();
  solve(problem, options("slsqp"));
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
}

}  // namespace
}  // namespace tandem::testing
