#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "needs_program.hpp"
#include "run_tandem.hpp"

namespace tandem {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::Not;

/// Returns the folder of a small scenario at scratch/NAME.
std::string scenario_in(const ScratchFolder& scratch, const std::string& name) {
  const ScratchFolder made;
  write_small_scenario(made);
  fs::create_directories((scratch.path() / name).parent_path());
  fs::copy(made.path(), scratch.path() / name);
  return (scratch.path() / name).string();
}

void make_pipe(const fs::path& path) {
  fs::remove(path);
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
}

/// Neither a shell nor gnuplot interprets the name of a folder.
TEST(HostileFiles, FolderNamesAreNotRun) {
  TANDEM_NEEDS_GNUPLOT("plots");
  const ScratchFolder scratch;
  const std::string owned = (scratch.path() / "OWNED").string();
  for (const std::string name :
       {"it's", "a'$(touch OWNED)'", "`touch OWNED`", "\"; system('touch OWNED'); \"", "<ls |"}) {
    SCOPED_TRACE(name);
    const std::string folder = scenario_in(scratch, name);
    const Outcome run = run_tandem({"estimate", folder, "--out", folder + "/results"});
    EXPECT_EQ(run.status, 0) << run.errors;
    EXPECT_EQ(run.errors, "");
    EXPECT_THAT(files(folder + "/results"), testing::Contains("trajectories.svg"));
  }
  EXPECT_FALSE(fs::exists(owned));
  EXPECT_FALSE(fs::exists("OWNED"));
}

/// A compare.csv from an untrusted source, whose cells are commands.
TEST(HostileFiles, CellsAreNotRun) {
  TANDEM_NEEDS_GNUPLOT("plots");
  const ScratchFolder scratch;
  const std::string solver = "gauss-newton|system('touch " + (scratch.path() / "OWNED").string() + "')|1";
  scratch.write("compare.csv", "scenario,keyframes,constraints,solver,status,cost,violation\n<touch OWNED,144,none," +
                                   solver + ",converged,24,0\n");
  scratch.write("compare_progress.csv", "keyframes,constraints,solver,seconds,cost,violation\n144,none," + solver +
                                            ",0.001,31,0\n144,none," + solver + ",0.002,24,0\n");
  const std::string script = std::string(paths::source) + "/share/plots/compare.gp";
  const Outcome run = run_program("/usr/bin/env", {"gnuplot", "-c", script, scratch.path().string(), "svg"});
  EXPECT_EQ(run.status, 0) << run.errors;
  EXPECT_TRUE(fs::exists(scratch.path() / "compare.svg"));
  EXPECT_FALSE(fs::exists(scratch.path() / "OWNED"));
}

TEST(HostileFiles, PlotScriptsRunNoCommands) {
  for (const auto& entry : fs::directory_iterator(std::string(paths::source) + "/share/plots")) {
    std::istringstream script(read_file(entry.path()));
    for (std::string line; std::getline(script, line);)
      if (!line.starts_with("#"))
        EXPECT_THAT(line, Not(testing::ContainsRegex("system *\\(|[\"']< |`"))) << entry.path();
  }
}

TEST(HostileFiles, LinksOutOfTheScenarioAreNotRead) {
  const ScratchFolder scratch;
  scratch.write("secret", "root:x:0:0\n");
  for (const char* name : {"usbl.csv", "chaser_odometry.tum", "truth_chaser.tum", "scenario.yaml"}) {
    SCOPED_TRACE(name);
    const std::string folder = scenario_in(scratch, std::string("with ") + name);
    fs::remove(folder + "/" + name);
    fs::create_symlink("../secret", folder + "/" + name);
    const std::string why = rejection({"estimate", folder});
    EXPECT_THAT(why, HasSubstr("--allow-outside"));
    EXPECT_THAT(why, Not(HasSubstr("root")));
  }
  const std::string folder = scenario_in(scratch, "declared");
  std::ofstream(folder + "/scenario.yaml", std::ios::app)
      << "sensors:\n  u2: {type: position, file: sub/secret, sigma: [1, 1, 1]}\n";
  fs::create_directory_symlink("..", folder + "/sub");
  EXPECT_THAT(rejection({"estimate", folder}), HasSubstr("'sub/secret' is outside the scenario folder"));
}

TEST(HostileFiles, LinksInsideAndAllowedLinksAreRead) {
  const ScratchFolder scratch;
  const std::string folder = scenario_in(scratch, "s");
  fs::create_directory(folder + "/raw");
  fs::rename(folder + "/usbl.csv", folder + "/raw/fixes");
  fs::create_symlink("raw/fixes", folder + "/usbl.csv");
  EXPECT_EQ(run_tandem({"estimate", folder, "--quiet"}).status, 0);
  fs::rename(folder + "/raw", scratch.path() / "raw");
  fs::create_directory_symlink("../raw", folder + "/raw");
  EXPECT_THAT(rejection({"estimate", folder}), HasSubstr("usbl.csv leads outside"));
  EXPECT_EQ(run_tandem({"estimate", folder, "--quiet", "--allow-outside"}).status, 0);
}

/// A pipe without a writer would be read for ever.
TEST(HostileFiles, PipesInResultsEndNothing) {
  const ScratchFolder scratch;
  const std::string folder = scenario_in(scratch, "s"), out = (scratch.path() / "r").string();
  ASSERT_EQ(run_tandem({"estimate", folder, "--out", out, "--plots", "off"}).status, 0);
  for (const char* name : {"errors.csv", "summary.json", "target_fixes.csv", "chaser_full.csv"}) {
    SCOPED_TRACE(name);
    const std::string copy = out + " with " + name;
    fs::copy(out, copy);
    make_pipe(copy + "/" + name);
    EXPECT_THAT(rejection_as_given({"report", copy}), HasSubstr(std::string(name) + " is a pipe"));
  }
  const std::string empty = (scratch.path() / "empty").string();
  fs::create_directory(empty);
  make_pipe(empty + "/.tandem-files");
  EXPECT_THAT(rejection_as_given({"estimate", folder, "--out", empty}),
              HasSubstr("tandem did not write .tandem-files"));
  EXPECT_EQ(run_tandem({"estimate", folder, "--out", empty, "--force", "--quiet"}).status, 0);
  EXPECT_EQ(run_tandem({"estimate", folder, "--out", out + "2", "--quiet"}).status, 0) << "a run beside it";
  make_pipe(out + "/report.html");
  EXPECT_THAT(rejection_as_given({"report", out}), HasSubstr("report.html is a pipe"));
}

TEST(HostileFiles, OutputFolderThatHoldsInputsIsRefused) {
  const ScratchFolder scratch;
  const std::string made = (scratch.path() / "made").string();
  ASSERT_EQ(run_tandem({"simulate", "docking", "--minutes", "1", "--out", made, "--quiet"}).status, 0);
  const std::string own = scenario_in(scratch, "own");
  for (const std::string& folder : {made, own})
    for (const char* command : {"estimate", "track", "models"}) {
      SCOPED_TRACE(folder + " " + command);
      const auto before = files(folder);
      EXPECT_THAT(
          rejection_as_given({command, folder, "--out", folder + "/../" + fs::path(folder).filename().string()}),
          HasSubstr("name another"));
      EXPECT_EQ(files(folder), before);
    }
  EXPECT_THAT(rejection_as_given({"estimate", own, "--out", made}), HasSubstr("is a scenario that tandem wrote"));
  const auto before = files(made);
  EXPECT_NE(run_tandem({"estimate", made, "--out", made, "--force", "--plots", "off", "--quiet"}).status, 1);
  EXPECT_THAT(files(made), IsSupersetOf(before)) << "--force keeps the scenario";
}

TEST(HostileFiles, ForeignFilesAreOverwrittenOnlyByForce) {
  const ScratchFolder scratch;
  const std::string folder = scenario_in(scratch, "s"), mine = (scratch.path() / "mine").string();
  fs::create_directory(mine);
  for (const char* name : {"errors.csv", "summary.json", "run.yaml", "chaser.tum"}) {
    SCOPED_TRACE(name);
    std::ofstream(mine + "/" + name) << "my own numbers";
    EXPECT_THAT(rejection_as_given({"estimate", folder, "--out", mine, "--plots", "off"}),
                HasSubstr(std::string("tandem did not write ") + name + "; name another folder, or add --force"));
    EXPECT_EQ(read_file(mine + "/" + name), "my own numbers");
    fs::remove(mine + "/" + name);
  }
  std::ofstream(mine + "/notes") << "kept";
  std::ofstream(mine + "/errors.csv") << "my own numbers";
  const std::vector<std::string> forced = {"estimate", folder, "--out", mine, "--quiet", "--plots", "off", "--force"};
  EXPECT_EQ(run_tandem(forced).status, 0);
  EXPECT_THAT(read_file(mine + "/errors.csv"), HasSubstr("position_error_m"));
  EXPECT_EQ(read_file(mine + "/notes"), "kept");
  EXPECT_EQ(run_tandem({"estimate", folder, "--out", mine, "--quiet", "--plots", "off"}).status, 0) << "its own files";
  std::ofstream(mine + "/report.html") << "my page";
  EXPECT_THAT(rejection_as_given({"report", mine}), HasSubstr("tandem did not write"));
  EXPECT_EQ(read_file(mine + "/report.html"), "my page");
}

TEST(HostileFiles, StandardErrorMayFail) {
  const ScratchFolder scratch;
  const std::string folder = scenario_in(scratch, "s");
  const auto lines = scratch.write("lines",
                                   "malformed\nodometry,0,0,0,0,0,0,0,1\nodometry,1,1,0,0,0,0,0,1\n"
                                   "usbl,1,5,0,0\nmalformed\nodometry,2,2,0,0,0,0,0,1\nusbl,2,5,0,0\n");
  const int full = open("/dev/full", O_WRONLY);
  ASSERT_GE(full, 0);
  const auto output = scratch.path() / "output";
  EXPECT_EQ(exit_status(start_tandem({"track", folder, "--stdin", "--json-lines"}, output, full, lines)), 0);
  EXPECT_THAT(read_file(output), HasSubstr("\"t\":2.0"));
  EXPECT_EQ(exit_status(start_tandem({"estimate", folder, "--verbose"}, output, full)), 0);
  EXPECT_EQ(exit_status(start_tandem({"estimate", "nothing"}, output, full)), 1);
  close(full);
  EXPECT_EQ(run_program("/bin/sh", {"-c", std::string(paths::executable) + " estimate nothing 2>&-"}).status, 1);
}

TEST(HostileFiles, FailureOfStandardOutputIsReported) {
  const ScratchFolder scratch;
  const std::string folder = scenario_in(scratch, "s"), tandem = paths::executable, out = folder + "/../r";
  for (const std::string& broken : {std::string("> /dev/full"), std::string(">&-"), std::string("| true")})
    for (const std::string& command :
         {"estimate " + folder + " --plots off --out " + out + "; echo $? >&2",
          std::string("estimate --help; echo $? >&2"), std::string("--help; echo $? >&2")}) {
      SCOPED_TRACE(command + broken);
      // The pipe is closed before tandem writes to it.
      const std::string wait = broken == "| true" ? "sleep 0.3; " : "";
      const Outcome run = run_program("/bin/sh", {"-c", "{ " + wait + tandem + " " + command + "; } " + broken});
      EXPECT_THAT(run.errors, HasSubstr("tandem: cannot write to standard output: "));
      EXPECT_THAT(run.errors, HasSubstr("\n1\n"));
    }
  EXPECT_TRUE(fs::exists(out + "/summary.json")) << "the files are written";
}

/// The noise file of calibrate can be read again for any name of a sensor.
TEST(HostileFiles, SensorNamesSurviveNoiseFiles) {
  const ScratchFolder scratch;
  const std::string folder = scenario_in(scratch, "s"), yaml = read_file(folder + "/scenario.yaml");
  fs::rename(folder + "/usbl.csv", folder + "/u.csv");
  for (const std::string name :
       {"a: b", "a #b", "[a", "*a", "- a", "~", "null", "NULL", "%s", "&a", "!t", "a'b", "é"}) {
    SCOPED_TRACE(name);
    std::ofstream(folder + "/scenario.yaml")
        << yaml << "sensors:\n  \"" << name << "\": {type: position, file: u.csv, sigma: [1.7, 1.7, 1.7]}\n";
    const std::string noise = (scratch.path() / "noise.yaml").string();
    const Outcome run =
        run_tandem({"calibrate", folder, "--folds", "0", "--free", name, "--write-noise", noise, "--quiet"});
    ASSERT_NE(run.status, 1) << run.errors;
    const Outcome again = run_tandem({"estimate", folder, "--noise-from", noise, "--quiet"});
    EXPECT_NE(again.status, 1) << again.errors << read_file(noise);
  }
}

/// Repeated keys are found in linear time, and SIGTERM interrupts reading.
TEST(HostileFiles, HugeScenarioFilesAreReadInLinearTime) {
  const ScratchFolder scratch;
  const std::string folder = scenario_in(scratch, "s");
  std::ofstream yaml(folder + "/scenario.yaml", std::ios::app);
  for (int i = 0; i < 200'000; ++i) yaml << "k" << i << ": 1\n";
  yaml.close();
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_THAT(rejection({"estimate", folder}), HasSubstr("unknown key 'k0'"));
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(60));  // quadratic: minutes
}

}  // namespace
}  // namespace tandem
