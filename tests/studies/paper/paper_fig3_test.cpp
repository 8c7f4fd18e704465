#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/paper/paper_fig3_files.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/plots.hpp>

#include "needs_program.hpp"
#include "studies/scratch.hpp"

namespace tandem::fig3 {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

TEST(Fig3, ArcPoseFollowsCircle) {
  for (int k = 0; k <= 30; ++k) {
    const double t = 0.5 * k, angle = turn_rate * t;
    const SE3 pose = arc_pose(t);
    EXPECT_LT((pose.translation() - radius * Vector<3>(std::cos(angle), std::sin(angle), 0)).norm(), 1e-14);
    EXPECT_LT((pose.rotation().matrix().col(0) - Vector<3>(-std::sin(angle), std::cos(angle), 0)).norm(), 1e-14);
    EXPECT_LT(off_arc(pose).distance, 1e-14);
    EXPECT_LT(off_arc(pose).angle, 1e-14);
  }
}

TEST(Fig3, OffArcIncludesHeightAndTilt) {
  const SE3 above = SE3(SO3(), {0, 0, 4}) * arc_pose(2.0), outside(arc_pose(0).rotation(), {radius + 3, 0, 4});
  EXPECT_NEAR(off_arc(above).distance, 4.0, 1e-14);
  EXPECT_NEAR(off_arc(outside).distance, 5.0, 1e-14);
  for (const int axis : {1, 2})  // pitch, yaw
    for (const double angle : {1e-9, 0.3, std::numbers::pi / 2, 3.0})
      EXPECT_NEAR(off_arc(arc_pose(1.0) * SE3(SO3::Exp(angle * Vector<3>::Unit(axis)), {0, 0, 0})).angle, angle, 1e-15);
}

/// Expects that every pose is on the arc, heads along it, and is at the position of constant twist at its time.
void expect_on_the_arc(const Solution& s) {
  EXPECT_TRUE(s.summary.converged()) << s.summary.message;
  ASSERT_EQ(s.solved.size(), s.panel.poses.size());
  for (std::size_t k = 0; k < s.solved.size(); ++k) {
    const SE3 expected = arc_pose(s.panel.poses[k].t);
    EXPECT_LT(off_arc(s.solved[k]).distance, 1e-9) << "pose " << k;
    EXPECT_LT(off_arc(s.solved[k]).angle, 1e-9) << "pose " << k;
    EXPECT_LT((s.solved[k].matrix() - expected.matrix()).cwiseAbs().maxCoeff(), 2e-9) << "pose " << k;
    if (s.panel.poses[k].given) {
      EXPECT_EQ(s.solved[k].matrix(), expected.matrix()) << "pose " << k;
    }
  }
}

double farthest(const std::vector<SE3>& poses) {
  double distance = 0.0;
  for (const SE3& pose : poses) distance = std::max(distance, off_arc(pose).distance);
  return distance;
}

TEST(Fig3, AllPanelsConvergeToArcFromPoorGuesses) {
  for (const Panel& panel : panels()) {
    double poorest = 0.0;  // largest distance of any initial guess from the arc
    for (unsigned seed = 1; seed <= 200; ++seed) {
      SCOPED_TRACE(panel.title + ", seed " + std::to_string(seed));
      const Solution s = solve(panel, GaussNewtonOptions{}, seed);
      expect_on_the_arc(s);
      EXPECT_GT(farthest(s.start), 0.03);
      poorest = std::max(poorest, farthest(s.start));
    }
    EXPECT_GT(poorest, 0.7 * radius) << panel.title;
  }
}

TEST(Fig3, AllSolversConvergeToArc) {
  std::vector<std::string> solvers = {"gauss-newton"};
  if (ipopt_available()) solvers.push_back("ipopt");
  for (const std::string& algorithm : nlopt_algorithms())  // mma and ccsaq need thousands of iterations
    if (algorithm != "mma" && algorithm != "ccsaq") solvers.push_back("nlopt:" + algorithm);
  for (const std::string& solver : solvers)
    for (const Panel& panel : panels())
      for (unsigned seed = 1; seed <= 10; ++seed) {
        SCOPED_TRACE(solver + ", " + panel.title + ", seed " + std::to_string(seed));
        expect_on_the_arc(solve(panel, parse_solver("--solver", solver), seed));
      }
}

TEST(Fig3, AcceptsUnevenTimes) {
  const Panel panel{"uneven", {{0.0, true}, {0.8, false}, {2.0, false}, {2.9, false}, {4.2, true}, {5.0, false}}};
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    expect_on_the_arc(solve(panel, GaussNewtonOptions{}, seed));
  }
}

TEST(Fig3, SeedDeterminesInitialGuess) {
  const Panel panel = panels().back();
  const auto start = [&](unsigned seed) { return solve(panel, GaussNewtonOptions{}, seed).start[1].matrix(); };
  EXPECT_EQ(start(1), start(1));
  EXPECT_NE(start(1), start(2));
}

TEST(Fig3, DrawsFigure) {
  TANDEM_NEEDS_GNUPLOT("the picture of fig3");
  const ScratchFolder folder;
  std::vector<Solution> solutions;
  for (const Panel& panel : panels()) solutions.push_back(solve(panel, GaussNewtonOptions{}, 1));
  write_poses(solutions, folder.path());
  ASSERT_EQ(draw_plots("paper", PlotFormat::svg, folder.path()), "");
  const std::string svg = read_file(folder.path() / "fig3.svg");
  for (const char* text :
       {"(a) extrapolation", "(b) interpolation", "(c) chain", "given pose", "solved pose", "</svg>"})
    EXPECT_THAT(svg, HasSubstr(text));
  ASSERT_EQ(draw_plots("paper", PlotFormat::png, folder.path()), "");
  EXPECT_THAT(read_file(folder.path() / "fig3.png"), StartsWith("\x89PNG"));
}

}  // namespace
}  // namespace tandem::fig3
