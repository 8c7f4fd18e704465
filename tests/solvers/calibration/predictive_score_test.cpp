#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/problem/parallel_tasks.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/calibration/select_model.hpp>

#include "walk.hpp"

namespace tandem::testing {
namespace {

ScoreOptions blocks_of(double seconds) {
  ScoreOptions options;
  options.block_length = seconds;
  return options;
}

/// The fixes of a walk, one each second.
std::vector<ScoredMeasurement> measurements_of(const Walk& walk) {
  std::vector<ScoredMeasurement> all;
  for (std::size_t i = 0; i < walk.fixes.rows.size(); ++i)
    all.push_back({walk.fixes.rows[i].block, 0, 0, double(i), {{0, 1}}});
  return all;
}

PredictiveScore score_of(Walk& walk, const ScoreOptions& options = blocks_of(5)) {
  Problem* const one[] = {&walk.problem};
  return predictive_score(one, measurements_of(walk), options);
}

PredictiveScore score_of(double step_sigma, double fix_sigma, double outliers = 0) {
  Walk walk(3, 300, outliers);
  walk.given_step_sigma = step_sigma;
  walk.given_fix_sigma = fix_sigma;
  walk.build();
  return score_of(walk);
}

/// ∫ exp(log density) = 1, and the expected score of Gaussian errors is stationary at the right variance.
TEST(RobustLogDensity, IsADensityThatIsBestAtTheRightVariance) {
  double integral = 0;
  std::array<double, 3> expected{};  // at variances 0.95, 1 and 1.05
  const double h = 0.01;
  for (double r = -60; r < 60; r += h) {
    integral += h * std::exp(detail::robust_log_density(r * r, 0, 1));
    const double normal = std::exp(-0.5 * r * r) / std::sqrt(2 * M_PI);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const double variance = 0.95 + 0.05 * double(i);
      expected[i] += h * normal * detail::robust_log_density(r * r / variance, std::log(variance), 1);
    }
  }
  EXPECT_NEAR(integral, 1, 1e-4);
  EXPECT_GT(expected[1], expected[0]);
  EXPECT_GT(expected[1], expected[2]);
}

TEST(PredictiveScore, IsLargestWithTheTrueNoise) {
  const PredictiveScore right = score_of(0.5, 1.0);
  ASSERT_TRUE(right.valid()) << right.why;
  EXPECT_EQ(right.parts.size(), 2 * 300u) << "across gaps and short gaps";
  for (const auto& [step, fix] : {std::pair{1.5, 1.0}, {0.15, 1.0}, {0.5, 3.0}, {0.5, 0.3}}) {
    const ScoreGain gain = score_gain(score_of(step, fix), right);
    EXPECT_GT(gain.gain, gain.standard_error) << step << " " << fix;
    EXPECT_EQ(gain.blocks, 60);
  }
  const auto coverage = right.coverage();
  for (std::size_t i = 0; i < coverage.size(); ++i)
    EXPECT_NEAR(coverage[i].share, kCoverageLevels[i], 0.01 + 3 * coverage[i].standard_error);
}

/// One gross outlier costs less than ten times its log density relative to the inliers', and does not decide.
TEST(PredictiveScore, IsNotDecidedByOutliers) {
  const ScoreGain gain = score_gain(score_of(0.5, 3.0, 0.01), score_of(0.5, 1.0, 0.01));
  EXPECT_GT(gain.gain, gain.standard_error);
}

TEST(PredictiveScore, LeavesTheProblemSolvedWithAllMeasurements) {
  Walk walk(4, 60);
  walk.build();
  const PredictiveScore first = score_of(walk);
  const PredictiveScore second = score_of(walk);
  EXPECT_NEAR(first.total(), second.total(), 1e-6);
  EXPECT_EQ(walk.problem.noise(walk.fixes.rows[7].block).covariance_matrix()(0, 0), 1);
}

TEST(PredictiveScore, PredictsAheadFromEarlierMeasurementsOnly) {
  Walk walk(5, 100);
  walk.build();
  ScoreOptions options = blocks_of(5);
  options.ahead = 3;
  const PredictiveScore score = score_of(walk, options);
  ASSERT_TRUE(score.valid()) << score.why;
  EXPECT_EQ(score.parts.size(), 2 * 100u + 6 * 3) << "three measurements after each of six origins";
}

/// Six origins that are 14 s apart predict some measurements twice.
TEST(PredictiveScore, OverlappingPredictionsCountOnceAndGainNothingOverThemselves) {
  Walk walk(5, 100);
  walk.build();
  ScoreOptions options = blocks_of(5);
  options.ahead = 20;
  const PredictiveScore all = score_of(walk, options);
  ASSERT_TRUE(all.valid()) << all.why;
  std::set<ScoredPart::Key> keys;
  for (const ScoredPart& part : all.parts) keys.insert(part.key);
  EXPECT_EQ(keys.size(), all.parts.size());
  options.start = &all.solutions;
  for (const int every : {1, 3}) {
    options.every = every;
    const PredictiveScore again = completed(score_of(walk, options), all);
    for (std::size_t i = 0; i < all.parts.size(); ++i)
      EXPECT_NEAR(again.parts[i].log_density, all.parts[i].log_density, 1e-6);
  }
  // Each log density is near −1.5, averaged over three kinds of predictions.
  EXPECT_NEAR(all.total(), score_of(walk).total(), 0.2 * -all.total());
}

TEST(PredictiveScore, DoesNotDependOnTheStart) {
  Walk walk(3, 100);
  walk.build();
  ScoreOptions options = blocks_of(5);
  const PredictiveScore cold = score_of(walk, options);
  EXPECT_EQ(cold.solutions.size(), 11u) << "five folds of gaps, five of short gaps, and all measurements";
  options.start = &cold.solutions;
  const PredictiveScore warm = score_of(walk, options);
  ASSERT_EQ(warm.parts.size(), cold.parts.size());
  EXPECT_NEAR(warm.total(), cold.total(), 1e-6 * std::abs(cold.total()));
}

TEST(PredictiveScore, CountsDiscardedMeasurementsAsInTheReference) {
  const PredictiveScore reference = score_of(0.5, 1.0);
  PredictiveScore some = score_of(0.5, 0.3);
  some.parts.erase(some.parts.begin(), some.parts.begin() + 100);
  const PredictiveScore all = completed(some, reference);
  ASSERT_EQ(all.parts.size(), reference.parts.size());
  EXPECT_EQ(all.parts.front().log_density, reference.parts.front().log_density);
  EXPECT_EQ(all.parts.back().log_density, some.parts.back().log_density);
  EXPECT_THROW(score_gain(some, reference), BadInputError);
}

TEST(PredictiveScore, RefusesBadOptions) {
  Walk walk(6, 10);
  walk.build();
  Problem* const one[] = {&walk.problem};
  EXPECT_THROW(predictive_score(one, measurements_of(walk), blocks_of(0)), BadInputError);
  std::vector<ScoredMeasurement> wrong = measurements_of(walk);
  wrong[0].parts = {{0, 2}};
  EXPECT_THROW(predictive_score(one, wrong, blocks_of(2)), BadInputError);
}

TEST(ScoreBlockLength, FollowsTheCorrelationTimeWithinTheRecording) {
  std::vector<double> times;
  for (int i = 0; i <= 200; ++i) times.push_back(i);
  EXPECT_EQ(score_block_length(0, times), 2);
  EXPECT_EQ(score_block_length(4, times), 12);
  EXPECT_EQ(score_block_length(100, times), 25) << "eight blocks";
  times.erase(times.begin() + 50, times.begin() + 65);
  EXPECT_EQ(score_block_length(0, times), 16) << "the longest gap";
  EXPECT_EQ(score_block_length(1, {0, 1, 2, 3}), 0) << "too short";
}

/// A constant position that two sensors measure, the second with a bias that drifts or with white errors only.
struct TwoSensors {
  std::vector<double> first, second;

  explicit TwoSensors(double drift) {
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal;
    double bias = drift * normal(random);
    const double keep = std::exp(-1.0 / 10);
    for (int i = 0; i < 200; ++i) {
      bias = keep * bias + drift * std::sqrt(1 - keep * keep) * normal(random);
      first.push_back(normal(random));
      second.push_back(bias + normal(random));
    }
  }

  /// Builds the problem; with the setting "drift", the second sensor has a Gauss-Markov bias of this size.
  BuiltModel build(const ModelSettings& settings) const {
    BuiltModel model;
    const auto problem = std::make_shared<Problem>();
    model.problems.push_back(problem);
    const auto x = problem->add(Number());
    problem->minimize(Prior<Number>{Number()}, {10.0}, {x});
    const auto at = settings.find("drift");
    const double size = at == settings.end() ? 0 : std::stod(at->second);
    if (size < 0) throw Error("a negative size");
    const double keep = std::exp(-1.0 / 10);
    std::optional<Variable<Number>> previous;
    for (std::size_t i = 0; i < first.size(); ++i) {
      const auto fix = [&](double z, const Variable<Number>& a, int sensor) {
        const Block block = problem->minimize(Prior<Number>{Number(Vector<1>(z))}, {1.0}, {a});
        model.measurements.push_back({block, 0, sensor, double(i), {{0, 1}}});
      };
      fix(first[i], x, 0);
      if (size == 0) {
        fix(second[i], x, 1);
        continue;
      }
      // y = x + bias, where the bias of the last step decays.
      const auto y = problem->add(Number());
      problem->minimize(RelativePose<Number>{Number()}, {size}, {x, y});
      if (previous)
        problem->minimize(RelativePose<Number>{Number()}, {size * std::sqrt(2 * (1 - keep))}, {*previous, y});
      previous = y;
      fix(second[i], y, 1);
    }
    return model;
  }
};

ModelSelection selected(double drift) {
  const TwoSensors data(drift);
  ModelSelectionOptions options;
  options.score.block_length = 10;
  const std::vector<ModelChange> candidates = {
      {{{"drift", "2"}}, "a drifting bias", 1}, {{{"drift", "0.3"}}, "a small one", 1}, {{{"drift", "-1"}}, "", 1}};
  return select_model([&](const ModelSettings& settings) { return data.build(settings); }, candidates, options);
}

TEST(SelectModel, ChoosesADriftingBiasThatIsThere) {
  const ModelSelection found = selected(2);
  EXPECT_EQ(found.settings, (ModelSettings{{"drift", "2"}}));
  EXPECT_GT(found.gain.gain, 2 * found.gain.standard_error);
  const auto with = [&](ModelVerdict verdict) {
    return std::find_if(found.steps.begin(), found.steps.end(),
                        [&](const ModelStep& step) { return step.verdict == verdict; });
  };
  ASSERT_NE(with(ModelVerdict::kept), found.steps.end());
  EXPECT_EQ(with(ModelVerdict::kept)->change.settings, found.settings);
  ASSERT_NE(with(ModelVerdict::impossible), found.steps.end());
  EXPECT_EQ(with(ModelVerdict::impossible)->why, "a negative size");
}

TEST(SelectModel, KeepsTheSimplestModelOfWhiteData) {
  const ModelSelection found = selected(0);
  EXPECT_TRUE(found.settings.empty());
  EXPECT_EQ(found.gain.gain, 0);
}

/// A model that predicts best is worth nothing to users whose commands cannot solve it.
TEST(SelectModel, KeepsTheBestModelThatCanBeUsed) {
  const TwoSensors data(2);
  ModelSelectionOptions options;
  options.score.block_length = 10;
  options.why_unusable = [](const ModelSettings& settings) {
    return settings.at("drift") == "2" ? std::string("not solved") : std::string();
  };
  const ModelSelection found = select_model([&](const ModelSettings& settings) { return data.build(settings); },
                                            {{{{"drift", "2"}}, "", 1}, {{{"drift", "1"}}, "", 1}}, options);
  EXPECT_EQ(found.settings, (ModelSettings{{"drift", "1"}}));
  const auto unusable =
      std::find_if(found.steps.begin(), found.steps.end(), [](const ModelStep& step) { return !step.why.empty(); });
  ASSERT_NE(unusable, found.steps.end());
  EXPECT_EQ(unusable->change.settings, (ModelSettings{{"drift", "2"}}));
  EXPECT_EQ(unusable->verdict, ModelVerdict::impossible);
  EXPECT_EQ(unusable->why, "not solved");
}

TEST(SelectModel, DoesNotDependOnTheNumberOfThreads) {
  const ModelSelection several = selected(2);
  const ThreadLimit one(1);
  const ModelSelection single = selected(2);
  EXPECT_EQ(several.gain.gain, single.gain.gain);
  EXPECT_EQ(several.steps.size(), single.steps.size());
}

TEST(SelectModel, ThrowsIfTheFirstModelCannotBeBuilt) {
  ModelSelectionOptions options;
  options.score.block_length = 10;
  EXPECT_THROW(select_model([](const ModelSettings&) -> BuiltModel { throw Error("nothing"); }, {}, options), Error);
}

TEST(SelectModel, EndsWithTheBestModelSoFarIfStopped) {
  const TwoSensors data(2);
  std::atomic<bool> stop = false;
  ModelSelectionOptions options;
  options.score.block_length = 10;
  options.stop = Stop(&stop);
  options.progress = [&](int, double) { stop = true; };
  const ModelSelection found = select_model([&](const ModelSettings& settings) { return data.build(settings); },
                                            {{{{"drift", "2"}}, "", 1}}, options);
  EXPECT_TRUE(found.cut_short);
  EXPECT_TRUE(found.found.valid());
}

}  // namespace
}  // namespace tandem::testing
