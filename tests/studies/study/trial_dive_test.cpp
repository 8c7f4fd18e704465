#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/simulation/simulate_dive_files.hpp>
#include <tandem/studies/study/trial.hpp>
#include <tandem/studies/study/trial_dive.hpp>
#include <tandem/studies/support/statistics.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

Study dive_study(const std::string& rest) {
  return parse_study("name: d\nsimulation: dive\nseeds: 2\n" + rest, "d.yaml");
}

/// Returns a metric, which must have a value.
double metric_of(const TrialResult& result, const char* name) {
  EXPECT_TRUE(result.get(name)) << name;
  return result.get(name).value_or(std::nan(""));
}

TEST(LongDiveTrial, DvlOutageIncreasesErrors) {
  const Study study = dive_study("parameters: {minutes: 3, dvl_outage: [0, 40], dvl_outage_period: 90}\n");
  EXPECT_FALSE(study.has_target());
  const TrialResult whole = run_trial(study, 0), out = run_trial(study, 1);
  for (const TrialResult* result : {&whole, &out}) {
    EXPECT_EQ(result->status, "converged") << result->message;
    for (const char* metric : {"nees_chaser", "nees_velocity", "nees_bias", "nis_dvl", "nis_depth", "nis_heading",
                               "nis_gps", "chaser_inside_three_sigma", "cost", "iterations", "chaser_worst_m"})
      EXPECT_TRUE(result->get(metric)) << metric;
    EXPECT_FALSE(result->get("at_all_error_m")) << "there is no target";
  }
  EXPECT_FALSE(whole.get("chaser_outage_position_m"));
  EXPECT_GT(metric_of(out, "chaser_velocity_mps"), metric_of(whole, "chaser_velocity_mps"));
  EXPECT_EQ(run_trial(study, 1).metrics[metric_index("cost")], out.get("cost")) << "trials are reproducible";
}

TEST(DiveTrial, NewestStatesHaveLargerErrors) {
  const Study study = dive_study("parameters: {minutes: 1, window: [0, 10]}\n");
  const TrialResult all = run_trial(study, 0), newest = run_trial(study, 1);
  EXPECT_EQ(newest.status, "converged") << newest.message;
  EXPECT_NEAR(metric_of(newest, "keyframes"), metric_of(all, "keyframes"), 1);
  EXPECT_GT(metric_of(newest, "chaser_velocity_mps"), metric_of(all, "chaser_velocity_mps"));
  EXPECT_TRUE(newest.get("nees_bias"));
}

/// Sensor settings change the estimator only; the simulated dive stays the same.
TEST(LongDiveTrial, SensorSettingsAffectTheEstimator) {
  const Study study =
      dive_study("parameters: {minutes: 2, without: [none, dvl, imu, gps], dvl_sigma_factor: [1, 3]}\n");
  std::vector<TrialResult> results;
  for (std::size_t i = 0; i < study.cells(); ++i) {
    results.push_back(run_trial(study, i));
    ASSERT_EQ(results[i].status, "converged") << results[i].message;
    const bool dvl = study.cell_text(study.place(i)).find("without=dvl") == std::string::npos;
    EXPECT_EQ(results[i].get("nis_dvl").has_value(), dvl) << i;
    EXPECT_EQ(results[i].get("nees_bias").has_value(),
              study.cell_text(study.place(i)).find("imu") == std::string::npos);
  }
  EXPECT_NEAR(metric_of(results[1], "nis_dvl") / metric_of(results[0], "nis_dvl"), 1 / 9.0, 0.03);
  EXPECT_GT(metric_of(results[2], "chaser_position_m"), metric_of(results[0], "chaser_position_m"));
}

TEST(LongDiveTrial, EstimatesTheDvlScale) {
  const Study study = dive_study("parameters: {minutes: 6, estimate_dvl_scale: 1, surfacings: 0}\n");
  const TrialResult result = run_trial(study, 0);
  ASSERT_EQ(result.status, "converged") << result.message;
  EXPECT_LT(std::abs(metric_of(result, "dvl_scale_error")), 0.01);
  EXPECT_LT(metric_of(result, "nees_chaser"), 60) << "covariances are evaluated at the estimated scale";
}

TEST(DiveTrial, EstimatesTargetAndChaserTogether) {
  const Study study =
      dive_study("parameters: {minutes: 1, target: 1}\nmodels: [constant-twist, mode-b, 'non-holonomic:soft']\n");
  for (std::size_t i = 0; i < 3; ++i) {
    const TrialResult result = run_trial(study, i);
    ASSERT_EQ(result.status, "converged") << result.message;
    EXPECT_LT(metric_of(result, "at_position_error_m"), metric_of(result, "raw_at_position_error_m"));
    for (const char* metric : {"nees_chaser", "nees_relative_position", "nis_usbl", "nis_dvl", "chaser_position_m"})
      EXPECT_TRUE(result.get(metric)) << metric;
    EXPECT_EQ(result.get("nees_target").has_value(), i != 1) << "in Mode B a target measured only by USBL is a point";
  }
}

TEST(DiveTrial, WrittenFolderGivesTheSameCost) {
  const Study study = dive_study("parameters: {minutes: 1, grade: tactical, imu_sigma_factor: 2}\n");
  const TrialResult result = run_trial(study, 1);
  const TrialSettings settings = study.settings(study.place(1));
  const ScratchFolder folder;
  write_dive(trial_dive(settings), settings.dive, folder.path());
  const Scenario scenario = read_scenario(folder.path());
  EXPECT_DOUBLE_EQ(scenario.navigation->imu->noise.gyroscope, 2 * DiveSensors::of(Grade::tactical).imu.gyroscope);
  const Navigation again = navigate(*scenario.navigation);
  EXPECT_NEAR(again.summary.cost, metric_of(result, "cost"), 1e-3 * again.summary.cost) << "files have nine digits";
}

TEST(DiveTrial, StopsOnRequest) {
  const std::atomic<bool> stop{true};
  for (const char* settings : {"minutes: 1", "minutes: 1, window: 10", "minutes: 1, target: 1"}) {
    const bool target = std::string(settings).find("target") != std::string::npos;
    const Study study =
        dive_study(std::string("parameters: {") + settings + "}\n" + (target ? "models: [constant-twist]\n" : ""));
    EXPECT_NE(run_trial(study, 0, &stop).status, "converged") << settings;
  }
}

TEST(DiveTrial, ErrorsNameKeyAndRemedy) {
  const auto refused = [](const std::string& rest) { return error_of([&] { dive_study(rest); }); };
  EXPECT_THAT(refused("models: [constant-twist]\n"), HasSubstr("models need a target: set target: 1"));
  EXPECT_THAT(refused("parameters: {gap: 3}\n"), HasSubstr("unknown key 'gap' in parameters"));
  EXPECT_THAT(refused("parameters: {target: [0, 1]}\n"), HasSubstr("target must be 0 or 1 for the whole study"));
  EXPECT_THAT(refused("parameters: {target: 1}\n"), HasSubstr("the file lacks the key models"));
  EXPECT_THAT(refused("parameters: {target: 1, window: 5}\nmodels: [mode-b]\n"),
              HasSubstr("parameter window does not support a dive with a target"));
  EXPECT_THAT(refused("parameters: {usbl_sigma: 1}\n"), HasSubstr("parameter usbl_sigma needs target: 1"));
  EXPECT_THAT(refused("parameters: {without: [sonar]}\n"), HasSubstr("without takes none, imu, dvl, depth"));
  EXPECT_THAT(refused("parameters: {estimate_dvl_scale: 1, preintegrated_dvl: [0, 1]}\n"),
              HasSubstr("does not support preintegrated_dvl"));
  EXPECT_THAT(error_of([] { parse_study("name: d\nsimulation: dvie\nseeds: 1\n", "d.yaml"); }),
              HasSubstr("d.yaml:2: simulation must be docking or dive, not 'dvie'; did you mean dive?"));
}

/// Mean NIS over thousands of readings has a narrow interval; an error of 5 % in sigma changes it by 10 %.
TEST(StatisticalDiveTrials, NisAndNeesAreConsistent) {
  const Study study = parse_study(
      "name: d\nsimulation: dive\nseeds: 12\nparameters: {minutes: 4, grade: tactical, dvl_scale: 0}\n", "d.yaml");
  std::map<std::string, std::vector<double>> values;
  for (std::size_t i = 0; i < study.trials(); ++i) {
    const TrialResult result = run_trial(study, i);
    ASSERT_EQ(result.status, "converged") << i;
    for (const char* metric : {"nis_dvl", "nis_depth", "nis_heading", "nees_velocity", "nees_bias"})
      values[metric].push_back(metric_of(result, metric));
  }
  for (const auto& [metric, degrees] : {std::pair{"nis_dvl", 3.0}, {"nis_depth", 1.0}, {"nis_heading", 3.0}}) {
    const auto mean = mean_interval(values[metric]);
    EXPECT_NEAR(mean->value / degrees, 1.0, 0.03) << metric;
  }
  for (const auto& [metric, degrees] : {std::pair{"nees_velocity", 3.0}, {"nees_bias", 6.0}})
    EXPECT_NEAR(mean_interval(values[metric])->value / degrees, 1.0, 0.5) << metric;
}

}  // namespace
}  // namespace tandem
