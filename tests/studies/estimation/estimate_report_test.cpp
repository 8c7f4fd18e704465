#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/estimation/estimate_report.hpp>

#include "made_up_estimate.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(EstimateReport, JsonHasAllFields) {
  const auto json = nlohmann::json::parse(summary_json(made_up()));
  EXPECT_EQ(json["scenario"], "made up");
  EXPECT_EQ(json["model"], "constant-twist");
  EXPECT_EQ(json["mode"], "A");
  EXPECT_EQ(json["solver"], "gauss-newton");
  EXPECT_EQ(json["status"], "converged");
  EXPECT_EQ(json["message"], "the cost no longer decreases");
  EXPECT_EQ(json["initial_cost"], 20.0);
  EXPECT_EQ(json["cost"], 1.25);
  EXPECT_EQ(json["keyframes"], 2);
  EXPECT_EQ(json["residual_blocks"], 7);
  EXPECT_EQ(json["iterations"], 3);
  EXPECT_EQ(json["evaluations"], 4);
  EXPECT_EQ(json["solve_seconds"], 0.5);
  EXPECT_EQ(json["max_violation"], 0.0);
  const auto& errors = json["errors"];
  EXPECT_EQ(errors["position"]["n"], 1);
  EXPECT_EQ(errors["position"]["position_mean_m"], 0.5);
  EXPECT_EQ(errors["position"]["position_std_m"], 0.0);
  EXPECT_EQ(errors["position"]["orientation_mean_deg"], 10.0);
  EXPECT_EQ(errors["position"]["raw_position_mean_m"], 2.5);
  EXPECT_FALSE(errors["none"].contains("raw_position_mean_m"));
  EXPECT_EQ(errors["pose"], nlohmann::json({{"n", 0}}));
  EXPECT_EQ(errors["all"]["position_mean_m"], 1.0);
  EXPECT_FALSE(errors["all"].contains("n_with_truth"));
}

TEST(EstimateReport, ReportsCoverageOfTruth) {
  Estimate estimate = made_up();
  estimate.errors[1].position = estimate.errors[1].orientation = {};
  const auto json = nlohmann::json::parse(summary_json(estimate));
  EXPECT_EQ(json["errors"]["all"]["n"], 2);
  EXPECT_EQ(json["errors"]["all"]["n_with_truth"], 1);
  EXPECT_THAT(report(estimate), HasSubstr("The truth covers 1 of the 2 keyframes."));
}

TEST(EstimateReport, JsonReplacesInvalidCharactersAndNumbers) {
  Estimate estimate = made_up();
  estimate.scenario = "\xff\"";
  estimate.summary.cost = std::numeric_limits<double>::quiet_NaN();
  const auto json = nlohmann::json::parse(summary_json(estimate));
  EXPECT_TRUE(json["cost"].is_null());
}

TEST(EstimateReport, PrintsRowPerKeyframeType) {
  const std::string text = report(made_up());
  EXPECT_THAT(text, HasSubstr("made up, constant-twist, mode A: 2 keyframes, 7 residual blocks\n"));
  EXPECT_THAT(text, HasSubstr("gauss-newton: converged, cost 1.250000"));
  EXPECT_THAT(text, testing::ContainsRegex("position +1 +0.500 ± 0.000 +10.00 +2.500 ± 0.000\n"));
  EXPECT_THAT(text, Not(HasSubstr("\npose "))) << "no such keyframes";
  EXPECT_THAT(text, testing::ContainsRegex("none +1 +1.500 ± 0.000 +20.00 +–\n"));
  EXPECT_THAT(text, testing::ContainsRegex("all +2 +1.000 ± 0.500 +15.00 +–\n"));
  EXPECT_THAT(text, Not(HasSubstr("violation"))) << "no constraints";
  EXPECT_THAT(text, Not(HasSubstr("NOT CONVERGED")));
}

TEST(EstimateReport, PrintsModelAndNonDefaultOptions) {
  Estimate estimate = made_up();
  estimate.options.mode = Mode::B;
  estimate.options.roll_pitch = Role::off;
  estimate.options.non_holonomic = Role::hard;
  estimate.options.surge = at_least(0.0);
  estimate.options.limits = Role::soft;
  EXPECT_THAT(
      report(estimate),
      HasSubstr("made up, constant-twist, mode B, roll-pitch off, non-holonomic hard, surge soft: 2 keyframes"));
}

TEST(EstimateReport, NamesAllSensors) {
  const Estimate estimate = made_up();
  EXPECT_THAT(report(estimate), testing::ContainsRegex("\nusbl +position +1 .*\noptical +pose +0 "));
  EXPECT_EQ(nlohmann::json::parse(summary_json(estimate))["sensors"]["usbl"]["used"], 1);
}

TEST(EstimateReport, PrintsSensorTable) {
  Estimate estimate = made_up();
  estimate.sensors[0] = {.name = "radar", .type = SensorType::range_bearing, .delay = 1.4, .used = 39};
  estimate.sensors[0].discarded = 1;
  estimate.sensors[0].raw_position = MeanStd{2.5, 1.25, 39};
  estimate.sensors[1].robust = true;
  estimate.sensors[1].down_weighted = 2;
  estimate.without_extrinsics = {"radar"};
  const std::string text = report(estimate);
  EXPECT_THAT(text, HasSubstr("mode A, robust:"));
  EXPECT_THAT(text, testing::ContainsRegex("radar +range_bearing +39 +0 +1 +0 +2.500 ± 1.250\n"));
  EXPECT_THAT(text, testing::ContainsRegex("optical +pose +0 +0 +0 +2 +–\n"));
  EXPECT_THAT(text, HasSubstr("radar: no extrinsics given; the body's origin and axes are assumed.\n"));
  const auto json = nlohmann::json::parse(summary_json(estimate))["sensors"];
  EXPECT_EQ(json["radar"], nlohmann::json({{"type", "range_bearing"},
                                           {"used", 39},
                                           {"held_out", 0},
                                           {"discarded", 1},
                                           {"down_weighted", 0},
                                           {"raw_position_mean_m", 2.5},
                                           {"raw_position_std_m", 1.25}}));
  EXPECT_EQ(json["optical"]["down_weighted"], 2);
}

/// Four held-out measurements with two rows of unit variance; the outlier must not count.
TEST(EstimateReport, PrintsCoverageOfInliers) {
  Estimate estimate = made_up();
  estimate.sensors[0].robust = true;
  const auto add = [&](double a, double b, std::optional<bool> inlier) {
    estimate.held_out.push_back({HeldOut{0, 0, Vector<2>(a, b), Matrix<2, 2>::Identity()}, 0.1, inlier});
  };
  add(0, 1, true);
  add(1, 2.2, true);      // one row outside, joint region inside
  add(1.95, 1.95, true);  // both rows inside, joint region outside
  add(9, 9, false);
  const std::string text = report(estimate);
  EXPECT_THAT(text, testing::ContainsRegex("usbl +4 +3 +83.3 % +66.7 %\n"));
  EXPECT_THAT(text, HasSubstr("Inliers have a weight of 0.5 or more in a solve with all measurements.\n"));
  const auto json = nlohmann::json::parse(summary_json(estimate))["held_out"]["usbl"];
  EXPECT_EQ(json["inliers"], 3);
  EXPECT_NEAR(json["inlier_rows_in_95_percent"], 500.0 / 6, 1e-9);
  EXPECT_NEAR(json["inliers_in_95_percent"], 200.0 / 3, 1e-9);

  add(0, 0, {});
  EXPECT_THAT(report(estimate), HasSubstr("all held-out measurements count as inliers"));
}

TEST(EstimateReport, PrintsWhyCovariancesAreMissing) {
  Estimate estimate = made_up();
  estimate.why_no_uncertainty = "the solve did not converge";
  EXPECT_THAT(report(estimate), HasSubstr("No covariances: the solve did not converge\n"));
  EXPECT_EQ(nlohmann::json::parse(summary_json(estimate))["no_covariance"], "the solve did not converge");
}

TEST(EstimateReport, PrintsWarnings) {
  Estimate estimate = made_up();
  EXPECT_THAT(report(estimate), Not(HasSubstr("OVERCONFIDENT")));
  for (const double sigmas : {2003.4, 50.0, 40.0, 30.0}) estimate.suspects.push_back({"usbl", 312.0, sigmas});
  estimate.contradiction = "The limits contradict the data.";
  KeyframeUncertainty u;
  u.relative_position = 0.01 * Matrix<3, 3>::Identity();
  estimate.uncertainty = {u, u};
  estimate.errors[0].position_vector = Vector<3>(0.3, 0, 0);  // 3 σ
  EXPECT_THAT(report(estimate), Not(HasSubstr("OVERCONFIDENT"))) << "NEES 9";
  estimate.errors[1].position_vector = Vector<3>(0, 0, 0.8);  // 8 σ
  const std::string text = report(estimate);
  EXPECT_THAT(text,
              HasSubstr("\nusbl at 312.000 s is 2e+03 standard deviations from where the other measurements put the "
                        "target.\n"));
  EXPECT_THAT(text,
              HasSubstr("… and 1 more.\nIf these are outliers, use --robust.\nThe limits contradict the data.\n"));
  EXPECT_THAT(text, HasSubstr("mean NEES of the relative position 36.5, 3 if consistent"));
  const auto json = nlohmann::json::parse(summary_json(estimate));
  EXPECT_EQ(json["suspects"].size(), 4u);
  EXPECT_NEAR(json["overconfident_nees"], 36.5, 1e-9);
  estimate.options.robust_initial_guess = true;
  EXPECT_THAT(report(estimate), Not(HasSubstr("If these are outliers")));
}

TEST(EstimateReport, PrintsHugeNumbersInScientificNotation) {
  Estimate estimate = made_up();
  estimate.summary.cost = 3e299;
  estimate.errors[0].position = 1e150;
  const std::string text = report(estimate);
  EXPECT_THAT(text, HasSubstr("cost 3e+299 (from 20)"));
  EXPECT_THAT(text, HasSubstr("1e+150 ± 0"));
}

TEST(EstimateReport, MarksSolveThatDidNotConverge) {
  Estimate estimate = made_up();
  estimate.summary.status = Status::max_iterations;
  estimate.summary.message = "stopped at 3 iterations";
  estimate.hard_blocks = 2;
  estimate.summary.max_violation = 0.25;
  EXPECT_THAT(report(estimate), HasSubstr("NOT CONVERGED: stopped at 3 iterations\n"));
  EXPECT_THAT(report(estimate), HasSubstr("largest violation of a hard constraint: 0.25\n"));
  EXPECT_EQ(nlohmann::json::parse(summary_json(estimate))["status"], "max-iterations");
}

}  // namespace
}  // namespace tandem
