#include <regex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/estimation/estimate.hpp>

#include "needs_program.hpp"
#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::StartsWith;
using testing::UnorderedElementsAre;

/// Returns the arc errors in a printed table, before and after the solve [m].
std::vector<std::pair<double, double>> arc_errors(const std::string& table) {
  // x, y and heading of an unknown pose also have the form "before → after"; the arc error is the fourth such cell.
  const std::regex row("\n +[0-9] +[0-9.]+( +-?[0-9.]+ → -?[0-9.]+){3} +([0-9.]+) → ([0-9.e+-]+) ");
  std::vector<std::pair<double, double>> distances;
  for (std::sregex_iterator match(table.begin(), table.end(), row), end; match != end; ++match)
    distances.emplace_back(std::stod((*match)[2]), std::stod((*match)[3]));
  return distances;
}

TEST(PaperCommand, IsListed) {
  EXPECT_THAT(run_tandem({"--help"}).output,
              ContainsRegex("paper +Reproduce figures and tables of the paper: fig3, table1, fig1, fig6 or fig7\n"));
  const Outcome help = run_tandem({"paper", "--help"});
  EXPECT_EQ(help.status, 0);
  for (const char* text : {"NAME", "fig3", "--solver", "augmented-lagrangian", "--out", "--plots", "Exit status"})
    EXPECT_THAT(help.output, HasSubstr(text));
}

TEST(PaperCommand, Fig3PutsAllPosesOnArc) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  const Outcome run = run_tandem({"paper", "fig3", "--out", out.string()});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(run.errors, "");
  for (const char* panel :
       {"(a) extrapolation: converged in", "(b) interpolation: converged in", "(c) chain: converged in"})
    EXPECT_THAT(run.output, HasSubstr(panel));
  const auto distances = arc_errors(run.output);
  EXPECT_EQ(distances.size(), 1u + 1u + 4u) << run.output;
  for (const auto& [before, after] : distances) {
    EXPECT_GT(before, 0.1);
    EXPECT_LT(after, 1e-9);
  }
  EXPECT_THAT(files(out), UnorderedElementsAre("fig3.txt", "fig3.csv", "fig3.svg", "run.yaml"));
  EXPECT_EQ(read_file(out / "fig3.txt") + "\nWritten to " + out.string() + "\n", run.output);
  EXPECT_THAT(read_file(out / "fig3.svg"), HasSubstr("</svg>"));
}

TEST(PaperCommand, SupportsSolversAndPlotFormats) {
  const ScratchFolder scratch;
  std::vector<std::string> solvers = {"augmented-lagrangian"};
  if (ipopt_available()) solvers.push_back("ipopt");
  if (!nlopt_algorithms().empty()) solvers.push_back("nlopt:lbfgs");
  for (const std::string& solver : solvers) {
    const Outcome run = run_tandem({"paper", "fig3", "--solver", solver, "--out", scratch.path(), "--plots", "png"});
    ASSERT_EQ(run.status, 0) << solver << ": " << run.errors;
    EXPECT_THAT(run.output, HasSubstr("by " + solver));
    const auto distances = arc_errors(run.output);
    EXPECT_EQ(distances.size(), 6u);
    for (const auto& [before, after] : distances) EXPECT_LT(after, 1e-9) << solver;
    EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("fig3.txt", "fig3.csv", "fig3.png", "run.yaml"));
  }
  EXPECT_EQ(run_tandem({"paper", "fig3", "--out", scratch.path(), "--plots", "off"}).status, 0);
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("fig3.txt", "fig3.csv", "run.yaml"))
      << "removes the previous picture";
}

TEST(PaperCommand, WarnsWithoutGnuplot) {
  const ScratchFolder scratch, no_programs;
  const Path path(no_programs.path().string());
  const Outcome run = run_tandem({"paper", "fig3", "--out", scratch.path()});
  EXPECT_EQ(run.status, 0);
  EXPECT_THAT(run.output, StartsWith("Figure 3"));
  EXPECT_THAT(run.errors, StartsWith("tandem: no plots were drawn: gnuplot is not installed"));
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("fig3.txt", "fig3.csv", "run.yaml"));
}

TEST(PaperCommand, RejectsInvalidUsage) {
  const ScratchFolder scratch;
  const auto rejection = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "paper");
    arguments.insert(arguments.end(), {"--out", (scratch.path() / "out").string()});
    const Outcome run = run_tandem(arguments);
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.output, "");
    EXPECT_THAT(run.errors, ContainsRegex("^tandem: [^\n]+\n$"));
    EXPECT_THAT(files(scratch.path()), UnorderedElementsAre());
    return run.errors;
  };
  EXPECT_THAT(rejection({"fig4"}),
              HasSubstr("unknown figure 'fig4'; did you mean fig3? (available: fig3, table1, fig1, fig6 and fig7)"));
  EXPECT_THAT(rejection({"circle"}), HasSubstr("unknown figure 'circle' (available: "));
  EXPECT_THAT(rejection({}), HasSubstr("required"));
  EXPECT_THAT(rejection({"fig3", "more"}), HasSubstr("unknown argument 'more'"));
  EXPECT_THAT(rejection({"fig3", "--solver", "ipop"}), HasSubstr("did you mean ipopt?"));
  EXPECT_THAT(rejection({"fig3", "--plots", "gif"}), HasSubstr("--plots takes svg, png, pdf or off, not 'gif'"));
  EXPECT_THAT(rejection({"fig3", "--plot", "svg"}), HasSubstr("did you mean --plots?"));
}

/// Table I has the errors of both modes that `estimate` prints.
TEST(PaperCommand, Table1ShowsBothModes) {
  const ScratchFolder scratch;
  const std::string out = scratch.path() / "out";
  const Outcome run = run_tandem({"paper", "table1", "--out", out, "--plots", "off"});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_THAT(run.output, ContainsRegex("position +158 +2\\.668 ± 1\\.185 +1\\.57[0-9] ± 0\\.76[0-9] +1\\.62[0-9] ± "));
  EXPECT_THAT(run.output, HasSubstr("Mode A / raw 0.59, Mode B / raw 0.61, Mode B / Mode A 1.03"));
  EXPECT_THAT(files(out), UnorderedElementsAre("table1.txt", "table1.csv", "run.yaml"));
}

TEST(LongPaperCommand, DrawsFiguresOfBothModes) {
  TANDEM_NEEDS_GNUPLOT("figures of both modes");
  for (const std::string figure : {"fig1", "fig6", "fig7"}) {
    const ScratchFolder scratch;
    const std::string out = scratch.path() / "out";
    const Outcome run = run_tandem({"paper", figure, "--out", out});
    ASSERT_EQ(run.status, 0) << run.errors;
    EXPECT_EQ(run.errors, "");
    EXPECT_THAT(files(out), UnorderedElementsAre(figure + ".txt", figure + ".csv", figure + ".svg", "run.yaml"));
    EXPECT_THAT(read_file(out + "/" + figure + ".svg"), HasSubstr("Mode B"));
  }
}

}  // namespace
}  // namespace tandem
