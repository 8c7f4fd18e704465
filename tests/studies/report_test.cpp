#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/report.hpp>
#include <tandem/studies/table.hpp>

#include "scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::Not;

Estimate made_up() {
  Estimate estimate;
  estimate.scenario = "made up";
  estimate.summary.solver = "gauss-newton";
  estimate.summary.status = Status::converged;
  estimate.summary.message = "the cost no longer decreases";
  estimate.summary.initial_cost = 20.0;
  estimate.summary.cost = 1.25;
  estimate.summary.iterations = 3;
  estimate.summary.evaluations = 4;
  estimate.summary.seconds = 0.5;
  estimate.residual_blocks = 7;
  estimate.keyframes = {{0.1, KeyframeType::usbl, Vector<3>(1, 2, 3), {}}, {1.0 / 3.0, KeyframeType::gated, {}, {}}};
  estimate.chaser = {SE3(), SE3(SO3::Exp({0, 0, 1}), Vector<3>(1.0 / 3.0, 0, 0))};
  estimate.target = {SE3(), SE3(SO3(), Vector<3>(2, 0, 0))};
  estimate.errors = {{0.1, KeyframeType::usbl, 0.5, 10.0, 2.5, {}},
                     {1.0 / 3.0, KeyframeType::gated, 1.5, 20.0, {}, {}}};
  return estimate;
}

TEST(Report, JsonHasTheWholeSummary) {
  const auto json = nlohmann::json::parse(summary_json(made_up()));
  EXPECT_EQ(json["scenario"], "made up");
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
  EXPECT_EQ(errors["usbl"]["n"], 1);
  EXPECT_EQ(errors["usbl"]["position_mean_m"], 0.5);
  EXPECT_EQ(errors["usbl"]["position_std_m"], 0.0);
  EXPECT_EQ(errors["usbl"]["angle_mean_deg"], 10.0);
  EXPECT_EQ(errors["usbl"]["raw_position_mean_m"], 2.5);
  EXPECT_FALSE(errors["gated"].contains("raw_position_mean_m"));
  EXPECT_EQ(errors["optical"], nlohmann::json({{"n", 0}}));
  EXPECT_EQ(errors["all"]["position_mean_m"], 1.0);
  EXPECT_FALSE(errors["all"].contains("n_with_truth"));
}

TEST(Report, JsonSaysHowMuchTheTruthCovers) {
  Estimate estimate = made_up();
  estimate.errors[1].position = estimate.errors[1].angle = {};
  const auto json = nlohmann::json::parse(summary_json(estimate));
  EXPECT_EQ(json["errors"]["all"]["n"], 2);
  EXPECT_EQ(json["errors"]["all"]["n_with_truth"], 1);
  EXPECT_THAT(report(estimate), HasSubstr("The truth covers 1 of the 2 keyframes."));
}

TEST(Report, JsonSurvivesNamesThatAreNotText) {
  Estimate estimate = made_up();
  estimate.scenario = "\xff\"";
  estimate.summary.cost = std::numeric_limits<double>::quiet_NaN();
  const auto json = nlohmann::json::parse(summary_json(estimate));
  EXPECT_TRUE(json["cost"].is_null());
}

TEST(Report, TableHasARowForEachType) {
  const std::string text = report(made_up());
  EXPECT_THAT(text, HasSubstr("made up, mode A: 2 keyframes, 7 residual blocks\n"));
  EXPECT_THAT(text, HasSubstr("gauss-newton: converged, cost 1.250000"));
  EXPECT_THAT(text, testing::ContainsRegex("usbl +1 +0.500 ± 0.000 +10.00 +2.500 ± 0.000\n"));
  EXPECT_THAT(text, testing::ContainsRegex("optical +0 +– +– +–\n"));
  EXPECT_THAT(text, testing::ContainsRegex("all +2 +1.000 ± 0.500 +15.00 +–\n"));
  EXPECT_THAT(text, Not(HasSubstr("violation"))) << "nothing is constrained";
  EXPECT_THAT(text, Not(HasSubstr("NOT CONVERGED")));
}

TEST(Report, TableMarksWhatDidNotConverge) {
  Estimate estimate = made_up();
  estimate.summary.status = Status::max_iterations;
  estimate.summary.message = "stopped at 3 iterations";
  estimate.hard_blocks = 2;
  estimate.summary.max_violation = 0.25;
  EXPECT_THAT(report(estimate), HasSubstr("NOT CONVERGED: stopped at 3 iterations\n"));
  EXPECT_THAT(report(estimate), HasSubstr("largest violation of a hard constraint: 0.25\n"));
  EXPECT_EQ(nlohmann::json::parse(summary_json(estimate))["status"], "max-iterations");
}

TEST(Report, TrajectoriesAreWrittenToTheLastDigit) {
  const ScratchFolder folder;
  write_results(made_up(), folder.path());
  const auto chaser = poses(read_tum(folder.path() / "chaser.tum"));
  ASSERT_EQ(chaser.size(), 2u);
  EXPECT_EQ(chaser[1].t, 1.0 / 3.0);
  EXPECT_EQ(chaser[1].value.translation().x(), 1.0 / 3.0);
  EXPECT_NEAR(chaser[1].value.rotation().Log().z(), 1.0, 1e-15);
  EXPECT_EQ(poses(read_tum(folder.path() / "target.tum"))[1].value.translation().x(), 2.0);
  EXPECT_EQ(read_file(folder.path() / "summary.json"), summary_json(made_up()));
}

TEST(Report, ErrorsAreWrittenByKeyframe) {
  const ScratchFolder folder;
  Estimate estimate = made_up();
  estimate.keyframes[1].t = estimate.errors[1].t = 2.5;
  estimate.errors[1].position = estimate.errors[1].angle = {};
  write_results(estimate, folder.path());
  EXPECT_EQ(read_file(folder.path() / "errors.csv"),
            "t,type,position_error_m,angle_error_deg\n0.1,usbl,0.5,10\n2.5,gated,,\n");
}

TEST(Report, AFolderThatIsGoneIsAnError) {
  EXPECT_THAT(error_of([] { write_results(made_up(), "/nonexistent"); }), HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace tandem
