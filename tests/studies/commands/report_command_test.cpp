#include <cstdlib>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/report/plotly_library.hpp>

#include "needs_program.hpp"
#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

const char* const kGapStudy =
    "name: 'gaps <i>'\nquestion: How far?\nparameters: {minutes: 2, gap: [0, 5, 10], gap_period: 40}\n"
    "models: [constant-twist, mode-b]\nseeds: 4\n";

/// Returns whether the report failed because plotly.js, an optional dependency, is missing. Fails if everything is
/// required.
bool library_is_missing(const Outcome& run) {
  if (run.errors.find("a report needs plotly.js") == std::string::npos) return false;
  EXPECT_FALSE(everything_required()) << run.errors;
  EXPECT_EQ(run.status, 1);
  return true;
}

void expect_figures(const std::string& page, std::initializer_list<const char*> titles) {
  for (const char* title : titles) EXPECT_THAT(page, HasSubstr("<figcaption><b>" + std::string(title) + ".</b>"));
  std::size_t figures = 0;
  for (std::size_t at = 0; (at = page.find("<script type=\"application/json\"", at)) != std::string::npos;
       ++at, ++figures) {
    const std::size_t begin = page.find('>', at) + 1;
    EXPECT_TRUE(nlohmann::json::accept(page.substr(begin, page.find("</script>", begin) - begin)));
  }
  EXPECT_GE(figures, titles.size());
  EXPECT_LT(page.size() - plotly_library().size(), 4'000'000u);
}

/// Opens the page in a browser. Expects no error on its console, and all figures drawn.
void expect_opens(const std::filesystem::path& page, const ScratchFolder& scratch) {
  const std::string text = read_file(page);
  std::size_t plots = 0;
  for (std::size_t at = 0; (at = text.find("<div class=\"plot\"", at)) != std::string::npos; ++at) ++plots;
  const std::string dom = scratch.path() / "dom.html", log = scratch.path() / "console.txt";
  const std::string browser =
      "chromium --headless=new --no-sandbox --disable-gpu --use-angle=swiftshader --enable-unsafe-swiftshader "
      "--virtual-time-budget=20000 --enable-logging=stderr --user-data-dir='" +
      (scratch.path() / "profile").string() + "' --dump-dom 'file://" + page.string() + "' > '" + dom + "' 2> '" + log +
      "'";
  ASSERT_EQ(std::system(browser.c_str()), 0) << read_file(log);
  EXPECT_THAT(read_file(log), Not(ContainsRegex("CONSOLE.*(Uncaught|Error|Failed)")));
  const std::string drawn = read_file(dom);
  std::size_t count = 0;
  for (std::size_t at = 0; (at = drawn.find("class=\"plot js-plotly-plot\"", at)) != std::string::npos; ++at) ++count;
  EXPECT_EQ(count, plots);
}

/// Returns whether a browser is installed; scripts/setup does not install one.
bool browser_available() {
  if (program_present("chromium")) return true;
  std::cerr << "chromium absent: not checked: whether a report opens\n";
  return false;
}

TEST(ReportCommand, ReportsStudy) {
  const ScratchFolder scratch;
  const std::string file = scratch.write("gaps.yaml", kGapStudy), out = scratch.path() / "out";
  ASSERT_EQ(run_tandem({"study", "run", file, "--out", out, "--quiet"}).status, 0);
  const Outcome run = run_tandem({"report", out});
  TANDEM_NEEDS(!library_is_missing(run), "plotly.js", "reports");
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(run.output, "Written to " + out + "/report.html\n");
  const std::string page = read_file(out + "/report.html");
  EXPECT_THAT(page, HasSubstr("<h1>gaps &lt;i&gt;</h1>"));
  EXPECT_THAT(page, HasSubstr("<p>How far?</p>"));
  expect_figures(page, {"Errors within gaps against gap", "Errors within gaps", "Distribution over trials",
                        "Consistency", "Convergence", "Trajectories in space", "From above",
                        "Errors of the relative position over time", "Distribution of errors"});
  if (browser_available()) expect_opens(out + "/report.html", scratch);
}

TEST(ReportCommand, AnimatesRendezvous) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  const Outcome run =
      run_tandem({"rendezvous", "--methods", "decoupled,pursuit", "--duration", "15", "--out", out, "--quiet"});
  ASSERT_EQ(run.status, 0) << run.errors;
  const bool missing =
      run.errors.find("rendezvous.html was not written: a report needs plotly.js") != std::string::npos;
  if (missing) EXPECT_FALSE(everything_required()) << run.errors;
  TANDEM_NEEDS(!missing, "plotly.js", "reports");
  const std::string page = read_file(out / "rendezvous.html");
  EXPECT_THAT(page, HasSubstr("<h1>Rendezvous of a REMUS 100</h1>"));
  expect_figures(page, {"Manoeuvre, decoupled, seed 1", "Over time, decoupled, seed 1", "Manoeuvre, pursuit, seed 1",
                        "Over time, pursuit, seed 1"});
  EXPECT_THAT(page, HasSubstr("\"name\":\"14\""));  // one frame per second
  if (browser_available()) expect_opens(out / "rendezvous.html", scratch);
}

TEST(ReportCommand, ReportsStudyOfDives) {
  const ScratchFolder scratch;
  const std::string file = scratch.write(
      "dive.yaml", "name: dive\nsimulation: dive\nparameters: {minutes: 1, grade: [mems, tactical]}\nseeds: 2\n");
  const std::string out = scratch.path() / "out";
  ASSERT_EQ(run_tandem({"study", "run", file, "--out", out, "--quiet"}).status, 0);
  const Outcome run = run_tandem({"report", out});
  TANDEM_NEEDS(!library_is_missing(run), "plotly.js", "reports");
  ASSERT_EQ(run.status, 0) << run.errors;
  const std::string page = read_file(out + "/report.html");
  EXPECT_THAT(page, HasSubstr("Simulated dives"));
  EXPECT_THAT(page, HasSubstr("Worst trials"));
  expect_figures(page, {"Errors of the chaser's position", "Distribution over trials", "Consistency", "From above",
                        "Errors of the position over time"});
}

TEST(ReportCommand, ReportsEstimate) {
  const ScratchFolder scratch;
  const std::string out = scratch.path() / "out", page = scratch.path() / "page.html";
  ASSERT_EQ(
      run_tandem({"estimate", "docking_a", "--max-keyframes", "300", "--plots", "off", "--quiet", "--out", out}).status,
      0);
  const Outcome run = run_tandem({"report", out, "--page", page});
  TANDEM_NEEDS(!library_is_missing(run), "plotly.js", "reports");
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_THAT(read_file(page), HasSubstr("<h1>docking_a</h1>"));
  expect_figures(read_file(page),
                 {"From above", "Range and bearing of the target", "Uncertainty over time", "Measurements over time",
                  "Residuals over time", "Errors of the relative position over time", "Distribution of errors",
                  "Height over time", "Trajectories in space"});
  EXPECT_THAT(read_file(page), ContainsRegex("<h1>docking_a</h1>\n<p class=\"(good|bad)\">"));
  EXPECT_THAT(files(out), Not(testing::Contains("report.html")));
  if (browser_available()) expect_opens(page, scratch);
}

TEST(ReportCommand, ReportsTrack) {
  const ScratchFolder scratch;
  const std::string out = scratch.path() / "out";
  ASSERT_EQ(run_tandem({"track", "docking_a", "--until", "300", "--plots", "off", "--quiet", "--out", out}).status, 0);
  const Outcome run = run_tandem({"report", out});
  TANDEM_NEEDS(!library_is_missing(run), "plotly.js", "reports");
  ASSERT_EQ(run.status, 0) << run.errors;
  expect_figures(
      read_file(out + "/report.html"),
      {"Trajectories in space", "From above", "Errors of the relative position over time", "Distribution of errors",
       "Innovations", "Range and bearing of the target", "Uncertainty over time", "Measurements over time"});
}

TEST(ReportCommand, ReportsNavigation) {
  const ScratchFolder scratch;
  const std::string dive = scratch.path() / "dive", out = scratch.path() / "out";
  ASSERT_EQ(run_tandem({"simulate", "dive", "--minutes", "1", "--out", dive}).status, 0);
  ASSERT_EQ(run_tandem({"navigate", dive, "--plots", "off", "--quiet", "--out", out}).status, 0);
  const Outcome run = run_tandem({"report", out});
  TANDEM_NEEDS(!library_is_missing(run), "plotly.js", "reports");
  ASSERT_EQ(run.status, 0) << run.errors;
  const std::string page = read_file(out + "/report.html");
  expect_figures(page, {"Trajectories in space", "From above", "Errors of the position over time"});
  EXPECT_THAT(page, HasSubstr("Errors of the chaser, mean over keyframes"));
  EXPECT_THAT(page, testing::Not(HasSubstr("relative to the chaser")));
}

TEST(ReportCommand, RejectsInvalidUsage) {
  const ScratchFolder scratch;
  EXPECT_THAT(rejection_as_given({"report", "no_such_folder"}), HasSubstr("no_such_folder is not a folder"));
  EXPECT_THAT(rejection_as_given({"report", scratch.path()}),
              HasSubstr("is neither a study folder nor an output folder"));
  scratch.write("summary.json", "{");
  scratch.write("chaser.tum", "");
  scratch.write("chaser_full.csv", "t,x\n");
  scratch.write("errors.csv", "t\n");
  EXPECT_THAT(rejection_as_given({"report", scratch.path()}),
              HasSubstr("summary.json is damaged or was not written by tandem"));
  scratch.write("summary.json", "{}");
  EXPECT_THAT(rejection_as_given({"report", scratch.path()}), HasSubstr("chaser_full.csv has no column y"));
  EXPECT_THAT(files(scratch.path()),
              testing::UnorderedElementsAre("summary.json", "chaser.tum", "chaser_full.csv", "errors.csv"));
}

}  // namespace
}  // namespace tandem
