#include <cmath>
#include <fstream>
#include <regex>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "run_tandem.hpp"
#include "shared_data.hpp"

/// No output has NaN or an infinite number, and no statistic that cannot be negative is.
namespace tandem {
namespace {

/// Columns and keys of χ² statistics, counts and standard deviations.
bool is_never_negative(const std::string& name) {
  static const std::regex names("(.*nees.*|nis.*|.*squared_distance|sigma.*|.*_sigma.*|used|rejected|n)");
  return std::regex_match(name, names);
}

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> result;
  std::istringstream row(line);
  for (std::string cell; std::getline(row, cell, ',');) result.push_back(cell);
  return result;
}

void expect_sound(const std::string& where, const std::string& text) {
  static const std::regex nan("(^|[^A-Za-z_])-?(nan|inf|infinity)([^A-Za-z_]|$)", std::regex::icase);
  std::istringstream lines(text);
  std::vector<std::string> header;
  int number = 0;
  for (std::string line; std::getline(lines, line); ++number) {
    ASSERT_FALSE(line.size() < 4000 && std::regex_search(line, nan)) << where << ":" << number + 1 << ": " << line;
    if (!where.ends_with(".csv")) continue;
    const std::vector<std::string> row = cells(line);
    if (number == 0) header = row;
    for (std::size_t i = 0; number > 0 && i < std::min(row.size(), header.size()); ++i)
      if (is_never_negative(header[i]) && !row[i].empty()) {
        EXPECT_GE(std::stod(row[i]), 0) << where << ":" << number + 1;
      }
  }
}

void expect_sound_outputs(const std::vector<std::string>& command) {
  const ScratchFolder scratch;
  std::vector<std::string> arguments = command;
  for (const std::string& more :
       {std::string("--plots"), std::string("off"), std::string("--out"), (scratch.path() / "out").string()})
    arguments.push_back(more);
  const Outcome run = run_tandem(arguments);
  ASSERT_EQ(run.status, 0) << run.errors;
  expect_sound("output", run.output + run.errors);
  for (const auto& entry : std::filesystem::directory_iterator(scratch.path() / "out"))
    expect_sound(entry.path().string(), read_file(entry.path()));
}

TEST(FiniteOutputs, OfTheBuiltInScenario) {
  expect_sound_outputs({"estimate", "docking_a", "--max-keyframes", "300"});
  expect_sound_outputs({"estimate", "docking_a", "--max-keyframes", "300", "--mode", "B", "--robust"});
  expect_sound_outputs({"track", "docking_a", "--until", "120"});
  expect_sound_outputs({"track", "docking_a", "--until", "60", "--mode", "B", "--predict", "5"});
}

TEST(FiniteOutputs, OfRecordings) {
  TANDEM_NEEDS_SHARED(5);
  expect_sound_outputs({"estimate", shared_path("data/ferry_22_1").string(), "--robust"});
  expect_sound_outputs({"estimate", shared_path("data/kitti_0020_012").string(), "--robust"});
  expect_sound_outputs({"track", shared_path("data/auv_akit_03").string(), "--until", "60"});
  expect_sound_outputs({"track", shared_path("data/ferry_22_1").string()});
  expect_sound_outputs({"navigate", shared_path("data/rov_blueye_grid").string()});
}

}  // namespace
}  // namespace tandem
