#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/support/option_values.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

TEST(OptionValues, ParsesWords) {
  EXPECT_EQ(parse_role("--roll-pitch", "hard"), Role::hard);
  EXPECT_EQ(parse_limits("--limits", "soft"), Role::soft);
  EXPECT_EQ(parse_hessian("--hessian", "limited-memory"), Hessian::limited_memory);
  EXPECT_EQ(parse_linear_solver("--linear-solver", "mumps"), IpoptLinearSolver::mumps);
  EXPECT_EQ(parse_plots("--plots", "png"), PlotFormat::png);
  EXPECT_EQ(parse_plots("--plots", "off"), std::nullopt);
  EXPECT_EQ(error_of([] { parse_role("--roll-pitch", "sotf"); }),
            "--roll-pitch takes soft, hard or off, not 'sotf'; did you mean soft?");
  EXPECT_EQ(error_of([] { parse_role("--roll-pitch", "maybe"); }), "--roll-pitch takes soft, hard or off, not 'maybe'");
  EXPECT_EQ(error_of([] { parse_limits("--limits", "off"); }), "--limits takes hard or soft, not 'off'");
}

TEST(OptionValues, ParsesIntervals) {
  const Bounds<1> both = parse_interval("--surge", "-0.5,2.5");
  EXPECT_EQ(both.lower[0], -0.5);
  EXPECT_EQ(both.upper[0], 2.5);
  EXPECT_EQ(parse_interval("--surge", "0,inf").upper[0], HUGE_VAL);
  EXPECT_EQ(parse_interval("--surge", "-inf,1").lower[0], -HUGE_VAL);
  EXPECT_EQ(error_of([] { parse_interval("--surge", "2,1"); }),
            "--surge: the lower limit 2 is above the upper limit 1");
  EXPECT_EQ(error_of([] { parse_interval("--surge", "0,x"); }), "--surge: 'x' is not a number");
  EXPECT_EQ(error_of([] { parse_interval("--surge", "nan,1"); }), "--surge: 'nan' is not a number");
  EXPECT_EQ(error_of([] { parse_interval("--surge", "0,1,2"); }),
            "--surge takes two numbers MIN,MAX, not '0,1,2'; for one limit: --surge MIN,inf or --surge -inf,MAX");
  EXPECT_THAT(error_of([] { parse_interval("--surge", "2.5"); }), testing::HasSubstr("not '2.5'; for one limit"));
  EXPECT_EQ(error_of([] { parse_interval("--surge", "-inf,inf"); }),
            "--surge -inf,inf limits nothing; give at least one finite number");
}

TEST(OptionValues, ParsesLosses) {
  EXPECT_EQ(parse_loss("--loss", "huber").kind, Loss::Kind::huber);
  EXPECT_EQ(parse_loss("--loss", "huber").scale, 1.0);
  EXPECT_EQ(parse_loss("--loss", "geman-mcclure:2.5").scale, 2.5);
  EXPECT_THAT(error_of([] { parse_loss("--loss", "caucy:1"); }), HasSubstr("not 'caucy'; did you mean cauchy?"));
  EXPECT_EQ(error_of([] { parse_loss("--loss", "tukey:0"); }), "--loss: the scale must be positive and finite, not 0");
  EXPECT_EQ(error_of([] { parse_loss("--loss", "tukey:"); }), "--loss: '' is not a number");
}

TEST(OptionValues, ParsesSolvers) {
  EXPECT_TRUE(std::holds_alternative<GaussNewtonOptions>(parse_solver("--solver", "gauss-newton")));
  EXPECT_TRUE(std::holds_alternative<AugmentedLagrangianOptions>(parse_solver("--solver", "augmented-lagrangian")));
  EXPECT_TRUE(std::holds_alternative<IpoptOptions>(parse_solver("--solver", "ipopt")));
  for (const std::string& algorithm : nlopt_algorithms())
    EXPECT_EQ(std::get<NloptOptions>(parse_solver("--solver", "nlopt:" + algorithm)).algorithm, algorithm);
  EXPECT_THAT(error_of([] { parse_solver("--solver", "ipop"); }),
              StartsWith("--solver takes gauss-newton, augmented-lagrangian, ipopt"));
  EXPECT_THAT(error_of([] { parse_solver("--solver", "augmented-lagrange"); }),
              HasSubstr("did you mean augmented-lagrangian?"));
  EXPECT_THAT(error_of([] { parse_solver("--solver", "ipop"); }), HasSubstr("not 'ipop'; did you mean ipopt?"));
  EXPECT_THAT(error_of([] { parse_solver("--solver", "nlopt:nosuch"); }), HasSubstr("nlopt"));
}

TEST(OptionValues, ParsesNumbers) {
  EXPECT_EQ(parse_count("--max-keyframes", "20"), 20);
  EXPECT_EQ(error_of([] { parse_count("--max-keyframes", "0"); }), "--max-keyframes takes a positive integer, not '0'");
  EXPECT_EQ(parse_count_or_zero("--folds", "0"), 0);
  EXPECT_EQ(error_of([] { parse_count_or_zero("--folds", "-2"); }), "--folds takes a non-negative integer, not '-2'");
  EXPECT_EQ(parse_non_negative("--yaw-rate", "0.2"), 0.2);
  EXPECT_EQ(error_of([] { parse_non_negative("--yaw-rate", "-1"); }),
            "--yaw-rate takes a non-negative number, not '-1'");
  EXPECT_EQ(error_of([] { parse_non_negative("--yaw-rate", "fast"); }), "--yaw-rate: 'fast' is not a number");
}

TEST(OptionValues, ParsesAssignments) {
  EXPECT_EQ(parse_assignment("--ipopt", "tol=1e-6"), (std::pair<std::string, std::string>("tol", "1e-6")));
  for (const char* wrong : {"tol", "tol=", "=1"})
    EXPECT_THAT(error_of([&] { parse_assignment("--ipopt", wrong); }), StartsWith("--ipopt takes KEY=VALUE, not "));
}

}  // namespace
}  // namespace tandem
