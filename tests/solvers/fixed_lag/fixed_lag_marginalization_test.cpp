#include <atomic>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag.hpp>

#include "biased_step.hpp"
#include "seconds_of.hpp"

/// Tests which variables leave the window, and when: only old ones, and only after their estimate no longer changes.
namespace tandem::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// Adds a point at time t with a position measurement.
Variable<R3> add_point(FixedLag& lag, double t, const char* name = "") {
  const auto x = lag.add(t, R3(), name);
  lag.problem().minimize(Prior<R3>{R3({t, 0, 0})}, noise(3, 1.0), {x});
  return x;
}

TEST(FixedLagMarginalization, KeepsVariablesIfTheCallbackThrows) {
  FixedLagOptions options = seconds_of(1.0);
  bool throws = true;
  std::vector<double> times;
  options.before_marginalize = [&](double t) {
    times.push_back(t);
    if (throws && t == 1.0) throw Error("not this one");
  };
  FixedLag lag(options);
  const auto a = add_point(lag, 0.0), b = add_point(lag, 1.0), c = add_point(lag, 5.0);
  const int freed = lag.problem().id(a);
  EXPECT_THAT([&] { lag.update(); }, ThrowsMessage<Error>("not this one"));
  EXPECT_FALSE(lag.problem().has(a));
  EXPECT_TRUE(lag.problem().has(b));
  ASSERT_EQ(lag.marginalized().size(), 1u);
  EXPECT_EQ(lag.marginalized()[0].t, 0.0);
  EXPECT_EQ(lag.oldest(), 1.0);
  throws = false;
  const auto d = add_point(lag, 5.5, "d");
  ASSERT_EQ(lag.problem().id(d), freed);
  EXPECT_TRUE(lag.update().converged());
  EXPECT_FALSE(lag.problem().has(b));
  EXPECT_TRUE(lag.problem().has(c));
  EXPECT_TRUE(lag.problem().has(d)) << "d reuses the id of a marginalized variable";
  EXPECT_THAT(times, ElementsAre(0.0, 1.0, 1.0));
}

/// Residual whose value is undefined while `*undefined` is true.
struct Undefinable {
  static constexpr std::string_view name = "undefined";
  static constexpr int dim = 3;
  using States = std::tuple<R3>;
  const bool* undefined;
  void operator()(const R3& x, Vector<3>& r, Matrix<3, 3>* J = nullptr) const {
    if (*undefined) throw Error("undefined here");
    r = x.vector();
    if (J) *J = Matrix<3, 3>::Identity();
  }
};

TEST(FixedLagMarginalization, KeepsVariablesThatCannotBeMarginalized) {
  bool undefined = false;
  FixedLagOptions options = seconds_of(1.0);
  options.before_marginalize = [&](double t) { undefined = t == 1.0; };
  FixedLag lag(options);
  const auto a = add_point(lag, 0.0), b = add_point(lag, 1.0);
  add_point(lag, 5.0);
  lag.problem().minimize(Undefinable{&undefined}, noise(3, 1.0), {b});
  EXPECT_THROW(lag.update(), Error);
  EXPECT_FALSE(lag.problem().has(a));
  EXPECT_TRUE(lag.problem().has(b));
  EXPECT_EQ(lag.oldest(), 1.0);
  undefined = false;
  const auto newest = add_point(lag, 5.5);  // reuses the id of a
  EXPECT_THROW(lag.update(), Error);
  EXPECT_TRUE(lag.problem().has(newest));
  EXPECT_TRUE(lag.problem().has(b));
}

TEST(FixedLagMarginalization, DistinguishesVariablesWithTheSameId) {
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
    EXPECT_TRUE(lag.marginalized().empty());
    EXPECT_EQ(lag.newest(), 4.5);
    lag.remove(lag.add(4.7, R3()));
    EXPECT_EQ(lag.newest(), 4.5);
  }
}

TEST(FixedLagMarginalization, NewVariablesHaveNoCovarianceOfRemovedOnes) {
  FixedLag lag(seconds_of(10.0));
  const auto a = add_point(lag, 0.0);
  const auto idle = lag.add(1.0, R3(), "idle");
  EXPECT_TRUE(lag.update().converged());
  EXPECT_NO_THROW(lag.covariance(idle));
  lag.problem().remove(idle);
  const auto b = lag.problem().add(R3(), "b");
  EXPECT_THAT([&] { lag.covariance(a, b); }, ThrowsMessage<Error>(HasSubstr("no covariance of b")));
  lag.track(2.0, b);
  EXPECT_THAT([&] { lag.track(3.0, b); }, ThrowsMessage<Error>(HasSubstr("b already has a time")));
  EXPECT_THAT([&] { lag.track(3.0, idle); }, ThrowsMessage<Error>(HasSubstr("idle has been removed")));
  EXPECT_EQ(lag.newest(), 2.0);
}

TEST(FixedLagMarginalization, TheCallbackMayRemoveLeavingVariables) {
  FixedLagOptions options = seconds_of(1.0);
  FixedLag* self = nullptr;
  Variable<R3> a, b;
  options.before_marginalize = [&](double) { self->remove(a); };
  FixedLag lag(options);
  self = &lag;
  a = lag.add(0.0, R3());
  b = add_point(lag, 0.0);
  add_point(lag, 3.0);
  EXPECT_TRUE(lag.update().converged());
  EXPECT_EQ(lag.marginalized().size(), 1u);
  EXPECT_FALSE(lag.problem().has(b));
  EXPECT_EQ(lag.oldest(), 3.0);
}

TEST(FixedLagMarginalization, WaitsForConvergence) {
  std::atomic<bool> stop = true;
  FixedLagOptions options = seconds_of(2.0);
  options.stop = &stop;
  FixedLag lag(options);
  const auto a = add_point(lag, 0.0);
  add_point(lag, 2.5);
  EXPECT_EQ(lag.update().status, Status::interrupted);
  EXPECT_TRUE(lag.problem().has(a)) << "its value is still the initial guess";
  EXPECT_FALSE(lag.why_too_late(0.0));
  EXPECT_NEAR(lag.covariance(a)(0, 0), 1.0, 1e-9) << "an interrupted update computes the factor too";
  stop = false;
  EXPECT_TRUE(lag.update().converged());
  EXPECT_FALSE(lag.problem().has(a));
}

TEST(FixedLagMarginalization, LimitsTheWindowWithoutConvergence) {
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

/// Residual r = (−1 + x + x², 1 − x²). The Gauss-Newton step from 0 to 1 lowers the cost from 1 to 0.5, as predicted.
/// The slope at 1 is 3.
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

TEST(FixedLagMarginalization, DoesNotConvergeByCoincidence) {
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
