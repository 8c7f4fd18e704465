#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/inspection/scenario_inspection.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

SensorSeries series(const std::string& type, std::vector<std::vector<double>> rows) {
  const std::size_t n = rows.size();
  return {type, type, n, {}, [rows](std::size_t row, std::size_t column) { return rows[row][column]; }};
}

TEST(Inspection, ShowsTheSensorsOfAScenario) {
  const ScratchFolder folder;
  write_small_scenario(folder);
  const ScenarioInspection scenario = inspect_scenario(folder.path());
  ASSERT_THAT(scenario.series, SizeIs(5));
  EXPECT_EQ(scenario.series[0].type, "odometry");
  EXPECT_EQ(scenario.series[1].rows, 2u);
  EXPECT_THAT(scenario.findings, IsEmpty());
  EXPECT_THAT(inspection_text(scenario), AllOf(HasSubstr("small: ENU-FLU"), HasSubstr("usbl: x 5 … 5")));
  EXPECT_THAT(inspection_json(scenario), HasSubstr("\"schema\": \"tandem.info/1\""));
  EXPECT_THAT(inspection_page(scenario), AllOf(HasSubstr("<svg"), HasSubstr("north up")));
}

TEST(Inspection, ShowsAFolderWithABrokenFile) {
  const ScratchFolder folder;
  write_small_scenario(folder);
  folder.write("usbl.csv", "t,x,y,z\n1,2\n");
  const ScenarioInspection scenario = inspect_scenario(folder.path());
  EXPECT_THAT(scenario.series, SizeIs(4));
  EXPECT_THAT(scenario.unreadable, ElementsAre(HasSubstr("usbl.csv:2: expected 4 columns")));
}

TEST(Inspection, ReadsNoFileOutsideTheFolder) {
  const ScratchFolder folder;
  folder.write("scenario.yaml", "sensors:\n  depth: {type: depth, file: ../depth.csv, sigma: [1]}\n");
  EXPECT_THAT(inspect_scenario(folder.path()).unreadable, ElementsAre(HasSubstr("outside")));
}

TEST(Inspection, StripsShowGaps) {
  ScenarioInspection scenario;
  std::vector<std::vector<double>> rows;
  for (int i = 0; i <= 100; ++i)
    if (i < 40 || i > 60) rows.push_back({double(i)});
  scenario.series.push_back(series("gps", rows));
  EXPECT_EQ(strip(scenario, scenario.series[0], 10), "████··████");
}

TEST(Inspection, NoticesUnitsAndSigns) {
  const auto findings = [](const SensorSeries& s) { return series_findings({s}, false); };
  EXPECT_THAT(findings(series("imu", {{0, 0, 0, 1, 0, 0, 0}, {1, 0, 0, 1, 0, 0, 0}})),
              Contains(HasSubstr("is it in g?")));
  EXPECT_THAT(findings(series("imu", {{0, 0, 0, -9.8, 0, 0, 0}, {1, 0, 0, -9.8, 0, 0, 0}})),
              Contains(HasSubstr("points down")));
  EXPECT_THAT(findings(series("imu", {{0, 0, 0, 9.8, 20, 0, 0}, {1, 0, 0, 9.8, 20, 0, 0}})),
              Contains(HasSubstr("is it in deg/s?")));
  EXPECT_THAT(findings(series("depth", {{0, 12}, {1, 12}})), Contains(HasSubstr("above the water")));
  EXPECT_THAT(findings(series("dvl", {{0, 900, 0, 0}, {1, 900, 0, 0}})), Contains(HasSubstr("900 m/s")));
  EXPECT_THAT(findings(series("gps", {{0, 0, 0, 0}, {1, 0, 0, 0}, {2, 5000, 0, 0}})), Contains(HasSubstr("1 jumps")));
  EXPECT_THAT(findings(series("depth", {{0, -1}, {1e9, -1}, {2e9, -1}})), Contains(HasSubstr("unit of time")));
}

}  // namespace
}  // namespace tandem
