#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/comparison/compare_report.hpp>
#include <tandem/studies/comparison/models_report.hpp>
#include <tandem/studies/support/csv.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/plots.hpp>

#include "needs_program.hpp"
#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::Not;

ComparedSolve solve(const std::string& solver, Role role, double cost, std::vector<CurvePoint> curve) {
  ComparedSolve s;
  s.solver = solver;
  s.role = role;
  s.keyframes = 24;
  s.status = "converged";
  s.message = "a, \"b\"";
  s.solved = !curve.empty();
  s.cost = cost;
  s.curve = std::move(curve);
  return s;
}

Comparison made_up() {
  Comparison comparison;
  comparison.scenario = "it's, \"x\"";
  comparison.solves = {solve("gauss-newton", Role::off, 1, {{0.001, 10, 0}, {0.01, 1, 0}}),
                       solve("ipopt:exact", Role::off, 1.5, {{0.01, 10, 0}, {0.1, 1.5, 0}, {0.2, 2, 0}}),
                       solve("nlopt:lbfgs", Role::off, 0, {}),
                       solve("augmented-lagrangian", Role::hard, 2, {{0.001, 0.5, 1}, {0.01, 2, 0}})};
  comparison.solves[1].status = "time-limit";
  return comparison;
}

std::string drawn(const Comparison& comparison, const ScratchFolder& folder) {
  write_file(folder.path() / "compare.csv", compare_csv(comparison));
  write_file(folder.path() / "compare_progress.csv", progress_csv(comparison));
  return draw_plots("compare", PlotFormat::svg, folder.path());
}

TEST(CompareFiles, WriteRowPerSolve) {
  const std::string text = compare_csv(made_up());
  std::vector<std::vector<std::string>> rows;
  for (std::size_t at = 0, end; (end = text.find('\n', at)) != std::string::npos; at = end + 1)
    rows.push_back(csv_cells(std::string_view(text).substr(at, end - at)));
  ASSERT_EQ(rows.size(), 5u);
  for (const auto& row : rows) EXPECT_EQ(row.size(), rows.front().size());
  EXPECT_EQ(rows[1].front(), "it's, \"x\"");
  EXPECT_EQ(rows[1].back(), "a, \"b\"");
  const auto cost = std::size_t(std::find(rows[0].begin(), rows[0].end(), "cost") - rows[0].begin());
  EXPECT_EQ(rows[2].at(cost), "1.5");
  EXPECT_EQ(rows[3].at(cost), "") << "not solved";
}

TEST(ComparePlot, DrawsPanelPerProblem) {
  TANDEM_NEEDS_GNUPLOT("the plot of compare");
  const ScratchFolder folder;
  ASSERT_EQ(drawn(made_up(), folder), "");
  const std::string svg = read_file(folder.path() / "compare.svg");
  for (const char* text : {"24 keyframes,", "no constraints", "hard constraints", "gauss-newton", "ipopt:exact",
                           "augmented-lagrangian", "converged", "not converged", "relative distance of the cost"})
    EXPECT_THAT(svg, HasSubstr(text));
  EXPECT_THAT(svg, Not(HasSubstr("nlopt"))) << "not solved";
}

TEST(ComparePlot, IsOmittedWithoutSolves) {
  TANDEM_NEEDS_GNUPLOT("the plot of an empty comparison");
  const ScratchFolder folder;
  EXPECT_EQ(drawn({}, folder), "");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "compare.svg"));
}

ModelResult result(const std::string& name, double position) {
  ModelResult r;
  r.name = name;
  r.status = "converged";
  r.solved = true;
  for (ErrorSummary* errors : {&r.errors[0], &r.all}) {  // keyframes with a position
    errors->n = errors->compared = 4;
    errors->position = MeanStd{position, 0, 4};
    errors->orientation = MeanStd{10 * position, 0, 4};
  }
  return r;
}

TEST(ModelsPlot, DrawsRowPerModel) {
  TANDEM_NEEDS_GNUPLOT("the plot of models");
  const ScratchFolder folder;
  ModelResult refused;
  refused.name = "mode-b";
  refused.status = "refused";
  write_file(folder.path() / "models.csv",
             models_csv("small", {result("constant-twist+surge:0,2.5:soft", 1), result("steady_course", 3), refused}));
  ASSERT_EQ(draw_plots("models", PlotFormat::svg, folder.path()), "");
  const std::string svg = read_file(folder.path() / "models.svg");
  for (const char* text : {"constant-twist+surge:0,2.5:soft", "steady_course", "mode-b (refused)", "position error [m]",
                           "orientation error", ">position<", "small: mean errors"})
    EXPECT_THAT(svg, HasSubstr(text));
  EXPECT_THAT(svg, Not(HasSubstr(">pose<"))) << "no such keyframes";

  write_file(folder.path() / "models.csv", models_csv("small", {refused}));
  std::filesystem::remove(folder.path() / "models.svg");
  EXPECT_EQ(draw_plots("models", PlotFormat::svg, folder.path()), "");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "models.svg")) << "no errors";
}

}  // namespace
}  // namespace tandem
