#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/gnuplot.hpp>
#include <tandem/studies/plots.hpp>

#include "scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

/// Puts back what it was.
class Path {
 public:
  explicit Path(const std::string& value) : before_(getenv("PATH")) { setenv("PATH", value.c_str(), 1); }
  ~Path() { setenv("PATH", before_.c_str(), 1); }
  Path(const Path&) = delete;
  Path& operator=(const Path&) = delete;

 private:
  std::string before_;
};

Estimate straight_line(Scenario& scenario) {
  Estimate estimate;
  estimate.scenario = "it's `a` \"name\"\nset output 'elsewhere'";
  for (int k = 0; k < 5; ++k) {
    const auto at = [&](double x) { return SE3(SO3(), Vector<3>(x, 0, 0)); };
    estimate.keyframes.push_back({double(k), KeyframeType::usbl, Vector<3>(5, 0, 0), {}});
    estimate.chaser.push_back(at(k));
    estimate.target.push_back(at(k + 5.5));
    scenario.truth_chaser.push_back({double(k), at(k)});
    scenario.truth_target.push_back({double(k), at(k + 5)});
  }
  estimate.errors = keyframe_errors(scenario, estimate.keyframes, estimate.chaser, estimate.target);
  return estimate;
}

TEST(Gnuplot, StringsHoldAnything) {
  EXPECT_EQ(gnuplot_string("it's"), "'it''s'");
  EXPECT_EQ(gnuplot_string("a\nb"), "'a b'");
}

TEST(Gnuplot, ABadScriptIsAnswered) {
  const ScratchFolder folder;
  EXPECT_THAT(run_gnuplot("set terminal svg\nplot nothing at all\n", folder.path() / "x.svg"),
              StartsWith("gnuplot did not draw x.svg: "));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "x.svg"));
}

TEST(Gnuplot, ItsAbsenceIsAnswered) {
  const ScratchFolder folder;
  const Path path(folder.path().string());
  EXPECT_EQ(run_gnuplot("", folder.path() / "x.svg"),
            "gnuplot is not installed, so no plots were drawn (Debian's package is gnuplot-nox)");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "x.svg"));
}

TEST(Plots, AreDrawnWithTruth) {
  const ScratchFolder folder;
  Scenario scenario;
  const Estimate estimate = straight_line(scenario);
  ASSERT_EQ(draw_plots(estimate, scenario, PlotFormat::svg, folder.path()), "");
  EXPECT_THAT(read_file(folder.path() / "trajectories.svg"), HasSubstr("</svg>"));
  EXPECT_THAT(read_file(folder.path() / "trajectories.svg"), HasSubstr("it's `a`")) << "the title is shown as it is";
  EXPECT_THAT(read_file(folder.path() / "errors.svg"), HasSubstr("</svg>"));
  ASSERT_EQ(draw_plots(estimate, scenario, PlotFormat::png, folder.path()), "");
  EXPECT_THAT(read_file(folder.path() / "trajectories.png"), StartsWith("\x89PNG"));
  EXPECT_THAT(read_file(folder.path() / "errors.png"), StartsWith("\x89PNG"));
}

TEST(Plots, WithoutTruthThereAreNoErrorsToDraw) {
  const ScratchFolder folder;
  Scenario scenario;
  Estimate estimate = straight_line(scenario);
  scenario.truth_chaser.clear();
  estimate.errors = keyframe_errors(scenario, estimate.keyframes, estimate.chaser, estimate.target);
  ASSERT_EQ(draw_plots(estimate, scenario, PlotFormat::svg, folder.path()), "");
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "trajectories.svg"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "errors.svg"));
}

TEST(Plots, TruthWithoutOrientationHasOnePanel) {
  const ScratchFolder folder;
  Scenario scenario;
  Estimate estimate = straight_line(scenario);
  scenario.truth_orientation = false;
  estimate.errors = keyframe_errors(scenario, estimate.keyframes, estimate.chaser, estimate.target);
  ASSERT_EQ(draw_plots(estimate, scenario, PlotFormat::svg, folder.path()), "");
  EXPECT_THAT(read_file(folder.path() / "errors.svg"), testing::Not(HasSubstr("orientation error")));
}

}  // namespace
}  // namespace tandem
