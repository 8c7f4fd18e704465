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
#include <tandem/studies/navigation/more/navigation_files.hpp>
#include <tandem/studies/planning/plan_files.hpp>
#include <tandem/studies/planning/rendezvous_study.hpp>
#include <tandem/studies/study/study_report.hpp>
#include <tandem/studies/support/text.hpp>

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

/// A column's name without what the page writes as a range or as a word in capitals: c11 … c66, ahead_H_x_m,
/// TYPE_position_error_m, MODE_error_m.
std::string general(std::string name) {
  for (const auto& [one, any] :
       {std::pair{"^(usbl|optical|gated|all|a|b|[A-Z]+)_", "#_"}, {"_(usbl|optical|[A-Z]+)_", "_#_"}, {"[0-9]+", "#"}})
    name = std::regex_replace(name, std::regex(one), any);
  return name;
}

std::set<std::string> names_in(const std::string& section) {
  std::set<std::string> names;
  const std::regex quoted("`([^`\n]+)`");
  for (std::sregex_iterator match(section.begin(), section.end(), quoted), end; match != end; ++match)
    names.insert(general((*match)[1]));
  return names;
}

void expect_documented(const std::string& command, const std::vector<CsvDescription>& files) {
  const std::set<std::string> names = names_in(section_of(command));
  ASSERT_FALSE(files.empty());
  for (const CsvDescription& file : files) {
    for (const std::string_view name : split(file.file, ','))
      EXPECT_TRUE(names.contains(general(std::string(trimmed(name))))) << command << ": " << name;
    for (const auto& [column, what] : file.columns) {
      EXPECT_TRUE(names.contains(general(column))) << command << ": " << file.file << ", " << column;
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
  expect_documented("study", study_file_columns());
  expect_documented("plan", plan_file_columns({"NAME"}));
  expect_documented("rendezvous", rendezvous_file_columns());
  expect_documented("demo fig3", fig3::file_columns());
  expect_documented("demo table1", {modes::file_columns("NAME.csv")});
}

}  // namespace
}  // namespace tandem
