#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/calibration/calibration_files.hpp>
#include <tandem/studies/comparison/compare_report.hpp>
#include <tandem/studies/comparison/models_report.hpp>
#include <tandem/studies/demo/demo_fig3_files.hpp>
#include <tandem/studies/demo/demo_modes.hpp>
#include <tandem/studies/estimation/estimate_files.hpp>
#include <tandem/studies/live/track.hpp>
#include <tandem/studies/live/track_files.hpp>
#include <tandem/studies/navigation/navigation_files.hpp>

#include "paths.hpp"

namespace tandem {
namespace {

/// Of docs/file_formats.md, what stands below a heading of the third level that names the command.
std::string section_of(const std::string& command) {
  std::ifstream file(std::string(paths::source) + "/docs/file_formats.md");
  std::string section, line;
  for (bool inside = false; std::getline(file, line);) {
    if (line.starts_with("##")) inside = line.starts_with("### tandem " + command);
    if (inside) section += line + "\n";
  }
  return section;
}

/// A column's name without its numbers, which the page writes as a range or as a letter in capitals: c11 … c66, ahead_H.
std::string without_numbers(const std::string& name) {
  return std::regex_replace(std::regex_replace(name, std::regex("[0-9]+(\\.[0-9]+)?"), "#"), std::regex("_[A-Z]+_"),
                            "_#_");
}

std::set<std::string> names_in(const std::string& section) {
  std::set<std::string> names;
  const std::regex quoted("`([^`\n]+)`");
  for (std::sregex_iterator match(section.begin(), section.end(), quoted), end; match != end; ++match)
    names.insert(without_numbers((*match)[1]));
  return names;
}

void expect_documented(const std::string& command, const std::vector<CsvDescription>& files) {
  const std::set<std::string> names = names_in(section_of(command));
  ASSERT_FALSE(files.empty());
  for (const CsvDescription& file : files) {
    EXPECT_TRUE(names.contains(without_numbers(file.file))) << command << ": " << file.file;
    for (const auto& [column, what] : file.columns) {
      EXPECT_TRUE(names.contains(without_numbers(column))) << command << ": " << file.file << ", " << column;
      EXPECT_FALSE(what.empty()) << column;
    }
  }
}

TEST(FileFormats, EveryColumnThatACommandWritesIsDocumented) {
  expect_documented("estimate", estimate_file_columns());
  expect_documented("navigate", navigation_file_columns());
  expect_documented("track", track_file_columns(LiveOptions{}));
  expect_documented("compare", compare_file_columns());
  expect_documented("models", models_file_columns());
  expect_documented("calibrate", calibration_file_columns());
}

}  // namespace
}  // namespace tandem
