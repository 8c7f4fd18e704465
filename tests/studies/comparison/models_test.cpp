#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/comparison/models.hpp>
#include <tandem/studies/comparison/models_report.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TrackingOptions options_of(const std::string& spec, const TrackingOptions& base = {}) {
  return parse_model_spec("--models", spec, base).options;
}
std::string spec_error(const std::string& spec) {
  return error_of([&] { parse_model_spec("--models", spec, {}); });
}

TEST(ModelSpec, ParsesModelsConstraintsAndHorizons) {
  EXPECT_EQ(options_of("mode-b").mode, Mode::B);
  EXPECT_EQ(options_of("steady-course").model, MotionModel::steady_course);
  EXPECT_EQ(options_of("multi-horizon").horizons.size(), 3u);

  const TrackingOptions o =
      options_of("constant-twist+non-holonomic:soft+surge:-1,2.5:soft+yaw-rate:0.2:soft+horizons:1,2:3");
  EXPECT_EQ(o.model, MotionModel::constant_twist);
  EXPECT_EQ(o.non_holonomic, Role::soft);
  EXPECT_EQ(o.limits, Role::soft);
  EXPECT_EQ(o.surge->lower[0], -1);
  EXPECT_EQ(o.surge->upper[0], 2.5);
  EXPECT_EQ(*o.max_yaw_rate, 0.2);
  ASSERT_EQ(o.horizons.size(), 2u);
  EXPECT_EQ(o.horizons[1].back, 2);
  EXPECT_EQ(o.horizons[1].ahead, 3);
}

TEST(ModelSpec, DefaultsToHardRoleAndBaseLimits) {
  TrackingOptions base;
  base.surge = between(0.5, 2);
  EXPECT_FALSE(options_of("constant-twist", base).surge) << "the model does not name the limit";
  const TrackingOptions o = options_of("surge+yaw-rate", base);
  EXPECT_EQ(o.limits, Role::hard);
  EXPECT_EQ(o.surge->lower[0], 0.5);
  EXPECT_EQ(*o.max_yaw_rate, 0.3);
  EXPECT_EQ(options_of("surge:hard").surge->lower[0], 0);
  EXPECT_EQ(options_of("surge:1,inf").surge->lower[0], 1);
  const TrackingOptions all = options_of("all:soft");
  EXPECT_TRUE(all.surge && all.max_yaw_rate);
  EXPECT_EQ(all.non_holonomic, Role::soft);
  EXPECT_EQ(all.roll_pitch, Role::soft);
}

TEST(ModelSpec, HelpListsAllWords) {
  const std::string help = model_spec_words();
  for (const MotionModel model : motion_models) EXPECT_THAT(help, HasSubstr(std::string(name(model))));
  for (const char* word : {"mode-b", "multi-horizon", "non-holonomic", "roll-pitch", "surge:MIN,MAX", "yaw-rate:MAX"})
    EXPECT_THAT(help, HasSubstr(word));
}

TEST(ModelSpec, ParsesListsWithCommasInNumbers) {
  std::vector<std::string> names;
  for (const NamedModel& model :
       parse_model_list("--models", "mode-b,surge:0,inf:soft,surge:-1,2.5+horizons:1,2:3, all", {}))
    names.push_back(model.name);
  EXPECT_THAT(names, ElementsAre("mode-b", "surge:0,inf:soft", "surge:-1,2.5+horizons:1,2:3", "all"));
}

TEST(ModelSpec, RejectsInvalidSpecs) {
  EXPECT_THAT(spec_error("constant-twits"), HasSubstr("did you mean constant-twist?"));
  EXPECT_THAT(spec_error("constant-twist+nonholonomic"), HasSubstr("did you mean non-holonomic?"));
  EXPECT_THAT(spec_error("non-holonomic:haard"), HasSubstr("did you mean hard?"));
  EXPECT_THAT(spec_error("surge:2,1"), HasSubstr("lower limit 2 is above"));
  EXPECT_THAT(spec_error("surge:0,2:hard:soft"), HasSubstr("surge takes MIN,MAX"));
  EXPECT_THAT(spec_error("non-holonomic:3"), HasSubstr("non-holonomic takes only soft or hard"));
  EXPECT_THAT(spec_error("yaw-rate:-1"), HasSubstr("takes a non-negative number"));
  EXPECT_THAT(spec_error("surge:soft+yaw-rate:hard"), HasSubstr("surge and yaw-rate must be"));
  EXPECT_THAT(spec_error("horizons"), HasSubstr("horizons takes a list of N or BACK:AHEAD"));
  EXPECT_THAT(spec_error("mode-b:hard"), HasSubstr("mode-b"));
  EXPECT_THAT(spec_error(""), HasSubstr("models: constant-twist"));
}

TEST(Models, SolveAllDefaults) {
  const ScratchFolder folder;
  write_small_scenario(folder);
  Scenario scenario = read_scenario(folder.path());
  scenario.data.noise.twist_time.setConstant(1e13);  // no damping
  std::vector<ModelResult> results;
  for (const std::string& name : default_models()) {
    const NamedModel model = parse_model_spec("--models", name, {});
    results.push_back(evaluate_model(scenario, model, solver_for(model)));
    // The folder lacks the noise parameter constant_velocity, which models of points need.
    if (name == "mode-b" || name == "constant-velocity" || name == "damped-velocity") {
      EXPECT_EQ(results.back().status, "refused") << name;
      EXPECT_THAT(results.back().message, HasSubstr("constant_velocity")) << name;
      continue;
    }
    EXPECT_EQ(results.back().status, "converged") << name << ": " << results.back().message;
    EXPECT_LT(results.back().all.position->mean, 1e-6) << name << ": the measurements are exact";
  }
  const std::string report = models_report("small", results);
  EXPECT_THAT(report, HasSubstr("constant_velocity"));
  EXPECT_THAT(report, HasSubstr("position error [m]"));
}

ModelResult result(const std::string& name, double position, int angles) {
  ModelResult r;
  r.name = name;
  r.solver = "gauss-newton";
  r.status = "converged";
  r.solved = true;
  r.all.n = r.all.compared = 4;
  r.all.position = MeanStd{position, 0, 4};
  if (angles) r.all.orientation = MeanStd{position, 0, angles};
  return r;
}

TEST(Models, ReportMarksBestOfEachColumn) {
  const std::string report =
      models_report("small", {result("good", 1, 4), result("bad", 2, 4), result("points", 3, 2)});
  EXPECT_THAT(report, HasSubstr("1.000*"));
  EXPECT_THAT(report, Not(HasSubstr("2.000*")));
  EXPECT_THAT(report, testing::ContainsRegex("points .* 3\\.000 +–\n")) << "orientation at some keyframes only";
  EXPECT_THAT(report, Not(testing::ContainsRegex("pose|none"))) << "no errors at such keyframes";
  EXPECT_THAT(report, HasSubstr("Least position error over all keyframes: good, 1.000 m"));
  EXPECT_THAT(models_report("small", {result("x", 1, 0)}), Not(HasSubstr("orientation")));
  std::vector<ModelResult> many;
  for (int i = 25; i > 0; --i) many.push_back(result("model" + std::to_string(i), i, 0));
  EXPECT_THAT(models_report("small", many),
              testing::AllOf(testing::StartsWith("Least position error over all keyframes: model1, "),
                             HasSubstr("\nmodel20 "), Not(HasSubstr("\nmodel21 ")), HasSubstr("… and 5 more.")));
  EXPECT_THAT(models_report("small", many, true), HasSubstr("\nmodel25 "));
}

TEST(Models, ReportIgnoresUnconvergedModelsForBest) {
  ModelResult stopped = result("stopped", 0.5, 4);
  stopped.status = "time-limit";
  EXPECT_THAT(models_report("small", {result("good", 1, 4), stopped}), HasSubstr("keyframes: good"));
}

}  // namespace
}  // namespace tandem
