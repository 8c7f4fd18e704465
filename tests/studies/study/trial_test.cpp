#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/simulation/simulate_docking_files.hpp>
#include <tandem/studies/study/trial.hpp>
#include <tandem/studies/study/trial_online.hpp>
#include <tandem/studies/study/trial_sensors.hpp>
#include <tandem/studies/support/statistics.hpp>

#include "small_study.hpp"
#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

Study study_of(const std::string& rest) {
  return parse_study("name: s\nmodels: [constant-twist]\nseeds: 2\n" + rest, "s.yaml");
}

/// Expects equal results except for times.
void expect_same(const TrialResult& a, const TrialResult& b) {
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.message, b.message);
  for (std::size_t m = 0; m < trial_metrics().size(); ++m)
    if (!trial_metrics()[m].timing) {
      EXPECT_EQ(a.metrics[m], b.metrics[m]) << trial_metrics()[m].name;
    }
}

TEST(Trial, ResultDependsOnlyOnStudyAndNumber) {
  const Study study = small_study();
  const TrialResult first = run_trial(study, 7);
  EXPECT_EQ(first.status, "converged") << first.message;
  run_trial(study, 3);
  expect_same(run_trial(study, 7), first);
  EXPECT_NE(run_trial(study, 1).get("cost"), first.get("cost"));
}

TEST(Trial, RejectedTrialHasItsReason) {
  const TrialResult result = run_trial(small_study(), 2);
  EXPECT_EQ(result.status, "refused");
  EXPECT_THAT(result.message, HasSubstr("constant-velocity model has no orientation"));
  EXPECT_FALSE(result.get("at_all_error_m"));
}

TEST(Trial, WrittenFolderGivesTheSameErrors) {
  const Study study = study_of("parameters: {minutes: 3, usbl_sigma_factor: 2, waves: 0.05}\n");
  const TrialResult result = run_trial(study, 1);
  const TrialSettings settings = study.settings(study.place(1));
  const ScratchFolder folder;
  write_docking(trial_docking(settings), settings.docking, folder.path());
  const Scenario scenario = read_scenario(folder.path());
  EXPECT_DOUBLE_EQ(scenario.data.sensors[0].sigma[0], 2 * 1.72);
  const ModelResult again = evaluate_model(scenario, study.model(study.place(1)), GaussNewtonOptions{});
  ASSERT_TRUE(again.all.position);
  EXPECT_NEAR(again.all.position->mean, result.get("at_all_error_m").value(), 1e-3) << "files have five decimals";
}

TEST(Trial, DisturbedInitialGuessReachesTheSameCost) {
  const Study study = study_of("parameters: {minutes: 2, start_position: [0, 1], start_orientation: [0, 10]}\n");
  const TrialResult plain = run_trial(study, 0), disturbed = run_trial(study, 3);
  EXPECT_EQ(disturbed.status, "converged") << disturbed.message;
  EXPECT_NEAR(disturbed.get("cost").value(), plain.get("cost").value(), 1e-6 * plain.get("cost").value());
  EXPECT_NE(disturbed.get("iterations"), plain.get("iterations"));
}

TEST(Trial, NewestStatesOfAWindowHaveLargerErrors) {
  const Study study = study_of("parameters: {minutes: 4, window: [0, 20]}\n");
  const TrialResult whole = run_trial(study, 0), newest = run_trial(study, 1);
  EXPECT_EQ(newest.status, "converged") << newest.message;
  EXPECT_GT(newest.get("keyframes").value(), 0.9 * whole.get("keyframes").value());
  EXPECT_GT(newest.get("at_pose_error_m").value(), whole.get("at_pose_error_m").value());
  EXPECT_LT(newest.get("at_pose_error_m").value(), 1.0);
}

TEST(Trial, SupportsAllMethodsForTheNewestState) {
  const Study study = study_of(
      "parameters: {minutes: 4, window: [0, 30], newest: [window, hypotheses, 'kalman:0.2', 'kalman:0.2:60']}\n");
  const std::size_t online = 4;
  std::vector<TrialResult> results;
  for (std::size_t i = 0; i < 4; ++i) {
    results.push_back(run_trial(study, online + i));
    SCOPED_TRACE(i);
    EXPECT_EQ(results[i].status, "converged") << results[i].message;
    EXPECT_LT(results[i].get("at_position_error_m").value(), 6.0);
    EXPECT_LT(results[i].get("at_all_error_m"), results[i].get("ahead_5s_position_m"));
    EXPECT_LT(results[i].get("ahead_5s_position_m"), results[i].get("ahead_10s_position_m"));
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_NE(results[i].get("at_all_error_m"), results[j].get("at_all_error_m")) << j;
  }
  EXPECT_TRUE(results[0].get("at_position_orientation_deg"));
  EXPECT_FALSE(results[2].get("at_position_orientation_deg")) << "the filter estimates positions only";
  const TrialResult whole = run_trial(study, 2);
  EXPECT_FALSE(whole.get("ahead_5s_position_m")) << "a batch estimate has no newest state";
  EXPECT_EQ(whole.get("cost"), run_trial(study, 0).get("cost"));
}

TEST(StatisticalTrials, CalibrationCorrectsWrongNoise) {
  const Study study = study_of("parameters: {minutes: 8, usbl_sigma_factor: 4, calibrated: [0, 1]}\n");
  const TrialResult wrong = run_trial(study, 0), calibrated = run_trial(study, 1);
  ASSERT_EQ(calibrated.status, "converged") << calibrated.message;
  EXPECT_LT(wrong.get("nis_usbl").value(), 0.5) << "expected value 3; sigmas are four times too large";
  EXPECT_NEAR(calibrated.get("nis_usbl").value(), 3.0, 1.0);
}

TEST(Trial, NamesUnobservableDirectionsWithoutMotionModel) {
  const Study study = parse_study("name: s\nmodels: [no-motion]\nseeds: 1\nparameters: {minutes: 4}\n", "s.yaml");
  const TrialResult result = run_trial(study, 0);
  EXPECT_THAT(result.message, testing::ContainsRegex("unobservable: target [0-9]+ in .*rotation about z"));
  EXPECT_FALSE(result.get("nees_target"));
}

TEST(Trial, SolvesEveryKindOfProblem) {
  for (const char* rest : {"parameters: {minutes: 2, usbl: range-bearing, usbl_latency: 1}\n",
                           "parameters: {minutes: 2, loss: 'cauchy:2', graduated: 1, usbl_outliers: 0.2}\n",
                           "parameters: {minutes: 2, roll_pitch: off, junction: direct}\n",
                           "parameters: {minutes: 2, target_motion: helix, max_keyframes: 40}\n",
                           "solvers: [ipopt]\nparameters: {minutes: 2}\n"}) {
    SCOPED_TRACE(rest);
    if (std::string(rest).find("ipopt") != std::string::npos && !ipopt_available()) continue;
    const TrialResult result = run_trial(study_of(rest), 0);
    EXPECT_EQ(result.status, "converged") << result.message;
    EXPECT_TRUE(result.get("nees_chaser"));
    const bool robust =
        std::string(rest).find("loss") != std::string::npos;  // a robust loss downweights every measurement
    EXPECT_EQ(result.get("nis_usbl") || result.get("nis_optical"), !robust);
  }
}

/// With a hard level constraint, the target's orientation has zero variance about two axes.
TEST(Trial, HardConstraintLeavesNoNees) {
  const Study study = parse_study(
      "name: s\nmodels: ['roll-pitch:hard']\nseeds: 1\nparameters: {minutes: 2, optical_range: 1000}\n", "s.yaml");
  const TrialResult result = run_trial(study, 0);
  ASSERT_EQ(result.status, "converged") << result.message;
  EXPECT_FALSE(result.get("nees_target"));
  EXPECT_LT(result.get("nees_relative_position").value(), 30);
}

TEST(Trial, StopsOnRequest) {
  const std::atomic<bool> stop{true};
  EXPECT_EQ(run_trial(small_study(), 0, &stop).status, "interrupted");
  const TrialResult rendezvous = run_trial(study_of("parameters: {rendezvous: [decoupled]}\n"), 0, &stop);
  EXPECT_EQ(rendezvous.status, "interrupted");
  EXPECT_FALSE(rendezvous.get("docked"));
}

/// With fixes delayed by 5 s, the filter's estimate is its 5 s prediction from the undelayed case.
TEST(Trial, KalmanBaselineHandlesDelayedFixes) {
  const Study study =
      study_of("parameters: {minutes: 6, usbl_latency: [0, 5], usbl_period: 5, blind: 0, optical_range: 0}\n");
  const auto states = [&](std::size_t trial) {
    const TrialProblem problem = trial_problem(study, trial);
    return filtered_states(problem.scenario, problem.options, ConstantVelocityFilter(0.2, HUGE_VAL));
  };
  const NewestStates prompt = states(0), late = states(1);
  ASSERT_EQ(prompt.keyframes.size(), 361u);
  ASSERT_EQ(late.keyframes.size(), 356u);
  static_assert(kAhead[0] == 5.0);
  for (std::size_t k = 0; k < late.keyframes.size(); ++k) {
    ASSERT_NEAR(late.keyframes[k].t, prompt.keyframes[k].t + 5, 1e-9);
    const Vector<3> predicted = prompt.chaser[k].act(prompt.ahead[k][0].value());
    EXPECT_LT((late.target[k].position - predicted).norm(), 1e-9) << late.keyframes[k].t;
  }
}

/// In the plane, poses have three degrees of freedom. Disturbed initial guesses work as in space.
TEST(Trial, PlanarTrialsAreConsistent) {
  const Study study = parse_study(
      "name: s\nmodels: [constant-twist, mode-b]\nseeds: 1\nparameters: {minutes: 4, planar: 1, optical_range: 20, "
      "start_position: [0, 1], start_orientation: 5}\n",
      "s.yaml");
  for (std::size_t i = 0; i < study.trials(); ++i) {
    const TrialResult result = run_trial(study, i);
    ASSERT_EQ(result.status, "converged") << result.message;
    EXPECT_NEAR(result.get("nis_optical").value(), 3, 0.6);
    EXPECT_LT(result.get("nees_chaser").value(), 16.3) << "99.9 % of χ² with 3 degrees";
    for (const char* metric : {"nees_target", "nees_relative_pose", "nees_relative_position", "nis_usbl"})
      EXPECT_TRUE(result.get(metric)) << metric;
    EXPECT_EQ(result.get("upside_down"), 0.0);
    EXPECT_NEAR(result.get("cost").value(), run_trial(study, i % 2).get("cost").value(), 1e-4);
  }
}

/// If the model matches the simulation, the 95 % intervals over trials contain the expected NEES and NIS. The interval
/// of the optical NIS is narrow: an error of 10 % in sigma would change it by 20 %.
TEST(StatisticalTrials, NisAndNeesAreConsistent) {
  const Study study = parse_study(
      "name: s\nmodels: [constant-twist]\nseeds: 40\n"
      "parameters: {minutes: 4, optical_range: 1000, optical_period: 1, blind: 0, waves: 0.03}\n",
      "s.yaml");
  std::map<std::string, std::vector<double>> values;
  for (std::size_t i = 0; i < study.trials(); ++i) {
    const TrialResult result = run_trial(study, i);
    ASSERT_EQ(result.status, "converged") << i;
    for (const char* metric : {"nees_chaser", "nis_optical", "inside_three_sigma"})
      values[metric].push_back(result.get(metric).value());
  }
  const auto chaser = mean_interval(values["nees_chaser"]), nis = mean_interval(values["nis_optical"]);
  EXPECT_LT(chaser->low, 6.0);
  EXPECT_GT(chaser->high, 6.0);
  EXPECT_NEAR(nis->value, 6.0, 0.3);
  EXPECT_LT(nis->high - nis->low, 0.3);
  EXPECT_GT(mean_interval(values["inside_three_sigma"])->value, 0.99);
}

TEST(TrialMetrics, ErrorsByKeyframeType) {
  std::vector<KeyframeError> errors;
  for (const KeyframeType type : keyframe_types) {
    KeyframeError error{double(errors.size()), type, {}, {}, {}, {}};
    error.position = double(errors.size());
    error.orientation = 10.0 * double(errors.size());
    errors.push_back(error);
  }
  errors[0].raw_position = 7;
  errors[1].raw_orientation = 8;
  TrialResult result;
  add_errors(errors, result);
  EXPECT_EQ(result.get("at_position_error_m"), 0.0);
  EXPECT_EQ(result.get("at_pose_error_m"), 1.0);
  EXPECT_EQ(result.get("at_partial_error_m"), 2.0);
  EXPECT_EQ(result.get("at_none_orientation_deg"), 30.0);
  EXPECT_EQ(result.get("at_all_error_m"), 1.5);
  EXPECT_EQ(result.get("at_all_keyframes"), 4.0);
  EXPECT_EQ(result.get("raw_at_position_error_m"), 7.0);
  EXPECT_EQ(result.get("raw_at_pose_orientation_deg"), 8.0);
}

/// Each sensor of a trial has an NIS with its number of residual rows as degrees of freedom.
TEST(TrialSensors, HaveRowsOfTheirResiduals) {
  const auto text = [](const TrialSettings& settings, Simulated simulated) {
    std::string all;
    for (const TrialSensor& sensor : trial_sensors(settings, simulated)) {
      metric_index(nis_metric(sensor.name));  // throws without such a metric
      all += sensor.name + " " + std::to_string(sensor.rows) + " ";
    }
    return all;
  };
  TrialSettings settings;
  EXPECT_EQ(text(settings, Simulated::docking), "usbl 3 optical 6 ");
  EXPECT_EQ(text(settings, Simulated::dive), "dvl 3 depth 1 gps 3 heading 3 ");
  settings.docking.usbl = UsblKind::range_bearing;
  settings.docking.planar = settings.dive.target = true;
  EXPECT_EQ(text(settings, Simulated::docking), "usbl 2 optical 3 ");
  EXPECT_EQ(text(settings, Simulated::dive), "usbl 3 dvl 3 depth 1 gps 3 heading 3 ");
}

TEST(TrialMetrics, ErrorsInAndAfterGaps) {
  std::vector<KeyframeError> errors;
  for (int t = 0; t <= 50; ++t) {
    KeyframeError error{double(t), KeyframeType::none, {}, {}, {}, {}};
    error.position = t < 10 ? 1 : t <= 20 ? 5 + t : t <= 30 ? 3 : 1;
    errors.push_back(error);
  }
  TrialResult result;
  add_gap_errors(errors, {{10, 20}}, 10, result);
  EXPECT_DOUBLE_EQ(result.get("gap_position_m").value(), 20);
  EXPECT_DOUBLE_EQ(result.get("gap_worst_m").value(), 25);
  EXPECT_DOUBLE_EQ(result.get("after_gap_position_m").value(), 3);
  EXPECT_FALSE(result.get("at_position_error_m"));
  EXPECT_THAT(error_of([&] { result.get("no_such"); }), HasSubstr("no metric no_such"));
}

/// Recovers the time constant of a first-order Gauss-Markov process.
TEST(TrialMetrics, CorrelationTime) {
  std::vector<KeyframeError> errors;
  Vector<3> e = Vector<3>::Zero();
  unsigned seed = 1;
  const auto draw = [&] { return double((seed = seed * 1664525u + 1013904223u) >> 8) / double(1 << 24) - 0.5; };
  for (int t = 0; t < 20000; ++t) {
    e = std::exp(-1.0 / 8) * e + Vector<3>{draw(), draw(), draw()};
    KeyframeError error{double(t), KeyframeType::none, {}, {}, {}, {}};
    error.position_vector = e;
    errors.push_back(error);
  }
  EXPECT_NEAR(correlation_time(errors).value(), 8, 1);
}

}  // namespace
}  // namespace tandem
