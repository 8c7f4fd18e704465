#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/calibration/calibration_files.hpp>
#include <tandem/studies/calibration/calibration_report.hpp>
#include <tandem/studies/comparison/compare_report.hpp>
#include <tandem/studies/comparison/models_report.hpp>
#include <tandem/studies/estimation/estimate_files.hpp>
#include <tandem/studies/estimation/estimate_report.hpp>
#include <tandem/studies/navigation_results/navigation_files.hpp>
#include <tandem/studies/navigation_results/navigation_report.hpp>
#include <tandem/studies/online/track.hpp>
#include <tandem/studies/online/track_files.hpp>
#include <tandem/studies/online/track_json_line.hpp>
#include <tandem/studies/online/track_report.hpp>
#include <tandem/studies/paper/paper_fig3_files.hpp>
#include <tandem/studies/paper/paper_modes.hpp>
#include <tandem/studies/planning/plan_files.hpp>
#include <tandem/studies/planning/plan_report.hpp>
#include <tandem/studies/rendezvous/rendezvous_study.hpp>
#include <tandem/studies/study/study_report.hpp>
#include <tandem/studies/study/study_summary.hpp>
#include <tandem/studies/support/text.hpp>

#include "paths.hpp"

namespace tandem {
namespace {

/// Returns the section of docs/file_formats.md below the third-level heading of the command.
std::string section_of(const std::string& command) {
  std::ifstream file(std::string(paths::source) + "/docs/file_formats.md");
  std::string section, line;
  for (bool inside = false; std::getline(file, line);) {
    if (line.starts_with("##")) inside = line.starts_with("### tandem " + command);
    if (inside) section += line + "\n";
  }
  return section;
}

/// Replaces the parts of a column name that the page writes as a range or as a word in capitals by "#": c11 … c66,
/// ahead_H_x_m, at_TYPE_error_m, nis_SENSOR, MODE_error_m.
std::string general(std::string name) {
  for (const auto& [one, any] : {std::pair{"^(a|b|[A-Z]+)_", "#_"},
                                 {"at_(position|pose|partial|none|all|TYPE)_", "at_#_"},
                                 {"^nis_.+", "nis_#"},
                                 {"_([A-Z]+)_", "_#_"},
                                 {"[0-9]+", "#"}})
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

void expect_documented(const std::string& command, const std::vector<FileDescription>& files) {
  const std::set<std::string> names = names_in(section_of(command));
  ASSERT_FALSE(files.empty());
  for (const FileDescription& file : files) {
    for (const std::string_view name : split(file.file, ','))
      EXPECT_TRUE(names.contains(general(std::string(trimmed(name))))) << command << ": " << name;
    for (const auto& [column, what] : file.columns) {
      EXPECT_TRUE(names.contains(general(column))) << command << ": " << file.file << ", " << column;
      EXPECT_FALSE(what.empty()) << column;
    }
  }
}

TEST(FileFormats, EveryColumnIsDocumented) {
  expect_documented("estimate", estimate_file_columns());
  expect_documented("navigate", navigation_file_columns());
  expect_documented("track", track_file_columns(TrackOptions{}));
  expect_documented("compare", compare_file_columns());
  expect_documented("models", models_file_columns());
  expect_documented("calibrate", calibration_file_columns());
  expect_documented("study", study_file_columns());
  expect_documented("plan", plan_file_columns({"NAME"}));
  expect_documented("rendezvous", rendezvous_file_columns());
  expect_documented("paper fig3", fig3::file_columns());
  expect_documented("paper table1", {modes::file_columns("NAME.csv")});
}

/// The tables of the page are generated from these descriptions (scripts/reference).
TEST(FileFormats, EveryKeyIsDescribed) {
  for (const FileDescription& file :
       {summary_json_keys(), navigation_json_keys(), track_json_keys(), track_json_line_keys(), compare_json_keys(),
        models_json_keys(), calibration_json_keys(), study_json_keys(), plan_json_keys(), rendezvous_json_keys(),
        modes::json_keys()}) {
    ASSERT_FALSE(file.columns.empty());
    EXPECT_EQ(file.columns.front().first, "schema");
    for (const auto& [key, what] : file.columns) EXPECT_FALSE(what.empty()) << file.file << ": " << key;
  }
}

}  // namespace
}  // namespace tandem
