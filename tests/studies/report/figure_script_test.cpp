#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/report/figure_picture.hpp>
#include <tandem/studies/report/figure_script.hpp>
#include <tandem/studies/report/plot_parts.hpp>
#include <tandem/studies/report/time_panels.hpp>

#include "needs_program.hpp"

namespace tandem {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

HtmlFigure two_panels() {
  plot::TimePanels panels(plot::TimeAxis(1732600000, 600), {1, 1}, 400);
  panels.panel("range [m]");
  panels.line("it's <estimated>", {0, 300, 600}, {10, std::nan(""), 30}, plot::colour(1));
  panels.band({0, 300, 600}, {1, 2, 3}, plot::translucent(0));
  panels.level(3);
  auto& axis = panels.panel("σ [m]");
  axis["type"] = "log";
  panels.points("fix", {100, 200}, {0.1, 20}, plot::kGrey, 4);
  panels.ticks("used", {50, 60}, 0.5, plot::colour(0));
  return panels.figure("Range over time", "");
}

TEST(FigureScript, HasTheDataAndTheTextsOfThePage) {
  const std::string script = figure_script(two_panels(), PlotFormat::pdf);
  EXPECT_THAT(script, AllOf(HasSubstr("format = 'pdf'"), HasSubstr("\n1732600000 10 0\n\n1732600600 30 0\n")))
      << "seconds, and a gap where there is no value";
  EXPECT_THAT(script, AllOf(HasSubstr("title 'it''s <estimated>'"), HasSubstr("set ylabel 'σ [m]'"),
                            HasSubstr("set logscale y"), HasSubstr("set xlabel 'UTC, 2024-11-26'")));
  EXPECT_THAT(script, Not(HasSubstr("system"))) << "texts of files are not executed";
  EXPECT_EQ(figure_name(two_panels()), "range_over_time");
}

TEST(FigureScript, IsDrawnInAllFormats) {
  TANDEM_NEEDS_GNUPLOT("figures of a report");
  plot::Json line = plot::line("path", {0, 1, 2}, {0, 1, 0}, plot::colour(0)), map = plot::layout("x [m]", "y [m]");
  map["yaxis"]["scaleanchor"] = "x";
  plot::Json space = line, scene = plot::layout("", "");
  space["type"] = "scatter3d";
  space["z"] = {0, 1, 2};
  for (const char* axis : {"x", "y", "z"}) {
    scene["scene"][std::string(axis) + "axis"] = {{"title", {{"text", axis}}}, {"range", {2, 0}}};
    scene["scene"]["aspectratio"][axis] = 1;
  }
  const plot::Json lines = plot::Json::array({line}), lines_in_space = plot::Json::array({space});
  for (const HtmlFigure& figure : {two_panels(), HtmlFigure("Map", "", lines, map, 400, 1),
                                   HtmlFigure("In space", "", lines_in_space, scene, 400)}) {
    EXPECT_THAT(draw_figure(figure, PlotFormat::svg), AllOf(HasSubstr("<svg"), HasSubstr("</svg>"))) << figure.title;
    EXPECT_THAT(draw_figure(figure, PlotFormat::pdf), testing::StartsWith("%PDF")) << figure.title;
  }
}

}  // namespace
}  // namespace tandem
