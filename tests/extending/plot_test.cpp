// Example of docs/contributing.md, "A new plot": Tandem finds the script by its header and draws a file of the run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/support/plots.hpp>

#include "needs_program.hpp"
#include "paths.hpp"
#include "studies/scratch.hpp"

namespace tandem {
namespace {

TEST(Extending, PlotScriptIsFoundAndDrawn) {
  TANDEM_NEEDS_GNUPLOT("the plot of docs/contributing.md");
  const ScratchFolder scripts, run;
  std::filesystem::copy(plot_scripts(), scripts.path(), std::filesystem::copy_options::recursive);
  std::filesystem::copy(std::filesystem::path(paths::source) / "tests/extending/weights.gp", scripts.path());
  run.write("weights.csv", "sensor,t,part,weight\n\"front, left\",1,all,0.25\nusbl,2,all,0.5\n");
  EXPECT_EQ(draw_plots("estimate", PlotFormat::svg, run.path(), scripts.path()), "");
  EXPECT_THAT(read_file(run.path() / "weights.svg"),
              testing::AllOf(testing::HasSubstr("</svg>"), testing::HasSubstr("weight")));
}

}  // namespace
}  // namespace tandem
