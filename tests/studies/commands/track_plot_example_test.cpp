#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "needs_program.hpp"
#include "run_tandem.hpp"

namespace tandem {
namespace {

using ::testing::ContainsRegex;

/// Stands in for matplotlib: prints the last title and the number of points of each curve.
constexpr const char* kPyplot = R"(
class Curve:
    def set_data(self, x, y): self.x, self.y = x, y
class Axes:
    def __init__(self): self.curves, self.title = {}, ""
    def plot(self, *_, label): return [self.curves.setdefault(label, Curve())]
    def set(self, **_): pass
    def set_title(self, text): self.title = text
    def legend(self): pass
    def relim(self): pass
    def autoscale_view(self): pass
axes = Axes()
def subplots(): return None, axes
def ignore(*_): pass
ion = ioff = pause = ignore
def show():
    print(axes.title)
    for label, curve in axes.curves.items(): print(label, len(curve.x), len(curve.y))
)";

TEST(TrackPlotExample, PlotsAStreamOfJsonLines) {
  TANDEM_NEEDS_PROGRAM("python3", "examples/09_plot_a_track.py");
  const ScratchFolder scratch;
  const auto lines = scratch.path() / "lines", output = scratch.path() / "output", errors = scratch.path() / "errors";
  const Outcome run = run_tandem({"track", "docking_a", "--until", "40", "--json-lines", "--rate", "1"});
  ASSERT_EQ(run.status, 0) << run.errors;
  scratch.write("lines", run.output);
  std::filesystem::create_directory(scratch.path() / "matplotlib");
  scratch.write("matplotlib/__init__.py", "");
  scratch.write("matplotlib/pyplot.py", kPyplot);
  const std::string example = std::string(paths::source) + "/examples/09_plot_a_track.py";
  const std::string command = "PYTHONPATH='" + scratch.path().string() + "' python3 -B '" + example + "' < '" +
                              lines.string() + "' > '" + output.string() + "' 2> '" + errors.string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0) << read_file(errors);
  EXPECT_THAT(read_file(output), ContainsRegex("^[34][0-9]\\.[0-9] s, target aided\nchaser [34][0-9] [34][0-9]\n"
                                               "target [1-4][0-9] [1-4][0-9]\nahead 2 2\n$"));
}

}  // namespace
}  // namespace tandem
