#include <atomic>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/solvers/online/fixed_lag.hpp>

#include "biased_step.hpp"
#include "seconds_of.hpp"

/// What leaves the window, and when: nothing that should stay, and nothing before its estimate has settled.
namespace tandem::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// A point at time t, known from a fix.
Variable<R3> add_point(FixedLag& lag, double t, const char* name = "") {
  const auto x = lag.add(t, R3(), name);
  lag.problem().minimize(Prior<R3>{R3({t, 0, 0})}, noise(3, 1.0), {x});
  return x;
}

TEST(FixedLagLeaving, AHookThatThrowsKeepsWhatHasNotLeft) {
  FixedLagOptions options = seconds_of(1.0);
  bool objects = true;
  std::vector<double> told;
  options.leaving = [&](double t) {
    told.push_back(t);
    if (objects && t == 1.0) throw Error("not this one");
  };
  FixedLag lag(options);
  const auto a = add_point(lag, 0.0), b = add_point(lag, 1.0), c = add_point(lag, 5.0);
  const int freed = lag.problem().id(a);
  EXPECT_THAT([&] { lag.update(); }, ThrowsMessage<Error>("not this one"));
  EXPECT_FALSE(lag.problem().has(a));
  EXPECT_TRUE(lag.problem().has(b));
  ASSERT_EQ(lag.gone().size(), 1u);
  EXPECT_EQ(lag.gone()[0].t, 0.0);
  EXPECT_EQ(lag.oldest(), 1.0);
  objects = false;
  const auto d = add_point(lag, 5.5, "d");
  ASSERT_EQ(lag.problem().id(d), freed);
  EXPECT_TRUE(lag.update().converged());
  EXPECT_FALSE(lag.problem().has(b));
  EXPECT_TRUE(lag.problem().has(c));
  EXPECT_TRUE(lag.problem().has(d)) << "the newest has the id of one that left";
  EXPECT_THAT(told, ElementsAre(0.0, 1.0, 1.0));
}

/// Jacobians are undefined once it is told so.
struct Spoilt {
  static constexpr std::string_view name = "spoilt";
  static constexpr int dim = 3;
  using States = std::tuple<R3>;
  const bool* spoilt;
  void operator()(const R3& x, Vector<3>& r, Matrix<3, 3>* J = nullptr) const {
    if (*spoilt) throw Error("undefined here");
    r = x.vector();
    if (J) *J = Matrix<3, 3>::Identity();
  }
};

TEST(FixedLagLeaving, WhatCannotBeMarginalizedStays) {
  bool spoilt = false;
  FixedLagOptions options = seconds_of(1.0);
  options.leaving = [&](double t) { spoilt = t == 1.0; };
  FixedLag lag(options);
  const auto a = add_point(lag, 0.0), b = add_point(lag, 1.0);
  add_point(lag, 5.0);
  lag.problem().minimize(Spoilt{&spoilt}, noise(3, 1.0), {b});
  EXPECT_THROW(lag.update(), Error);
  EXPECT_FALSE(lag.problem().has(a));
  EXPECT_TRUE(lag.problem().has(b));
  EXPECT_EQ(lag.oldest(), 1.0);
  spoilt = false;
  const auto newest = add_point(lag, 5.5);  // by the id of a
  EXPECT_THROW(lag.update(), Error);
  EXPECT_TRUE(lag.problem().has(newest));
  EXPECT_TRUE(lag.problem().has(b));
}

TEST(FixedLagLeaving, WhatIsTakenOutOfTheProblemIsNotTakenForItsSuccessor) {
  for (const bool marginalized : {false, true}) {
    SCOPED_TRACE(marginalized);
    FixedLag lag(seconds_of(1.0));
    const auto a = lag.add(0.0, R3());
    const auto b = add_point(lag, 4.0);
    EXPECT_EQ(lag.oldest(), 0.0);
    const int id = lag.problem().id(a);
    marginalized ? lag.problem().marginalize(a) : lag.problem().remove(a);
    EXPECT_EQ(lag.oldest(), 4.0);
    const auto c = add_point(lag, 4.5);
    ASSERT_EQ(lag.problem().id(c), id);
    EXPECT_TRUE(lag.update().converged());
    EXPECT_TRUE(lag.problem().has(b));
    EXPECT_TRUE(lag.problem().has(c));
    EXPECT_TRUE(lag.gone().empty());
    EXPECT_EQ(lag.newest(), 4.5);
    lag.remove(lag.add(4.7, R3()));
    EXPECT_EQ(lag.newest(), 4.5);
  }
}

TEST(FixedLagLeaving, ASuccessorHasNoCovarianceOfItsPredecessor) {
  FixedLag lag(seconds_of(10.0));
  const auto a = add_point(lag, 0.0);
  const auto idle = lag.add(1.0, R3(), "idle");
  EXPECT_TRUE(lag.update().converged());
  EXPECT_NO_THROW(lag.covariance(idle));
  lag.problem().remove(idle);
  const auto b = lag.problem().add(R3(), "b");
  EXPECT_THAT([&] { lag.covariance(a, b); }, ThrowsMessage<Error>(HasSubstr("b was not in the last update")));
  lag.track(2.0, b);
  EXPECT_THAT([&] { lag.track(3.0, b); }, ThrowsMessage<Error>(HasSubstr("b has a time")));
  EXPECT_THAT([&] { lag.track(3.0, idle); }, ThrowsMessage<Error>(HasSubstr("not in the problem (any more)")));
  EXPECT_EQ(lag.newest(), 2.0);
}

TEST(FixedLagLeaving, TheHookMayTakeOutWhatIsLeaving) {
  FixedLagOptions options = seconds_of(1.0);
  FixedLag* self = nullptr;
  Variable<R3> a, b;
  options.leaving = [&](double) { self->remove(a); };
  FixedLag lag(options);
  self = &lag;
  a = lag.add(0.0, R3());
  b = add_point(lag, 0.0);
  add_point(lag, 3.0);
  EXPECT_TRUE(lag.update().converged());
  EXPECT_EQ(lag.gone().size(), 1u);
  EXPECT_FALSE(lag.problem().has(b));
  EXPECT_EQ(lag.oldest(), 3.0);
}

TEST(FixedLagLeaving, NothingLeavesBeforeItHasConverged) {
  std::atomic<bool> stop = true;
  FixedLagOptions options = seconds_of(2.0);
  options.stop = &stop;
  FixedLag lag(options);
  const auto a = add_point(lag, 0.0);
  add_point(lag, 2.5);
  EXPECT_EQ(lag.update().status, Status::interrupted);
  EXPECT_TRUE(lag.problem().has(a)) << "its value is still where it began";
  EXPECT_FALSE(lag.why_too_late(0.0));
  EXPECT_NEAR(lag.covariance(a)(0, 0), 1.0, 1e-9) << "nothing was solved, and yet there is a factor";
  stop = false;
  EXPECT_TRUE(lag.update().converged());
  EXPECT_FALSE(lag.problem().has(a));
}

TEST(FixedLagLeaving, WithoutConvergenceTheWindowGrowsSoFarAndNoFurther) {
  FixedLagOptions by_time = seconds_of(10.0), by_keyframes = seconds_of(HUGE_VAL), strict = seconds_of(10.0);
  by_keyframes.max_keyframes = 11;
  by_keyframes.patience = 0.4;
  strict.patience = 0;
  for (const auto& [options, most] : {std::pair{by_time, 16}, {by_keyframes, 16}, {strict, 11}}) {
    FixedLagOptions hurried = options;
    hurried.time_limit = 0;
    FixedLag lag(hurried);
    for (int t = 0; t < 50; ++t) {
      add_point(lag, t);
      ASSERT_EQ(lag.update().status, Status::time_limit);
      ASSERT_EQ(lag.problem().num_variables(), std::min(t + 1, most));
    }
  }
}

/// r = (−1 + x + x², 1 − x²): the Gauss-Newton step from 0 to 1 lowers the cost from 1 to 0.5, as its model says, and
/// the slope there is 3.
struct Coincidence {
  static constexpr std::string_view name = "coincidence";
  static constexpr int dim = 2;
  using States = std::tuple<Rn<1>>;
  void operator()(const Rn<1>& state, Vector<2>& r, Matrix<2, 1>* J = nullptr) const {
    const double x = state.vector()[0];
    r = Vector<2>(-1 + x + x * x, 1 - x * x);
    if (J) *J = Vector<2>(1 + 2 * x, -2 * x);
  }
};

TEST(FixedLagLeaving, ACostThatFallsAsForetoldByCoincidenceHasNotConverged) {
  FixedLagOptions options;
  options.max_iterations = 50;
  FixedLag lag(options);
  const auto x = lag.add(0.0, Rn<1>());
  lag.problem().minimize(Coincidence{}, Gaussian{1, 1}, {x});
  EXPECT_TRUE(lag.update().converged());
  EXPECT_NEAR(lag.problem().value(x).vector()[0], 0.7345, 2e-3);
}

}  // namespace
}  // namespace tandem::testing
