#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/report/run_figures.hpp>
#include <tandem/studies/report/run_page.hpp>
#include <tandem/studies/report/time_panels.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using Json = nlohmann::ordered_json;

constexpr double kStart = 1732600000;  // 2024-11-26 05:46:40 UTC

/// Returns the covariance columns of a pose: 4 m² along x and y, 1 m² along z, and `heading` rad² about z.
std::string covariance(double heading) {
  std::string text;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      text += fmt::format(",{}", i != j ? 0.0 : i < 2 ? 4.0 : i == 2 ? 1.0 : i == 5 ? heading : 0.0);
  return text;
}

/// Writes the results of a run in NED without truth: the chaser looks east at a target 10 m east of it, 5 m deep.
void write_run(const ScratchFolder& folder) {
  std::string head = "t,x,y,z,qx,qy,qz,qw", chaser, target;
  for (int i = 1; i <= 6; ++i)
    for (int j = 1; j <= 6; ++j) head += fmt::format(",c{}{}", i, j);
  const double half = std::sqrt(0.5);
  for (int k = 0; k < 3; ++k) {
    const double t = kStart + k;
    chaser += fmt::format("{},{},0,5,0,0,{},{}{}\n", t, k, half, half, covariance(1e-4));
    target += fmt::format("{},{},10,5,0,0,0,1{}\n", t, k, covariance(k == 1 ? 100.0 : 0.01));
  }
  folder.write("chaser_full.csv", head + "\n" + chaser);
  folder.write("target_full.csv", head + "\n" + target);
  folder.write("chaser.tum", "");
  folder.write(
      "errors.csv",
      "t,type,position_error_m,error_x_m,error_y_m,error_z_m,three_sigma_x_m,three_sigma_y_m,three_sigma_z_m\n" +
          fmt::format("{},position,,,,,3,0,0\n{},none,,,,,inf,0,0\n", kStart, kStart + 1));
  folder.write("target_fixes.csv",
               fmt::format("t,sensor,type,x_m,y_m,z_m\n{},\"front, left\",position,5,0,5\n", kStart));
  folder.write("fit_residuals.csv",
               fmt::format("sensor,component,t,residual,outcome\n\"front, left\",range,{0},1.5,used\n\"front, left\","
                           "range,{1},-80,down-weighted\n\"front, left\",,{2},,rejected\n",
                           kStart, kStart + 1, kStart + 2));
  folder.write("summary.json",
               R"({"scenario":"s","frame":"NED-FRD","status":"converged","keyframes":3,"fit":{"consistent":false,
                   "verdict":"MISFIT <here>","sensors":{"front, left":{"used":2,"rejected":1,"down_weighted":1,
                   "expected_down_weighted":0.2,"components":{"range":{"mean":0.1,"sigma":2,"correlation":0.5}},
                   "worst":[{"t":1732600001,"component":"range","residual":-80}]}}},
                   "held_out":{"front, left":{"n":4,"inliers":3,"inlier_rows_in_95_percent":66.7}},
                   "suspects":[{"sensor":"front, left","t":1732600002,"sigmas":12.3}]})");
}

Json traces(const std::vector<HtmlFigure>& figures, const std::string& title) {
  for (const HtmlFigure& figure : figures)
    if (figure.title == title) return Json::parse(figure.traces);
  ADD_FAILURE() << "there is no figure " << title;
  return Json::array();
}

Json trace(const Json& traces, const std::string& name) {
  for (const Json& one : traces)
    if (one["name"] == name) return one;
  ADD_FAILURE() << "there is no trace " << name;
  return {};
}

class RunFigures : public testing::Test {
 protected:
  RunFigures() {
    write_run(folder_);
    run_ = read_run(folder_.path());
    figures_ = run_figures(run_);
  }
  ScratchFolder folder_;
  RunRecord run_;
  std::vector<HtmlFigure> figures_;
};

TEST_F(RunFigures, ShowWhatIsKnownWithoutTruth) {
  std::vector<std::string> titles;
  for (const HtmlFigure& figure : figures_) titles.push_back(figure.title);
  EXPECT_THAT(titles, ElementsAre("From above", "Range and bearing of the target", "Uncertainty over time",
                                  "Measurements over time", "Residuals over time"));
}

TEST_F(RunFigures, PlanViewHasNorthUp) {
  const Json plan = traces(figures_, "From above");
  EXPECT_EQ(trace(plan, "target")["x"].dump(), "[10.0,10.0,10.0]");
  EXPECT_EQ(trace(plan, "target")["y"].dump(), "[0.0,1.0,2.0]");
  EXPECT_EQ(trace(plan, "front, left fix")["y"].dump(), "[5.0]");
  EXPECT_EQ(Json::parse(figures_[0].layout)["yaxis"]["title"]["text"], "x (north) [m]");
}

TEST_F(RunFigures, RangeAndBearingAreThoseInTheBody) {
  const Json all = traces(figures_, "Range and bearing of the target");
  EXPECT_EQ(trace(all, "estimate")["y"].dump(), "[10.0,10.0,10.0]");
  EXPECT_EQ(trace(all, "estimate")["x"].dump(), "[1732600000000,1732600001000,1732600002000]");
  std::vector<double> bearings;
  for (const Json& one : all)
    if (one["yaxis"] == "y2") bearings.push_back(one["y"][0]);
  EXPECT_THAT(bearings, ElementsAre(-90, testing::DoubleNear(0, 1e-9))) << "of the fix to the north, of the estimate";
}

TEST_F(RunFigures, StandardDeviationsEndWhereNothingIsDetermined) {
  const Json all = traces(figures_, "Uncertainty over time");
  EXPECT_EQ(trace(all, "chaser, horizontal")["y"].dump(), "[2.8284,2.8284,2.8284]");
  EXPECT_EQ(trace(all, "chaser, vertical")["y"].dump(), "[1.0,1.0,1.0]");
  EXPECT_EQ(trace(all, "chaser, heading")["y"].dump(), "[0.57296,0.57296,0.57296]");
  EXPECT_EQ(trace(all, "target relative to chaser")["y"].dump(), "[1.0,null]");
}

TEST_F(RunFigures, MeasurementsAndResidualsHaveTheirOutcome) {
  const Json strips = traces(figures_, "Measurements over time");
  EXPECT_EQ(trace(strips, "rejected")["x"].dump(), "[1732600002000]");
  const Json residuals = traces(figures_, "Residuals over time");
  ASSERT_EQ(residuals.size(), 2u);
  EXPECT_EQ(trace(residuals, "down-weighted")["y"].dump(), "[-6.0]") << "at the edge";
  EXPECT_EQ(trace(residuals, "down-weighted")["customdata"].dump(), "[-80.0]");
}

TEST_F(RunFigures, DepthPointsDown) {
  folder_.write("target_full.csv", fmt::format("t,x,y,z\n{},0,0,5\n{},0,0,6\n", kStart, kStart + 1));
  for (const HtmlFigure& figure : run_figures(read_run(folder_.path()))) {
    const Json layout = Json::parse(figure.layout);
    if (figure.title == "Depth over time") EXPECT_EQ(layout["yaxis"]["autorange"], "reversed");
    if (figure.title != "Trajectories in space") continue;
    EXPECT_GT(layout["scene"]["zaxis"]["range"][0], layout["scene"]["zaxis"]["range"][1]);
  }
}

TEST_F(RunFigures, PageBeginsWithTheVerdict) {
  HtmlPage page("s");
  add_run(run_, page);
  const std::string text = page.text("");
  EXPECT_THAT(text, HasSubstr("<h1>s</h1>\n<p class=\"bad\">MISFIT &lt;here&gt;</p>"));
  EXPECT_THAT(text, HasSubstr("from 2024-11-26 05:46:40 UTC"));
  EXPECT_THAT(text,
              HasSubstr("Measurements that contradict the others: 1. The worst: front, left at 05:46:42 (12 σ)."));
  EXPECT_THAT(text, HasSubstr("<td>front, left</td><td>2</td><td>1</td><td>1 (0)</td>"));
  EXPECT_THAT(text, HasSubstr("<td>-80.0 (range) at 05:46:41</td>"));
  EXPECT_THAT(text, HasSubstr("<td>front, left</td><td>4</td><td>3</td><td>66.7</td><td>–</td>"));
  EXPECT_THAT(text, Not(HasSubstr("<h2>Errors</h2>")));
}

TEST_F(RunFigures, ErrorsAreShownWithTruth) {
  folder_.write(
      "errors.csv",
      "t,type,position_error_m,error_x_m,error_y_m,error_z_m,three_sigma_x_m,three_sigma_y_m,three_sigma_z_m\n" +
          fmt::format("{},position,1,1,0,0,3,0,0\n", kStart));
  std::vector<std::string> titles;
  for (const HtmlFigure& figure : run_figures(read_run(folder_.path()))) titles.push_back(figure.title);
  EXPECT_THAT(titles, Contains("Errors of the relative position over time"));
}

TEST(TimePanels, BandEndsWhereNothingIsEstimated) {
  plot::TimePanels panels(plot::TimeAxis(0, 10), {1}, 200);
  panels.panel("y");
  const double none = std::nan("");
  panels.band({0, 1, 2, 3}, {1, 2, none, 3}, "red");
  const Json band = Json::parse(panels.figure("", "").traces)[0];
  EXPECT_EQ(band["x"].dump(), "[0,1000,1000,0,null,3000,3000,null]");
  EXPECT_EQ(band["y"].dump(), "[1.0,2.0,-2.0,-1.0,null,3.0,-3.0,null]");
}

TEST(TimeAxis, ShowsTimeSinceStartOrUtc) {
  EXPECT_EQ(plot::TimeAxis(100, 10).text(3725), "01:02:05");
  EXPECT_EQ(plot::TimeAxis(100, 10).start_text(), "");
  EXPECT_EQ(plot::TimeAxis(kStart, 10).text(65), "05:47:45");
  EXPECT_EQ(plot::TimeAxis(0, 2 * 86400).values({7200}).dump(), "[2.0]") << "hours";
}

}  // namespace
}  // namespace tandem
