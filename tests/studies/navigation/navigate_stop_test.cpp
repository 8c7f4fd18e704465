#include <atomic>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/stop.hpp>
#include <tandem/studies/navigation/fit_delay.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>

#include "studies/scratch.hpp"

/// The solver's time limit and stop flag cover all steps of a navigation.
namespace tandem {
namespace {

using testing::HasSubstr;

class NavigateStop : public testing::Test {
 protected:
  const NavigationData data = simulate_dive({.grade = Grade::tactical, .minutes = 1}).data;
  NavigationOptions options;
  std::atomic<bool> stop = false;
};

TEST_F(NavigateStop, ThrowsBeforeSecondKeyframe) {
  options.solver.time_limit = 0;
  EXPECT_THROW(navigate(data, options), Stopped);
  options.solver.time_limit = HUGE_VAL;
  options.solver.stop = &stop;
  stop = true;
  EXPECT_THAT(error_of([&] { navigate(data, options); }), HasSubstr("interrupted"));
}

TEST_F(NavigateStop, ReturnsStatesIfStoppedDuringSolve) {
  options.solver.stop = &stop;
  options.solver.progress = [this](const Progress&) { stop = true; };
  const Navigation navigation = navigate(data, options);
  EXPECT_EQ(navigation.summary.status, Status::interrupted);
  EXPECT_GT(navigation.states.size(), 30u);
  EXPECT_EQ(navigation.solves, 1);
  EXPECT_TRUE(navigation.covariance.empty());
}

TEST_F(NavigateStop, SkipsCovariancesIfNotRequested) {
  options.covariance = false;
  const Navigation navigation = navigate(data, options);
  EXPECT_TRUE(navigation.summary.converged());
  EXPECT_TRUE(navigation.covariance.empty());
  EXPECT_EQ(navigation.why_no_covariance, "not requested");
  EXPECT_FALSE(navigation.cut_short);
}

TEST_F(NavigateStop, StopsDelayFit) {
  options.solver.stop = &stop;
  int solves = 0;
  options.solver.progress = [&](const Progress& progress) {
    if (progress.iteration == 0 && ++solves == 3) stop = true;
  };
  EXPECT_THAT(error_of([&] { fit_delay(data, data.sensors[0].name, options); }), HasSubstr("fitting the delay of "));
  EXPECT_EQ(solves, 3);
}

}  // namespace
}  // namespace tandem
