#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "run_tandem.hpp"
#include "studies/simulation/target_of_dive.hpp"

/// `tandem estimate` on a folder with raw ego sensors, a target's fixes and no odometry, through the real executable.
namespace tandem {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

class JointCommand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ScratchFolder;
    const DiveOptions options{.grade = Grade::tactical, .minutes = 1};
    write_dive(simulate_dive(options), options, folder_->path());
    write_target_of_dive(dive_with_target(options, 0.3), folder_->path());
  }
  static void TearDownTestSuite() { delete folder_; }
  static std::string dive() { return folder_->path().string(); }

 private:
  static inline ScratchFolder* folder_ = nullptr;
};

TEST_F(JointCommand, EstimatesChaserAndTargetTogether) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  const Outcome outcome = run_tandem({"estimate", dive(), "--json", "--out", out.string(), "--plots", "off"});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const Json summary = Json::parse(outcome.output);
  EXPECT_EQ(summary["status"], "converged");
  EXPECT_GT(summary["ego_sensors"]["dvl"]["used"], 290);
  EXPECT_EQ(summary["ego_sensors"]["dvl"]["left_out"], 0);
  EXPECT_LT(summary["errors"]["all"]["position_mean_m"], 0.48) << "one fix is as far off, on average";
  for (const char* file : {"chaser.tum", "target.tum", "chaser_full.csv", "summary.json"})
    EXPECT_TRUE(std::filesystem::exists(out / file)) << file;
  EXPECT_EQ(read_file(out / "summary.json"), outcome.output);
}

TEST_F(JointCommand, TheReportSaysSo) {
  const Outcome outcome = run_tandem({"estimate", dive()});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_THAT(outcome.output,
              HasSubstr("The chaser by its own sensors, together with the target; measurements used: dvl "));
}

TEST_F(JointCommand, ModelsAreComparedOnItToo) {
  const Outcome outcome =
      run_tandem({"models", dive(), "--models", "constant-twist,white-noise-acceleration", "--json"});
  EXPECT_EQ(outcome.status, 0) << outcome.errors;
}

}  // namespace
}  // namespace tandem
