#include <algorithm>
#include <csignal>
#include <map>
#include <regex>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <tandem/studies/support/gnuplot.hpp>
#include <tandem/studies/support/plots.hpp>

#include "needs_program.hpp"
#include "paths.hpp"
#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr const char* kNoGnuplot = "no plots were drawn: gnuplot is not installed (Debian package: gnuplot-nox)";

/// Returns a script that plots a column of data.csv.
std::string script(const std::string& head) {
  return "# A plot.\n" + head + "\nset terminal svg\nset datafile separator comma\nplot ARG1.'/data.csv' using 1\n";
}

TEST(Plots, ReadsMetadataOfScripts) {
  const ScratchFolder scripts;
  scripts.write("b.gp", "# B.\n#\n# of: x y\n# needs: a.csv b.tum\nplot 1\n# of: z\n");
  scripts.write("a.gp", "# of: y\n");
  scripts.write("common.gp", "# Included by the others.\nplot 2\n");
  scripts.write("notes.txt", "# of: x\n");
  const auto plots = plots_in(scripts.path());
  ASSERT_EQ(plots.size(), 2u);
  EXPECT_EQ(plots[0].file.filename(), "a.gp");
  EXPECT_THAT(plots[0].needs, IsEmpty());
  EXPECT_THAT(plots[1].commands, ElementsAre("x", "y"));
  EXPECT_THAT(plots[1].needs, ElementsAre("a.csv", "b.tum"));
}

/// Returns the names of all commands: each is the name of a source file COMMAND_command.cpp.
std::vector<std::string> commands() {
  const std::string suffix = "_command.cpp";
  std::vector<std::string> names;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(paths::source) / "studies" / "commands"))
    if (const std::string name = entry.path().filename(); name.ends_with(suffix))
      names.push_back(name.substr(0, name.size() - suffix.size()));
  return names;
}

/// Each installed script either draws output of existing commands, or is called by other scripts.
TEST(Plots, EveryInstalledScriptIsUsed) {
  std::map<std::string, std::string> scripts;
  for (const auto& entry : std::filesystem::directory_iterator(plot_scripts()))
    if (entry.path().extension() == ".gp") scripts[entry.path().filename()] = read_file(entry.path());
  std::set<std::string> drawn;
  for (const PlotScript& plot : plots_in(plot_scripts())) {
    drawn.insert(plot.file.filename());
    EXPECT_THAT(plot.needs, testing::Not(IsEmpty())) << plot.file;
    for (const std::string& command : plot.commands) EXPECT_THAT(commands(), testing::Contains(command)) << plot.file;
  }
  EXPECT_THAT(drawn, testing::Not(IsEmpty()));
  for (const auto& [name, text] : scripts) {
    const bool called = std::any_of(scripts.begin(), scripts.end(), [&, name = name](const auto& other) {
      return other.first != name && std::regex_search(other.second, std::regex("call [^\n]*['\"]" + name + "['\"]"));
    });
    EXPECT_NE(drawn.contains(name), called)
        << name << " must either draw output of a command or be called by another script";
  }
}

TEST(Plots, DrawsPlotsOfCommand) {
  TANDEM_NEEDS_GNUPLOT("selection of scripts");
  const ScratchFolder scripts, out;
  scripts.write("mine.gp", script("# of: other mine\n# needs: data.csv"));
  scripts.write("other.gp", script("# of: other"));
  scripts.write("nothing.gp", "# of: mine\nexit\n");
  scripts.write("later.gp", script("# of: mine\n# needs: data.csv more.csv"));
  EXPECT_EQ(draw_plots("mine", PlotFormat::svg, out.path(), scripts.path()), "");
  EXPECT_THAT(files(out.path()), IsEmpty()) << "data.csv is missing";
  out.write("data.csv", "1\n2\n");
  EXPECT_EQ(draw_plots("mine", PlotFormat::svg, out.path(), scripts.path()), "");
  EXPECT_THAT(files(out.path()), testing::UnorderedElementsAre("data.csv", "mine.svg"));
  EXPECT_THAT(read_file(out.path() / "mine.svg"), HasSubstr("</svg>"));
}

TEST(Plots, FolderNameMayHaveQuotesAndBlanks) {
  TANDEM_NEEDS_GNUPLOT("names with quotes and blanks");
  const ScratchFolder scripts, scratch;
  scripts.write("x.gp", script("# of: x"));
  const auto out = scratch.path() / "it's `touch hit` \"a\" $b |c";
  std::filesystem::create_directories(out);
  std::ofstream(out / "data.csv") << "1\n2\n";
  EXPECT_EQ(draw_plots("x", PlotFormat::svg, out, scripts.path()), "");
  EXPECT_TRUE(std::filesystem::exists(out / "x.svg"));
}

TEST(Plots, FailureIsOneSentenceAndLeavesNoPicture) {
  TANDEM_NEEDS_GNUPLOT("errors of gnuplot");
  const ScratchFolder scripts, out;
  scripts.write("x.gp", "# of: x\nset terminal svg\nplot nothing at all\n");
  EXPECT_THAT(draw_plots("x", PlotFormat::svg, out.path(), scripts.path()),
              testing::MatchesRegex("x.svg was not drawn: .*line 3: .+"));
  scripts.write("x.gp", "# of: x\nset terminal svg\nplot 1\nexit status 3\n");
  EXPECT_EQ(draw_plots("x", PlotFormat::svg, out.path(), scripts.path()),
            "x.svg was not drawn: gnuplot failed without a message");
  scripts.write("x.gp", "# of: x\nset print '-'\nprint '<svg half of it'\n");
  EXPECT_EQ(draw_plots("x", PlotFormat::svg, out.path(), scripts.path()),
            "x.svg was not drawn: the output of gnuplot is incomplete");
  EXPECT_THAT(files(out.path()), IsEmpty());
}

/// Limits the size of files that this process writes, like a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    signal_ = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, signal_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*signal_)(int);
};

TEST(Plots, ReportsFullDisk) {
  TANDEM_NEEDS_GNUPLOT("a full disk");
  const ScratchFolder scripts, out;
  scripts.write("x.gp", script("# of: x"));
  out.write("data.csv", "1\n2\n");
  std::string note;
  {
    const FileSizeLimit limit(1000);
    note = draw_plots("x", PlotFormat::svg, out.path(), scripts.path());
  }
  EXPECT_THAT(note, StartsWith("x.svg was not drawn: "));
  EXPECT_THAT(note, HasSubstr("File too large"));
  EXPECT_THAT(files(out.path()), ElementsAre("data.csv"));
}

TEST(Plots, ReportsMissingGnuplotOnce) {
  const ScratchFolder scripts, out;
  scripts.write("x.gp", script("# of: x"));
  scripts.write("y.gp", script("# of: x"));
  const Path path(out.path().string());
  EXPECT_EQ(draw_plots("x", PlotFormat::svg, out.path(), scripts.path()), kNoGnuplot);
  EXPECT_THAT(files(out.path()), IsEmpty());
}

TEST(Plots, ReportsMissingScripts) {
  const ScratchFolder out;
  EXPECT_THAT(draw_plots("x", PlotFormat::svg, out.path(), out.path() / "none"),
              HasSubstr("no plots were drawn: found no plot scripts in "));
}

}  // namespace
}  // namespace tandem
