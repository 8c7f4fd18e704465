#include <filesystem>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/tuning/tune_report.hpp>

#include "needs_program.hpp"
#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::Not;

class TuneCommand : public testing::Test {
 protected:
  void SetUp() override {
    run_ = scratch_.path() / "run";
    ASSERT_EQ(run_tandem({"simulate", "docking", "--seed", "3", "--minutes", "1", "--out", run_.string()}).status, 0);
  }
  std::string run() const { return run_.string(); }
  std::string out() const { return (scratch_.path() / "tuned").string(); }

  ScratchFolder scratch_;
  std::filesystem::path run_;
};

TEST_F(TuneCommand, WritesAModelThatOtherCommandsTake) {
  const Outcome outcome = run_tandem({"tune", run(), "--only", "mode,loss", "--out", out(), "--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_GT(json["models"], 3);
  EXPECT_TRUE(json["complete"]);
  for (const auto& step : json["steps"])
    EXPECT_THAT(step["change"].get<std::string>(), testing::AnyOf(HasSubstr("--mode"), HasSubstr("--loss")));
  const std::string config = out() + "/run.yaml";
  for (const char* command : {"estimate", "calibrate", "models"}) {
    const Outcome other = run_tandem({command, "--config", config, "--print-config"});
    EXPECT_EQ(other.status, 0) << command << ": " << other.errors;
  }
  EXPECT_EQ(run_tandem({"estimate", "--config", config}).status, 0);
  const Outcome tracked = run_tandem({"track", "--config", config, "--noise-from", out() + "/noise.yaml"});
  EXPECT_EQ(tracked.status, 0) << tracked.errors;
}

TEST_F(TuneCommand, ListsCandidatesWithoutScoringThem) {
  const Outcome outcome = run_tandem({"tune", run(), "--dry-run", "--fixed", "robust,model", "--out", out()});
  EXPECT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(outcome.output, HasSubstr("--mode B"));
  EXPECT_THAT(outcome.output, Not(HasSubstr("--robust")));
  EXPECT_FALSE(std::filesystem::exists(out() + "/run.yaml"));
}

TEST_F(TuneCommand, RefusesWhatItCannotTune) {
  EXPECT_THAT(run_tandem({"tune", run(), "--only", "lasers"}).errors,
              HasSubstr("--only 'lasers': no option or sensor of this name can change"));
  EXPECT_THAT(run_tandem({"tune", run(), "--only", "loss", "--fixed", "loss"}).errors,
              HasSubstr("'loss' is in --only and in --fixed; remove one of them"));
  EXPECT_THAT(run_tandem({"tune", run(), "--max-keyframes", "3"}).errors, HasSubstr("is too short to hold out blocks"));
  const std::string dive = (scratch_.path() / "dive").string();
  ASSERT_EQ(run_tandem({"simulate", "dive", "--minutes", "1", "--out", dive}).status, 0);
  EXPECT_THAT(run_tandem({"tune", run(), dive}).errors, HasSubstr("have different sensors"));
  const Outcome outcome = run_tandem({"tune", run(), "--time", "0"});
  EXPECT_EQ(outcome.status, 2) << "no model is scored";
  EXPECT_THAT(outcome.errors, HasSubstr("time limit"));
}

/// All models start from the recording as it was read.
TEST_F(TuneCommand, AppliesTheOptionsOfSensorsToEachModel) {
  const std::string dive = (scratch_.path() / "dive").string();
  ASSERT_EQ(run_tandem({"simulate", "dive", "--minutes", "1", "--out", dive}).status, 0);
  const Outcome without = run_tandem({"tune", dive, "--without", "heading", "--only", "depth.delay", "--time", "60"});
  EXPECT_EQ(without.status, 0) << without.errors;
  // Without an IMU, readings of the depth sensor are averaged; its stated noise is that of one reading.
  std::vector<std::string> reports;
  for (const char* noise : {"0.05", ""}) {
    std::vector<std::string> words = {"tune",   dive, "--without", "imu",   "--only", "depth.delay",
                                      "--time", "60", "--force",   "--out", out()};
    if (*noise) words.insert(words.end(), {"--noise", std::string("depth=") + noise});
    const Outcome outcome = run_tandem(words);
    ASSERT_EQ(outcome.status, 0) << outcome.errors;
    reports.push_back(read_file(out() + "/noise.yaml"));
  }
  EXPECT_EQ(reports[0], reports[1]) << "0.05 is the stated noise";
}

TEST(TuneReport, TellsThatTheSearchWasStopped) {
  Tuning tuning;
  tuning.scenarios = {"run"};
  EXPECT_THAT(tune_report(tuning, false), Not(HasSubstr("--time")));
  tuning.selection.cut_short = true;
  EXPECT_THAT(tune_report(tuning, false), HasSubstr("more time (--time) may find a better model"));
  EXPECT_THAT(tuned_model(tuning), Not(AnyOf(HasSubstr("redicts best"), HasSubstr("further change predicts"))));
}

/// A turned detection at the end moves only the states near it. Held-out predictions do not show it.
TEST_F(TuneCommand, StartsWithRobustLossesIfMeasurementsContradictTheOthers) {
  const std::filesystem::path longer = scratch_.path() / "longer", file = longer / "optical.csv";
  ASSERT_EQ(run_tandem({"simulate", "docking", "--seed", "3", "--minutes", "3", "--out", longer.string()}).status, 0);
  const std::string text = read_file(file);
  std::vector<std::string> fields;  // of the last line
  const std::size_t begin = text.rfind('\n', text.size() - 2) + 1;
  std::istringstream last(text.substr(begin));
  for (std::string field; std::getline(last, field, ',');) fields.push_back(field);
  ASSERT_EQ(fields.size(), 8u);
  const auto turned = [&](double sign, std::size_t field) { return std::to_string(sign * std::stod(fields[field])); };
  std::ofstream(file) << text.substr(0, begin) << fields[0] << ',' << fields[1] << ',' << fields[2] << ',' << fields[3]
                      << ',' << turned(1, 5) << ',' << turned(-1, 4) << ',' << turned(1, 7) << ',' << turned(-1, 6)
                      << '\n';  // q ⊗ (0, 0, 1, 0)
  const Outcome outcome = run_tandem({"tune", longer.string(), "--only", "robust,mode", "--out", out(), "--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const auto step = nlohmann::json::parse(outcome.output)["steps"][0];
  EXPECT_EQ(step["change"], "--robust");
  EXPECT_EQ(step["verdict"], "needed");
  EXPECT_THAT(read_file(out() + "/run.yaml"), HasSubstr("robust: true"));
}

TEST_F(TuneCommand, EstimatesWithTheTunedModel) {
  const Outcome outcome = run_tandem(
      {"estimate", run(), "--tuned", "--time-limit", "60", "--no-covariance", "--threads", "1", "--out", out()});
  EXPECT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(outcome.output, HasSubstr("redict"));
  const std::string run_file = read_file(out() + "/run.yaml");
  EXPECT_THAT(run_file, AllOf(HasSubstr("command: estimate"), HasSubstr("no-covariance: true"), HasSubstr("threads: 1"),
                              Not(HasSubstr("tuned"))));
  const std::string again = (scratch_.path() / "again").string();
  ASSERT_EQ(run_tandem({"estimate", "--config", out() + "/run.yaml", "--out", again}).status, 0);
  EXPECT_EQ(read_file(again + "/target.tum"), read_file(out() + "/target.tum"));
}

}  // namespace
}  // namespace tandem
