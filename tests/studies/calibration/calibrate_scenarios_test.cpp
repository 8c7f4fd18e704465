#include <algorithm>
#include <map>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/studies/calibration/calibrate_scenarios.hpp>
#include <tandem/studies/calibration/calibration_problem.hpp>
#include <tandem/studies/calibration/calibration_report.hpp>
#include <tandem/studies/scenario/builtin_scenarios.hpp>
#include <tandem/studies/simulation/simulate_dive_files.hpp>
#include <tandem/studies/simulation/simulate_docking_files.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

Scenario simulated(unsigned seed, double duration) {
  const ScratchFolder scratch;
  DockingOptions options;
  options.seed = seed;
  options.minutes = duration / 60;
  write_docking(simulate_docking(options), options, scratch.path());
  return read_scenario(scratch.path());
}

std::string rejection(std::vector<Scenario> scenarios, const ScenarioCalibrationOptions& options) {
  try {
    calibrate_scenarios(std::move(scenarios), options);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

const CalibratedParameter& find(const ScenarioCalibration& c, const std::string& name) {
  return *std::find_if(c.parameters.begin(), c.parameters.end(), [&](const auto& p) { return p.name == name; });
}

TEST(CalibrateScenarios, RecoversTheNoiseFromAWrongGivenOne) {
  Scenario scenario = simulated(5, 240);
  const Eigen::VectorXd truth = scenario.data.sensors[1].sigma;
  ASSERT_EQ(scenario.data.sensors[1].name, "optical");
  scenario.data.sensors[1].sigma *= 2;
  ScenarioCalibrationOptions options;
  options.free = {"optical"};
  options.folds = 2;
  const ScenarioCalibration found = calibrate_scenarios({scenario}, options);
  ASSERT_THAT(found.parameters, SizeIs(6));
  for (int i = 0; i < 6; ++i) {
    const CalibratedParameter& p = found.parameters[std::size_t(i)];
    EXPECT_TRUE(p.result.identifiable) << p.name;
    EXPECT_NEAR(p.found() / truth[i], 1, 4 * p.result.log_error + 0.1) << p.name;
  }
  EXPECT_EQ(find(found, "optical.rz").given, 2 * truth[5]);
  EXPECT_TRUE(found.recommended()) << report(found);
  ASSERT_THAT(found.noise, SizeIs(1));
  EXPECT_EQ(found.noise[0].name, "optical");
  EXPECT_NEAR(found.noise[0].sigmas[0], found.parameters[0].found(), 1e-12);
  ASSERT_THAT(found.after, testing::Not(testing::IsEmpty()));
  for (const Misfit& m : found.after)
    if (m.parameter.starts_with("optical")) {
      EXPECT_NEAR(m.standard_deviation(), 1, 0.15) << m.parameter;
    }
}

TEST(CalibrateScenarios, KeepsAParameterThatRunsToTheLimit) {
  Scenario scenario = simulated(5, 240);
  const double truth = scenario.data.sensors[1].sigma[0];
  scenario.data.sensors[0].sigma[0] *= 1e5;
  scenario.data.sensors[1].sigma[0] *= 2;
  ScenarioCalibrationOptions options;
  options.free = {"usbl.x", "optical.x"};
  options.prior = 100;
  options.folds = 0;
  const ScenarioCalibration found = calibrate_scenarios({scenario}, options);
  const CalibratedParameter& kept = find(found, "usbl.x");
  EXPECT_TRUE(kept.result.at_limit);
  EXPECT_EQ(kept.keep_reason, KeepReason::at_limit);
  EXPECT_EQ(kept.found(), kept.given);
  for (const NoiseEntry& entry : found.noise)
    if (entry.name == "usbl") {
      EXPECT_EQ(entry.sigmas[0], kept.given);
    }
  EXPECT_NEAR(find(found, "optical.x").found() / truth, 1, 0.2) << "the other parameter is calibrated";
  EXPECT_THAT(report(found), HasSubstr("ran to the limit"));
}

/// Adds a copy of the USBL with a bias of 5 m in x only, and a misalignment that is zero.
TEST(CalibrateScenarios, RecommendsConstantsThatImproveHeldOutPrediction) {
  Scenario scenario = simulated(5, 240);
  TargetSensor sonar = scenario.data.sensors[0];
  sonar.name = "sonar";
  for (Measurement& m : sonar.measurements) m.position.x() += 5;
  sonar.error = SystematicError{Vector<3>::Constant(5.0)};
  scenario.data.sensors.push_back(sonar);
  scenario.data.sensors[0].error = SystematicError{.misalignment_sigma = 0.1};
  ScenarioCalibrationOptions options;
  options.noise = false;
  const ScenarioCalibration found = calibrate_scenarios({scenario}, options);
  const auto of = [&](const std::string& name) {
    const auto at = std::find_if(found.constants.begin(), found.constants.end(),
                                 [&](const CalibratedConstant& c) { return c.found.name == name; });
    return at == found.constants.end() ? SystematicErrorEstimate{} : at->found;
  };
  EXPECT_EQ(of("sonar.bias.1").verdict(), SystematicErrorVerdict::improves_prediction);
  EXPECT_NEAR(of("sonar.bias.1").value, 5, 3 * of("sonar.bias.1").sigma);
  ASSERT_TRUE(of("usbl.misalignment.rz").held_out.has_value());
  EXPECT_LT(of("usbl.misalignment.rz").held_out->gain, 0.2 * of("sonar.bias.1").held_out->gain);
  EXPECT_THAT(report(found), HasSubstr("identifiable; improves the prediction of held-out data: recommended"));
  options.folds = 0;
  for (const CalibratedConstant& c : calibrate_scenarios({scenario}, options).constants)
    EXPECT_FALSE(c.found.held_out.has_value()) << c.found.name;
}

TEST(CalibrateScenarios, CrossValidatesConstantsPerScenarioDespiteEqualNames) {
  std::vector<Scenario> scenarios = {simulated(5, 240), simulated(6, 240)};
  for (Scenario& scenario : scenarios) {
    scenario.name = "run";
    scenario.data.sensors[0].error = SystematicError{.scale_sigma = 0.05};
  }
  ScenarioCalibrationOptions options;
  options.noise = false;
  options.folds = 3;
  const auto both = calibrate_scenarios(scenarios, options).constants;
  ASSERT_EQ(both.size(), 2u);
  ASSERT_TRUE(both[0].found.held_out && both[1].found.held_out);
  EXPECT_NE(both[0].found.held_out->gain, both[1].found.held_out->gain);
}

TEST(CalibrateScenarios, ReportsOneSidedBounds) {
  ScenarioCalibration c;
  CalibratedParameter low{"usbl.x", 2.0, {.name = "usbl.x", .factor = 0.2, .bounded = true}};
  low.result.flat_from = 0.1, low.result.flat_to = 0.5;
  CalibratedParameter high = low;
  high.name = "usbl.y";
  high.result.factor = 5;
  high.result.flat_from = 3, high.result.flat_to = 30;
  CalibratedParameter beyond = low;
  beyond.result.factor = 0.7;
  c.parameters = {low, high, beyond};
  EXPECT_THAT(report(c),
              testing::AllOf(HasSubstr("at most 1 by the data; the lower bound comes from the prior"),
                             HasSubstr("at least 6 by the data; the upper bound comes from the prior"),
                             HasSubstr("at most 1 by the data; the prior pulls the estimate beyond this bound")));
}

TEST(CalibrateScenarios, UsesTheGivenNoiseOfTheFirstScenario) {
  std::vector<Scenario> both = {simulated(5, 60), simulated(6, 60)};
  both[1].data.sensors[0].sigma *= 5;
  ScenarioCalibrationOptions options;
  options.free = {"usbl.x"};
  options.folds = 0;
  const ScenarioCalibration found = calibrate_scenarios(both, options);
  ASSERT_THAT(found.parameters, SizeIs(1));
  EXPECT_EQ(found.parameters[0].given, both[0].data.sensors[0].sigma[0]);
  const auto n = both[0].data.sensors[0].measurements.size() + both[1].data.sensors[0].measurements.size();
  EXPECT_EQ(found.parameters[0].result.rows, double(n));
  EXPECT_THAT(report(found), HasSubstr("No cross-validation"));
  ScenarioCalibration stopped = found;
  stopped.cut_short = true;
  EXPECT_THAT(report(stopped), HasSubstr("Stopped before cross-validation was complete"));
}

TEST(CalibrateScenarios, EntriesHaveTheComponentsOfTheFiles) {
  Scenario scenario = simulated(5, 60);
  const auto entries = calibrated_entries(scenario);
  ASSERT_FALSE(entries.empty());
  EXPECT_EQ(entries[0].name, "usbl");
  EXPECT_THAT(entries[0].components, ElementsAre("x", "y", "z"));
  EXPECT_THAT(entries[0].angle, ElementsAre(false, false, false));
  EXPECT_EQ(entries[1].name, "optical");
  EXPECT_THAT(entries[1].angle, ElementsAre(false, false, false, true, true, true));
  for (const CalibratedEntry& e : entries) EXPECT_NE(e.name, "prior");
  scenario.frame = Frame::ned_frd();
  scenario.data.noise.constant_velocity = Vector<3>(1, 2, 3);  // east, north, up
  for (const CalibratedEntry& e : calibrated_entries(scenario))
    if (e.name == "constant_velocity") {
      EXPECT_THAT(e.sigmas, ElementsAre(2, 1, 3)) << "north, east, down";
      EXPECT_THAT(e.row, ElementsAre(1, 0, 2));
    }
}

TEST(CalibrateScenarios, RejectsInvalidOptions) {
  const Scenario scenario = simulated(5, 60);
  ScenarioCalibrationOptions options;
  options.free = {"usbL.x"};
  EXPECT_THAT(rejection({scenario}, options),
              testing::AllOf(HasSubstr("--free: unknown name 'usbL.x'; did you mean usbl.x?"),
                             HasSubstr("usbl (x, y, z), optical (x, y, z, rx, ry, rz), odometry (")));
  options.free = {"usbl.scal"};
  EXPECT_THAT(rejection({scenario}, options), HasSubstr("'usbl.scal'; did you mean usbl.scale?"));
  options.free = {"acceleration"};
  EXPECT_THAT(rejection({scenario}, options), HasSubstr("no residual"));
  options.free = {};
  options.folds = 1;
  EXPECT_THAT(rejection({scenario}, options), HasSubstr("--folds 1"));
  options.folds = 0;
  Scenario other = scenario;
  other.data.sensors[1].name = "camera";
  other.name = "the other";
  EXPECT_THAT(rejection({scenario, other}, options), HasSubstr("the other has no pose sensor optical"));
  Scenario few = scenario;
  for (TargetSensor& s : few.data.sensors) s.measurements.resize(std::min<std::size_t>(s.measurements.size(), 1));
  EXPECT_THAT(rejection({few}, options), HasSubstr("too few for"));
  EXPECT_THAT(rejection({}, options), HasSubstr("no scenario"));
}

/// A dive whose true noise is half of the given noise.
Scenario dive_with_small_noise() {
  const ScratchFolder scratch;
  DiveOptions options;
  options.minutes = 3;
  options.dvl_scale = false;
  write_dive(simulate_dive(options), options, scratch.path());
  Scenario scenario = read_scenario(scratch.path());
  for (EgoSensor& sensor : scenario.navigation->sensors) sensor.sigma *= 2;
  return scenario;
}

TEST(LongCalibrateScenarios, AcceptsSmallerNoiseOfDeadReckoningOnlyWithFixes) {
  ScenarioCalibrationOptions options;
  options.free = {"dvl", "gps"};
  options.folds = 2;
  const Scenario dive = dive_with_small_noise();
  const ScenarioCalibration kept = calibrate_scenarios({dive}, options);
  for (const char* name : {"dvl.x", "dvl.y", "dvl.z"}) {
    EXPECT_EQ(find(kept, name).keep_reason, KeepReason::untested) << name;
    EXPECT_EQ(find(kept, name).found(), find(kept, name).given) << name;
  }
  EXPECT_EQ(find(kept, "gps.x").keep_reason, KeepReason::none) << "fixes test each other";
  EXPECT_THAT(report(kept), HasSubstr("longest gap without a position fix"));
  ASSERT_THAT(kept.noise, SizeIs(2)) << "kept parameters are in the file with the given values";
  EXPECT_THAT(kept.noise[0].sigmas, testing::Each(find(kept, "dvl.x").given));

  // Adds fixes throughout, taken from the navigation without them.
  Scenario fixed = dive;
  const Navigation path = navigate(*dive.navigation);
  for (EgoSensor& sensor : fixed.navigation->sensors)
    if (sensor.type == EgoSensorType::gps) {
      sensor.measurements.clear();
      for (const Stamped<EgoState>& k : path.states)
        sensor.measurements.push_back({k.t, (k.value.pose * sensor.mount).translation()});
    }
  options.free = {"dvl"};
  EXPECT_EQ(find(calibrate_scenarios({fixed}, options), "dvl.x").keep_reason, KeepReason::none);

  options.folds = 0;
  const CalibratedParameter untested = find(calibrate_scenarios({dive}, options), "dvl.x");
  EXPECT_EQ(untested.keep_reason, KeepReason::none) << "without folds, no parameter counts as untested";
  EXPECT_NEAR(untested.result.factor, 0.5, 0.1);
}

TEST(CalibrateScenarios, ReportsTheCrossValidationOfConstantsWithoutNoise) {
  ScenarioCalibration c;
  c.scenarios = {"here"};
  EXPECT_THAT(report(c), HasSubstr("No noise was calibrated, so there was no cross-validation."));
  c.constants.resize(1);
  c.constants[0].found.held_out.emplace();
  EXPECT_THAT(report(c), HasSubstr("No noise was calibrated; cross-validation tested the systematic errors."));
}

TEST(CalibrateScenarios, ThrowsIfStoppedBeforeTheFirstSolve) {
  const std::atomic<bool> stop = true;
  ScenarioCalibrationOptions options;
  options.stop = Stop(&stop);
  EXPECT_THROW(calibrate_scenarios({simulated(5, 60)}, options), Stopped);
}

TEST(CalibrateScenarios, ReturnsThePartialResultWhenStopped) {
  std::atomic<bool> stop = false;
  ScenarioCalibrationOptions options;
  options.stop = Stop(&stop);
  options.progress = [&stop](const std::string&) { stop = true; };
  const ScenarioCalibration found = calibrate_scenarios({simulated(5, 60)}, options);
  EXPECT_FALSE(found.summary.converged());
  EXPECT_FALSE(found.parameters.empty());
  EXPECT_EQ(found.folds, 0);
  ASSERT_EQ(found.noise.size(), found.given_noise.size());
  for (std::size_t i = 0; i < found.noise.size(); ++i)
    EXPECT_EQ(found.noise[i].sigmas, found.given_noise[i].sigmas) << "only validated noise";
  EXPECT_THAT(report(found), testing::AllOf(HasSubstr("stopped early"), testing::Not(HasSubstr("not identifiable"))));
}

}  // namespace
}  // namespace tandem
