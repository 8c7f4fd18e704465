#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "folder_fault_list.hpp"
#include "shared_data.hpp"
#include "studies/commands/run_tandem.hpp"

/// Injects each fault into folders of several recordings. The command must either reject the folder with one sentence
/// and write nothing, or give a result that is as accurate as without the fault.
namespace tandem::faults {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::json;

constexpr double kMaxErrorRatio = 1.5;  // relative to the error without the fault
constexpr double kTimeLimit = 10;       // s, of a command

struct FolderCase {
  std::string recording, command, motion, sensor;
  double until;  // s after the first row
};
void PrintTo(const FolderCase& c, std::ostream* out) { *out << c.recording; }

bool is_finite(const Json& json) {
  if (json.is_number_float()) return std::isfinite(json.get<double>());
  if (!json.is_structured()) return true;
  return std::all_of(json.begin(), json.end(), [](const Json& part) { return is_finite(part); });
}

/// Returns whether a text contains control characters other than line ends.
bool has_control_bytes(const std::string& text) {
  return std::any_of(text.begin(), text.end(), [](char c) { return (c >= 0 && c < ' ' && c != '\n') || c == '\x7f'; });
}

std::string replaced(std::string text, const std::string& word, const std::string& by) {
  if (const std::size_t at = text.find(word); at != std::string::npos) text.replace(at, word.size(), by);
  return text;
}

class FolderFaults : public ::testing::TestWithParam<FolderCase> {
 protected:
  Outcome run(const std::filesystem::path& folder, const std::filesystem::path& out) const {
    const FolderCase& c = GetParam();
    std::vector<std::string> words = {c.command,        folder.string(), "--json",
                                      "--plots",        "off",           "--out",
                                      out.string(),     "--time-limit",  fmt::format("{}", kTimeLimit),
                                      "--no-covariance"};
    if (c.command == "estimate") words.emplace_back("--robust");
    if (c.command == "navigate") words.insert(words.end(), {"--loss", "cauchy:2"});
    return run_tandem(words);
  }
  /// Returns the mean position error of a result [m].
  static double error_of_result(const Json& json) { return json["errors"]["all"]["position_mean_m"]; }
};

TEST_P(FolderFaults, AreRejectedOrHarmless) {
  TANDEM_NEEDS_SHARED(folder_faults().size());
  const FolderCase& c = GetParam();
  const Folder good(shared_path("data/" + c.recording), c.motion, c.sensor, c.until);
  const ScratchFolder scratch;
  const auto folder = scratch.path() / "run", out = scratch.path() / "out";
  const auto write = [&](const Folder& text) {
    std::filesystem::remove_all(folder);
    std::filesystem::remove_all(out);
    std::filesystem::create_directory(folder);
    text.write(folder);
  };
  write(good);
  const Outcome undisturbed = run(folder, out);
  ASSERT_EQ(undisturbed.status, 0) << undisturbed.errors;
  const double expected = error_of_result(Json::parse(undisturbed.output));
  std::size_t faults = 0;
  for (const FolderFault& fault : folder_faults()) {
    SCOPED_TRACE(fault.name);
    Folder faulty = good;
    if (fault.inject) fault.inject(faulty);
    write(faulty);
    if (fault.inject_written) fault.inject_written(folder, faulty);
    const Outcome outcome = run(folder, out);
    ++faults;
    EXPECT_FALSE(has_control_bytes(outcome.output) || has_control_bytes(outcome.errors));
    if (outcome.status == 1) {
      EXPECT_NE(fault.expected_outcome, ExpectedOutcome::survived) << outcome.errors;
      EXPECT_EQ(outcome.output, "");
      EXPECT_THAT(outcome.errors, ::testing::ContainsRegex("^tandem: [^\n]+\n$")) << "one line";
      EXPECT_LE(outcome.errors.size(), 600u);
      const std::string expected_message =
          replaced(replaced(fault.expected_message, "MOTION", c.motion), "SENSOR", c.sensor);
      EXPECT_THAT(outcome.errors, HasSubstr(expected_message));
      EXPECT_FALSE(std::filesystem::exists(out)) << "a rejected folder must not have results";
      continue;
    }
    EXPECT_NE(fault.expected_outcome, ExpectedOutcome::rejected) << outcome.output.substr(0, 300) << outcome.errors;
    EXPECT_TRUE(outcome.status == 0 || (outcome.status == 2 && fault.expected_outcome == ExpectedOutcome::finite))
        << outcome.status << ": " << outcome.errors;
    if (outcome.output.empty()) {  // stopped before there was a result
      EXPECT_EQ(outcome.status, 2) << outcome.errors;
      continue;
    }
    const Json json = Json::parse(outcome.output);
    if (outcome.status == 0) EXPECT_TRUE(is_finite(json));
    if (fault.expected_outcome == ExpectedOutcome::finite) continue;
    EXPECT_LE(error_of_result(json), kMaxErrorRatio * expected);
  }
  EXPECT_GE(faults, 40u);
}

const auto name_of_folder_case = [](const auto& info) { return info.param.recording; };
INSTANTIATE_TEST_SUITE_P(Simulated, FolderFaults,
                         ::testing::Values(FolderCase{"docking_a", "estimate", "chaser_odometry.tum", "usbl.csv", 140}),
                         name_of_folder_case);
INSTANTIATE_TEST_SUITE_P(Recorded, FolderFaults,
                         ::testing::Values(FolderCase{"kitti_0020_012", "estimate", "chaser_odometry.tum",
                                                      "optical.csv", 64},
                                           FolderCase{"ferry_22_1", "estimate", "chaser_odometry.tum", "lidar.csv", 74},
                                           FolderCase{"auv_akit_03", "navigate", "imu.csv", "dvl.csv", 60},
                                           FolderCase{"auv_akit_01", "navigate", "imu.csv", "dvl.csv", 60}),
                         name_of_folder_case);

}  // namespace
}  // namespace tandem::faults
