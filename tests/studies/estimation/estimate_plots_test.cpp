#include <cmath>
#include <iostream>
#include <regex>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/estimation/estimate_files.hpp>
#include <tandem/studies/support/plots.hpp>

#include "needs_program.hpp"
#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

Estimate straight_line(Scenario& scenario) {
  Estimate estimate;
  estimate.scenario = "it's `a` \"name\"\nset output 'elsewhere'";
  for (int k = 0; k < 5; ++k) {
    const auto at = [&](double x) { return SE3(SO3(), Vector<3>(x, 0, 0)); };
    estimate.keyframes.push_back({double(k), KeyframeType::position, Vector<3>(5, 0, 0), {}});
    estimate.chaser.push_back(at(k));
    estimate.target.push_back(at(k + 5.5));
    scenario.truth_chaser.push_back({double(k), at(k)});
    scenario.truth_target.push_back({double(k), at(k + 5)});
  }
  estimate.errors = keyframe_errors(scenario, estimate.keyframes, estimate.chaser, estimate.target);
  return estimate;
}

/// Writes the files of an estimate and draws them; returns the message of draw_plots().
std::string drawn(const Estimate& estimate, const Scenario& scenario, const ScratchFolder& folder,
                  PlotFormat format = PlotFormat::svg) {
  for (const std::string& name : files(folder.path())) std::filesystem::remove(folder.path() / name);
  write_results(estimate, scenario, folder.path());
  return draw_plots("estimate", format, folder.path());
}

TEST(EstimatePlots, DrawTrajectoriesAndErrors) {
  TANDEM_NEEDS_GNUPLOT("plots of an estimate");
  const ScratchFolder folder;
  Scenario scenario;
  const Estimate estimate = straight_line(scenario);
  ASSERT_EQ(drawn(estimate, scenario, folder), "");
  EXPECT_THAT(read_file(folder.path() / "trajectories.svg"), HasSubstr("</svg>"));
  EXPECT_THAT(read_file(folder.path() / "trajectories.svg"), HasSubstr("it's `a`"))
      << "gnuplot must not interpret the title";
  EXPECT_THAT(read_file(folder.path() / "errors.svg"), HasSubstr("</svg>"));
  EXPECT_THAT(read_file(folder.path() / "error_norms.svg"), HasSubstr("</svg>"));
  ASSERT_EQ(drawn(estimate, scenario, folder, PlotFormat::png), "");
  EXPECT_THAT(read_file(folder.path() / "trajectories.png"), StartsWith("\x89PNG"));
  EXPECT_THAT(read_file(folder.path() / "errors.png"), StartsWith("\x89PNG"));
}

/// A column of a paper is 3.5 inches wide: 336 pixels of an SVG, at 96 per inch.
TEST(EstimatePlots, AreAsWideAsAColumn) {
  TANDEM_NEEDS_GNUPLOT("plots of an estimate");
  const ScratchFolder folder;
  Scenario scenario;
  const Estimate estimate = straight_line(scenario);
  ASSERT_EQ(drawn(estimate, scenario, folder), "");
  EXPECT_THAT(read_file(folder.path() / "errors.svg"), HasSubstr("width=\"336\""));
  EXPECT_THAT(read_file(folder.path() / "errors.svg"), HasSubstr("font-size=\"10.6"));
  ASSERT_EQ(drawn(estimate, scenario, folder, PlotFormat::pdf), "");
  const std::string pdf = read_file(folder.path() / "errors.pdf");
  EXPECT_THAT(pdf, StartsWith("%PDF"));
  if (pdf.find("/ObjStm") == std::string::npos)
    EXPECT_THAT(pdf, HasSubstr("/MediaBox [ 0 0 252 "));
  else
    std::cerr << "cairo compresses the sizes of pages: not checked: width of the PDF\n";
  ASSERT_EQ(drawn(estimate, scenario, folder, PlotFormat::png), "");
  EXPECT_EQ(read_file(folder.path() / "errors.png").substr(16, 4), std::string("\0\0\x04\x1a", 4)) << "300 per inch";
}

TEST(EstimatePlots, ShowTimeSinceStartOrUtc) {
  TANDEM_NEEDS_GNUPLOT("plots of an estimate");
  const ScratchFolder folder;
  Scenario scenario;
  Estimate estimate = straight_line(scenario);
  const auto shift = [&](double by) {
    for (Keyframe& k : estimate.keyframes) k.t += by;
    for (KeyframeError& e : estimate.errors) e.t += by;
    EXPECT_EQ(drawn(estimate, scenario, folder), "");
    return read_file(folder.path() / "errors.svg");
  };
  EXPECT_THAT(shift(1000), AllOf(HasSubstr("time since start"), HasSubstr(">0:00:04<")));
  EXPECT_THAT(shift(1732600000 - 1000), AllOf(HasSubstr("UTC, 2024-11-26"), HasSubstr(">05:46:44<")));
}

TEST(EstimatePlots, TellTheTrueTrajectoriesApart) {
  TANDEM_NEEDS_GNUPLOT("plots of an estimate");
  const ScratchFolder folder;
  Scenario scenario;
  const Estimate estimate = straight_line(scenario);
  ASSERT_EQ(drawn(estimate, scenario, folder), "");
  EXPECT_THAT(read_file(folder.path() / "trajectories.svg"), AllOf(HasSubstr("true chaser"), HasSubstr("true target")));
}

/// The band has no height for components that are not estimated, such as the yaw of a point.
TEST(EstimatePlots, BandEndsWhereNothingIsEstimated) {
  TANDEM_NEEDS_GNUPLOT("plots of an estimate");
  const ScratchFolder folder;
  folder.write("summary.json", "{}");
  const auto heights = [&](const std::string& bound_at_2) {  // of the points of all areas: the band and its key
    std::string rows;
    for (int k = 0; k < 5; ++k)
      rows += std::to_string(k) + ",none,,,,,,,,," + (k == 2 ? bound_at_2 : "3") + ",0,0,,,\n";
    folder.write(
        "errors.csv",
        "t,type,position_error_m,orientation_error_deg,error_x_m,error_y_m,error_z_m,error_rx_deg,error_ry_deg,"
        "error_rz_deg,three_sigma_x_m,three_sigma_y_m,three_sigma_z_m,three_sigma_rx_deg,three_sigma_ry_deg,"
        "three_sigma_rz_deg\n" +
            rows);
    EXPECT_EQ(draw_plots("estimate", PlotFormat::svg, folder.path()), "");
    const std::string svg = read_file(folder.path() / "errors.svg");
    const std::regex area("<polygon[^>]*>"), point("[0-9.]+,([0-9.]+)");
    std::set<std::string> all;
    for (auto of = std::sregex_iterator(svg.begin(), svg.end(), area); of != std::sregex_iterator(); ++of) {
      const std::string polygon = of->str();
      for (auto it = std::sregex_iterator(polygon.begin(), polygon.end(), point); it != std::sregex_iterator(); ++it)
        all.insert((*it)[1]);
    }
    return all.size();
  };
  EXPECT_EQ(heights("3"), 4u) << "lower and upper bound";
  EXPECT_EQ(heights(""), 5u) << "and zero";
}

TEST(EstimatePlots, OmitErrorsWithoutTruth) {
  TANDEM_NEEDS_GNUPLOT("plots of an estimate");
  const ScratchFolder folder;
  Scenario scenario;
  Estimate estimate = straight_line(scenario);
  scenario.truth_chaser.clear();
  estimate.errors = keyframe_errors(scenario, estimate.keyframes, estimate.chaser, estimate.target);
  ASSERT_EQ(drawn(estimate, scenario, folder), "");
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "trajectories.svg"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "errors.svg"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "error_norms.svg"));
}

TEST(EstimatePlots, DrawBoundsWithoutTruth) {
  TANDEM_NEEDS_GNUPLOT("plots of an estimate");
  const ScratchFolder folder;
  Scenario scenario;
  Estimate estimate = straight_line(scenario);
  scenario.truth_chaser.clear();
  estimate.errors = keyframe_errors(scenario, estimate.keyframes, estimate.chaser, estimate.target);
  KeyframeUncertainty u;
  u.relative_position = Vector<3>(1, 4, 0).asDiagonal();  // planar
  estimate.uncertainty.assign(5, u);
  ASSERT_EQ(drawn(estimate, scenario, folder), "");
  const std::string drawn = read_file(folder.path() / "errors.svg");
  EXPECT_THAT(drawn, HasSubstr("uncertainty of the relative pose"));
  EXPECT_THAT(drawn, HasSubstr("±3 σ"));
  EXPECT_THAT(drawn, HasSubstr("y [m]"));
  EXPECT_THAT(drawn, testing::Not(HasSubstr("z [m]"))) << "planar";
  EXPECT_THAT(drawn, testing::Not(HasSubstr("yaw")));
}

/// Bounds at measured positions and at measured poses differ by decades; both must be readable.
TEST(EstimatePlots, UseLogScaleForBoundsOverDecades) {
  TANDEM_NEEDS_GNUPLOT("plots of an estimate");
  const ScratchFolder folder;
  Scenario scenario;
  Estimate estimate = straight_line(scenario);
  KeyframeUncertainty u;
  u.relative_position = Vector<3>(1, 1, 1).asDiagonal();
  estimate.uncertainty.assign(5, u);
  ASSERT_EQ(drawn(estimate, scenario, folder), "");
  EXPECT_THAT(read_file(folder.path() / "errors.svg"), testing::Not(HasSubstr("log scale")));
  u.relative_position *= 1e-4;
  estimate.uncertainty[1] = estimate.uncertainty[2] = u;
  ASSERT_EQ(drawn(estimate, scenario, folder), "");
  EXPECT_THAT(read_file(folder.path() / "errors.svg"), HasSubstr("log scale"));
}

TEST(EstimatePlots, OmitOrientationErrorsWithoutTrueOrientation) {
  TANDEM_NEEDS_GNUPLOT("plots of an estimate");
  const ScratchFolder folder;
  Scenario scenario;
  Estimate estimate = straight_line(scenario);
  scenario.truth_orientation = false;
  estimate.errors = keyframe_errors(scenario, estimate.keyframes, estimate.chaser, estimate.target);
  ASSERT_EQ(drawn(estimate, scenario, folder), "");
  EXPECT_THAT(read_file(folder.path() / "error_norms.svg"), testing::Not(HasSubstr("orientation error")));
  EXPECT_THAT(read_file(folder.path() / "errors.svg"), testing::Not(HasSubstr("yaw")));
}

}  // namespace
}  // namespace tandem
