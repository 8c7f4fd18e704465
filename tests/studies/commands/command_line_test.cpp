#include <csignal>
#include <map>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <pty.h>

#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/scenario/table.hpp>
#include <tandem/studies/support/text.hpp>

#include "run_tandem.hpp"
#include "shared_data.hpp"

namespace tandem {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::StartsWith;
using testing::UnorderedElementsAre;
using Json = nlohmann::json;

TEST(CommandLine, PrintsVersionAndHelp) {
  EXPECT_THAT(run_tandem({"--version"}).output, ContainsRegex("^tandem [0-9]+\\.[0-9]+\\.[0-9]+( \\([^\n]+\\))?\n$"));
  EXPECT_THAT(run_tandem({"scenarios"}).output, ContainsRegex("docking_a +Simulated"));
  const Outcome help = run_tandem({"estimate", "--help-all"});
  EXPECT_EQ(help.status, 0);
  for (const char* option : {"--solver", "--roll-pitch", "--non-holonomic", "--surge", "--yaw-rate", "--limits",
                             "--loss", "--noise", "--ipopt", "--max-keyframes", "--out", "--quiet", "--json",
                             "Exit status", "Target:", "Sensors:", "Chaser's own sensors:", "Solver:", "Output:"})
    EXPECT_THAT(help.output, HasSubstr(option));
  const std::string commands = run_tandem({"--help"}).output;
  for (const char* command : {"estimate", "navigate", "track", "compare", "models", "calibrate", "plan", "rendezvous",
                              "study", "solve", "report", "paper", "simulate", "scenarios"}) {
    EXPECT_THAT(commands, ContainsRegex(std::string("\n  ") + command + " +[A-Z]"));
    const Outcome its_help = run_tandem({command, "--help"});
    EXPECT_EQ(its_help.status, 0) << its_help.errors;
    EXPECT_THAT(its_help.output, ContainsRegex(std::string("\nUsage: tandem ") + command + " "));
  }
}

/// Each command has its own program. Options and errors are the same as with a single program.
TEST(CommandLine, RunsCommandsInTheirOwnPrograms) {
  EXPECT_THAT(rejection_as_given({"study", "--version"}), HasSubstr("unknown option '--version'"));
  EXPECT_EQ(run_tandem({"--version", "study"}).output, run_tandem({"--version"}).output);
  EXPECT_EQ(run_tandem({"--help", "study"}).output, run_tandem({"study", "--help"}).output);
  EXPECT_EQ(run_tandem({"help", "study"}).output, run_tandem({"study", "--help"}).output);
  EXPECT_THAT(rejection({"studdy", "list"}), HasSubstr("unknown command 'studdy'; did you mean study?"));
  EXPECT_THAT(rejection({"studdy", "study", "list"}), HasSubstr("unknown command 'studdy'; did you mean study?"));
  EXPECT_THAT(rejection({"study"}), HasSubstr("tandem: action is required (see tandem study --help)\n"));
  EXPECT_THAT(rejection({"estimate", "study"}), HasSubstr("there is no folder 'study'"))
      << "a scenario may have the name of a command";
  EXPECT_EQ(run_tandem({"compare", "docking_a", "--allow-outside", "--max-keyframes", "60", "--solvers", "gauss-newton",
                        "--quiet"})
                .status,
            0);
}

TEST(CommandLine, MissingCommandNamesRemedy) {
  const ScratchFolder scratch;
  const auto program = scratch.path() / "bin/tandem", other = scratch.path() / "libexec/tandem/tandem-study";
  std::filesystem::create_directory(scratch.path() / "bin");
  std::filesystem::create_directories(scratch.path() / "libexec/tandem");
  std::filesystem::copy_file(paths::executable, program);
  const auto error = [&] {
    const Outcome run = run_program(program, {"study", "list"});
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.output, "");
    return run.errors;
  };
  EXPECT_EQ(error(), "tandem: " + other.string() + ", the program of tandem study, is missing; reinstall tandem\n");
  scratch.write("CMakeCache.txt", "");  // a build directory
  EXPECT_EQ(error(), "tandem: tandem study is not built; run cmake --build " +
                         std::filesystem::proximate(scratch.path()).string() + " --target tandem-study\n");
  scratch.write("libexec/tandem/tandem-study", "not a program");
  EXPECT_EQ(error(), "tandem: cannot run " + other.string() + ": Permission denied\n");
  EXPECT_EQ(run_program(program, {"--version"}).status, 0);
}

TEST(CommandLine, EstimatesBuiltInScenario) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  const Outcome run = run_tandem({"estimate", "docking_a", "--out", out.string()});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(run.errors, "") << "no progress without a terminal";
  EXPECT_THAT(run.output, HasSubstr("docking_a, constant-twist, mode A: 1538 keyframes, 5394 residual blocks"));
  EXPECT_THAT(run.output,
              ContainsRegex("\nposition +158 +1\\.57[0-9] ± 0\\.76[0-9] +11\\.[0-9]+ +2\\.668 ± 1\\.185\n"));
  EXPECT_THAT(run.output, ContainsRegex("\npose +624 +0\\.097 ± 0\\.044 "));
  EXPECT_THAT(run.output, ContainsRegex("\nnone +756 "));
  EXPECT_THAT(files(out),
              UnorderedElementsAre("chaser.tum", "target.tum", "chaser_full.csv", "target_full.csv", "errors.csv",
                                   "cross_covariance.csv", "weights.csv", "fit_residuals.csv", "target_fixes.csv",
                                   "chaser_truth.tum", "target_truth.tum", "summary.json", "run.yaml",
                                   "trajectories.svg", "errors.svg", "error_norms.svg"));
  EXPECT_EQ(poses(read_tum(out / "chaser.tum")).size(), 1538u);
  EXPECT_EQ(poses(read_tum(out / "target.tum")).size(), 1538u);
  const Json summary = Json::parse(read_file(out / "summary.json"));
  EXPECT_EQ(summary["status"], "converged");
  EXPECT_LE(summary["cost"], 1726.416524 * (1 + 1e-6));
}

/// Returns the rows of a CSV file by column name, without empty cells.
std::vector<std::map<std::string, std::string>> read_rows(const std::filesystem::path& file) {
  const auto cells = [](const std::string& line) {
    std::vector<std::string> result;
    std::istringstream row(line + ",");
    for (std::string cell; std::getline(row, cell, ',');) result.push_back(cell);
    return result;
  };
  std::istringstream lines(read_file(file));
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> names = cells(line);
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(lines, line)) {
    const std::vector<std::string> row = cells(line);
    EXPECT_EQ(row.size(), names.size()) << line;
    auto& named = rows.emplace_back();
    for (std::size_t i = 0; i < std::min(row.size(), names.size()); ++i)
      if (!row[i].empty()) named[names[i]] = row[i];
  }
  return rows;
}

/// The fractions of the position errors of docking_a within 1 σ and 3 σ agree with those of Gaussian errors, 68.3 % and
/// 99.7 %. They are 74 % and 100 % at keyframes with a pose, and 68 % and 99.6 % at keyframes with a position.
TEST(CommandLine, ErrorsAgreeWithBounds) {
  const ScratchFolder scratch;
  ASSERT_EQ(run_tandem({"estimate", "docking_a", "--plots", "off", "--out", scratch.path().string()}).status, 0);
  const auto rows = read_rows(scratch.path() / "errors.csv");
  for (const std::string type : {"pose", "position"}) {
    SCOPED_TRACE(type);
    int n = 0, within_one = 0, within_three = 0;
    for (const auto& row : rows)
      for (const std::string axis : {"x", "y", "z"}) {
        if (row.at("type") != type) continue;
        const double error = std::abs(std::stod(row.at("error_" + axis + "_m")));
        const double bound = std::stod(row.at("three_sigma_" + axis + "_m"));
        ++n;
        within_one += error <= bound / 3;
        within_three += error <= bound;
      }
    EXPECT_EQ(n, type == "pose" ? 3 * 624 : 3 * 158);
    EXPECT_NEAR(double(within_one) / n, 0.683, 0.08);
    EXPECT_GE(double(within_three) / n, 0.99);
  }
  for (const char* file : {"chaser_full.csv", "target_full.csv"}) {
    const auto full = read_rows(scratch.path() / file);
    ASSERT_EQ(full.size(), 1538u);
    for (const auto& row : full) ASSERT_EQ(row.size(), 50u) << "no cell is empty";
    EXPECT_GT(std::stod(full[9].at("c66")), 0);
  }
}

/// Real fixes, every fifth held out. The standard deviations are smaller than the scenario's: the scatter of inlier
/// fixes about the line between their neighbours (1.48 times the median deviation).
TEST(RecordedScenarios, PredictionsCoverHeldOutFixes) {
  TANDEM_NEEDS_SHARED(10);
  const ScratchFolder scratch;
  const Outcome run =
      run_tandem({"estimate", shared_path("data/usbl_ugps").string(), "--mode", "B", "--robust", "--hold-out", "5",
                  "--noise", "usbl=0.036,0.0033,0.003", "--plots", "off", "--json", "--out", scratch.path().string()});
  ASSERT_EQ(run.status, 0) << run.errors;
  const Json summary = Json::parse(run.output);
  const Json& held_out = summary["held_out"]["usbl"];
  EXPECT_EQ(held_out["n"], 344);
  EXPECT_GT(held_out["inliers"], 300);
  for (const char* share : {"inlier_rows_in_95_percent", "inliers_in_95_percent"}) {
    EXPECT_GE(held_out[share], 90) << share;
    EXPECT_LE(held_out[share], 98) << share;
  }
  EXPECT_EQ(read_rows(scratch.path() / "held_out.csv").size(), 344u);
  EXPECT_EQ(read_rows(scratch.path() / "weights.csv").size(), summary["sensors"]["usbl"]["down_weighted"]);
}

TEST(CommandLine, StandardOutputIsOnlyJson) {
  const ScratchFolder scratch;
  const Outcome run = run_tandem({"estimate", "docking_a", "--max-keyframes", "250", "--json", "--plots", "off",
                                  "--out", scratch.path().string()});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(Json::parse(run.output)["keyframes"], 250);
  EXPECT_EQ(run.output, read_file(scratch.path() / "summary.json"));
  EXPECT_THAT(files(scratch.path()),
              UnorderedElementsAre("chaser.tum", "target.tum", "chaser_full.csv", "target_full.csv", "errors.csv",
                                   "cross_covariance.csv", "weights.csv", "fit_residuals.csv", "target_fixes.csv",
                                   "chaser_truth.tum", "target_truth.tum", "summary.json", "run.yaml"));
}

TEST(CommandLine, OutputOfLibrariesGoesToStandardError) {
  if (!ipopt_available()) GTEST_SKIP() << "only Ipopt prints output";
  const Outcome run = run_tandem({"estimate", "docking_a", "--max-keyframes", "40", "--json", "--solver", "ipopt",
                                  "--hessian", "exact", "--ipopt", "print_level=5"});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(Json::parse(run.output)["solver"], "ipopt");
  EXPECT_THAT(run.errors, HasSubstr("Ipopt"));
}

TEST(CommandLine, QuietIsSilent) {
  const Outcome run = run_tandem({"estimate", "docking_a", "--max-keyframes", "250", "--quiet"});
  EXPECT_EQ(run.status, 0);
  EXPECT_EQ(run.output + run.errors, "");
}

TEST(CommandLine, AllSolversFindSameEstimate) {
  const auto solve = [](const std::string& solver) {
    const Outcome run = run_tandem({"estimate", "docking_a", "--max-keyframes", "24", "--json", "--solver", solver});
    EXPECT_EQ(run.status, 0) << solver << ": " << run.errors;
    return Json::parse(run.output);
  };  // 288 unknowns, few enough for the dense algorithms
  const double cost = solve("gauss-newton")["cost"];
  EXPECT_GT(cost, 0.0);
  EXPECT_NEAR(solve("augmented-lagrangian")["cost"], cost, 1e-6 * cost);
  if (ipopt_available()) {
    const Json ipopt = solve("ipopt");
    EXPECT_EQ(ipopt["solver"], "ipopt");
    EXPECT_NEAR(ipopt["cost"], cost, 1e-6 * cost);
  } else {
    EXPECT_THAT(rejection({"estimate", "docking_a", "--solver", "ipopt"}), HasSubstr("without Ipopt"));
  }
  if (nlopt_algorithms().empty()) {
    EXPECT_THAT(rejection({"estimate", "docking_a", "--solver", "nlopt:lbfgs"}), HasSubstr("no NLopt"));
  }
  for (const std::string& algorithm : nlopt_algorithms()) {
    const Json nlopt = solve("nlopt:" + algorithm);
    EXPECT_NEAR(nlopt["cost"], cost, 1e-4 * cost) << algorithm;
  }
}

TEST(CommandLine, SatisfiesHardConstraintsAndAppliesOptions) {
  const auto blocks = [](std::vector<std::string> options) -> int {
    std::vector<std::string> arguments = {"estimate", "docking_a", "--max-keyframes", "200", "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Outcome run = run_tandem(arguments);
    EXPECT_EQ(run.status, 0) << run.errors;
    return Json::parse(run.output)["residual_blocks"];
  };
  const int plain = blocks({});
  EXPECT_EQ(blocks({"--roll-pitch", "off"}), plain - 200);
  EXPECT_EQ(blocks({"--non-holonomic", "soft"}), plain + 199);
  EXPECT_EQ(blocks({"--surge", "-1,2.5", "--yaw-rate", "0.5", "--limits", "soft"}), plain + 2 * 199);
  EXPECT_THAT(rejection({"estimate", "docking_a", "--non-holonomic", "hard", "--solver", "gauss-newton"}),
              HasSubstr("gauss-newton takes soft"));
  for (const char* solver : {"augmented-lagrangian", "ipopt"}) {
    if (std::string(solver) == "ipopt" && !ipopt_available()) continue;
    const ScratchFolder scratch;
    const Outcome run = run_tandem({"estimate", "docking_a", "--max-keyframes", "200", "--solver", solver, "--plots",
                                    "off", "--non-holonomic", "hard", "--roll-pitch", "hard", "--surge", "0,inf",
                                    "--out", scratch.path().string()});
    EXPECT_EQ(run.status, 0) << run.errors;
    EXPECT_THAT(run.output, HasSubstr(", 598 hard constraints")) << "limits are hard if the solver supports it";
    EXPECT_LE(Json::parse(read_file(scratch.path() / "summary.json"))["max_violation"], 1e-6);
  }
  EXPECT_EQ(blocks({"--surge", "-1,2.5"}), plain + 199) << "soft otherwise";
  EXPECT_THAT(rejection({"estimate", "docking_a", "--surge", "0,2", "--limits", "hard", "--solver", "gauss-newton"}),
              HasSubstr("gauss-newton takes soft"));
}

TEST(CommandLine, LossAndNoiseChangeTheCost) {
  const auto cost = [](std::vector<std::string> options) -> double {
    std::vector<std::string> arguments = {"estimate", "--json", "--max-keyframes", "250"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    arguments.push_back("docking_a");
    const Outcome run = run_tandem(arguments);
    EXPECT_EQ(run.status, 0) << run.errors;
    return Json::parse(run.output)["cost"];
  };
  const double plain = cost({});
  EXPECT_LT(cost({"--loss", "huber:0.5"}), plain);
  EXPECT_LT(cost({"--noise", "usbl=5,5,5", "--noise", "constant_twist=1,1,1,1,1,1"}), plain);
}

TEST(CommandLine, UnconvergedResultIsWrittenAndMarked) {
  const ScratchFolder scratch;
  const Outcome run = run_tandem({"estimate", "docking_a", "--max-keyframes", "250", "--max-iterations", "1", "--out",
                                  (scratch.path() / "out").string()});
  EXPECT_EQ(run.status, 2);
  EXPECT_THAT(run.output, HasSubstr("NOT CONVERGED: "));
  EXPECT_THAT(run.errors, StartsWith("tandem: gauss-newton did not converge (max-iterations): "));
  EXPECT_EQ(Json::parse(read_file(scratch.path() / "out" / "summary.json"))["status"], "max-iterations");
  EXPECT_EQ(poses(read_tum(scratch.path() / "out" / "target.tum")).size(), 250u);
  EXPECT_EQ(run_tandem({"estimate", "docking_a", "--time-limit", "0", "--quiet"}).status, 2);
}

TEST(CommandLine, NamesUnobservableVariable) {
  const Outcome run = run_tandem({"estimate", "docking_a", "--max-keyframes", "1", "--json"});
  EXPECT_EQ(run.status, 0);
  const Json summary = Json::parse(run.output);
  EXPECT_EQ(summary["status"], "converged");
  EXPECT_THAT(summary["unobservable"].get<std::string>(), HasSubstr("target 0 in rotation about z"));
}

TEST(CommandLine, InterruptEndsSolveAtBestPoint) {
  const ScratchFolder scratch;
  // The scenario is long enough for the interrupt to arrive during the solve: 2,000 s at 10 keyframes a second, with a
  // solver that needs many iterations. Standard error is a terminal, so that the progress line shows the start.
  write_small_scenario(scratch);
  std::ostringstream odometry, usbl;
  usbl << "t,x,y,z\n";
  for (int k = 0; k <= 20000; ++k) {
    odometry << 0.1 * k << " " << 0.1 * k << " 0 0 0 0 0 1\n";
    if (k % 20 == 0) usbl << 0.1 * k << "," << 5 + k % 3 << "," << k % 7 << ",0\n";
  }
  scratch.write("chaser_odometry.tum", odometry.str());
  scratch.write("usbl.csv", usbl.str());
  std::filesystem::remove(scratch.path() / "optical.csv");
  int terminal = -1, error_fd = -1;
  ASSERT_EQ(openpty(&terminal, &error_fd, nullptr, nullptr, nullptr), 0);
  const std::string solver = nlopt_algorithms().empty() ? "gauss-newton" : "nlopt:lbfgs";
  const pid_t child = start_tandem(
      {"estimate", scratch.path().string(), "--solver", solver, "--json", "--out", (scratch.path() / "out").string()},
      scratch.path() / "output", error_fd);
  close(error_fd);
  std::string errors;
  char buffer[4096];
  bool interrupted = false;
  for (ssize_t n; (n = read(terminal, buffer, sizeof buffer)) > 0;) {
    errors.append(buffer, static_cast<std::size_t>(n));
    if (!interrupted && errors.find("iteration ") != std::string::npos) interrupted = kill(child, SIGINT) == 0;
  }
  close(terminal);
  EXPECT_EQ(exit_status(child), 2) << errors;
  EXPECT_TRUE(interrupted);
  EXPECT_THAT(errors, HasSubstr("did not converge (interrupted)"));
  const Json summary = Json::parse(read_file(scratch.path() / "out" / "summary.json"));
  EXPECT_EQ(summary["status"], "interrupted");
  EXPECT_LE(summary["cost"], summary["initial_cost"]);
}

TEST(CommandLine, RejectsInvalidUsage) {
  const auto estimate = [](std::vector<std::string> options) {
    options.insert(options.begin(), {"estimate", "docking_a"});
    return rejection(options);
  };
  EXPECT_THAT(rejection({}), HasSubstr("a command is required"));
  EXPECT_THAT(rejection({"estimat"}), HasSubstr("unknown command 'estimat'; did you mean estimate?"));
  EXPECT_THAT(rejection({"estimate"}), HasSubstr("scenario is required"));
  EXPECT_THAT(rejection({"estimate", "docking_b"}), HasSubstr("did you mean docking_a? (built in: docking_a)"));
  EXPECT_THAT(estimate({"more"}), HasSubstr("unknown argument 'more'"));
  EXPECT_THAT(estimate({"--solvr", "ipopt"}), HasSubstr("unknown option '--solvr'; did you mean --solver?"));
  EXPECT_THAT(estimate({"--solver", "ipop"}), HasSubstr("not 'ipop'; did you mean ipopt?"));
  EXPECT_THAT(estimate({"--solver"}), HasSubstr("--solver needs a value"));
  EXPECT_THAT(estimate({"--solver", "ipopt", "--solver", "ipopt"}), HasSubstr("--solver is given twice"));
  EXPECT_THAT(estimate({"--roll-pitch", "hrad"}), HasSubstr("did you mean hard?"));
  EXPECT_THAT(estimate({"--surge", "2,1"}), HasSubstr("--surge: the lower limit 2 is above the upper limit 1"));
  EXPECT_THAT(estimate({"--limits", "soft"}), HasSubstr("--limits needs --surge or --yaw-rate"));
  EXPECT_THAT(estimate({"--loss", "hubert"}), HasSubstr("did you mean huber?"));
  EXPECT_THAT(estimate({"--noise", "usbl=1"}), HasSubstr("--noise usbl needs 3 standard deviations, not 1"));
  EXPECT_THAT(estimate({"--ipopt", "tol=1"}), HasSubstr("--ipopt needs --solver ipopt"));
  EXPECT_THAT(estimate({"--hessian", "exact"}), HasSubstr("--hessian needs --solver ipopt"));
  EXPECT_THAT(estimate({"--solver", "ipopt", "--hessian", "exac"}), HasSubstr("did you mean exact?"));
  EXPECT_THAT(estimate({"--linear-solver", "mumps"}), HasSubstr("--linear-solver needs --solver ipopt"));
  EXPECT_THAT(estimate({"--solver", "ipopt", "--linear-solver", "ma57"}),
              HasSubstr("--linear-solver takes block-cholesky or mumps, not 'ma57'"));
  EXPECT_THAT(estimate({"--max-keyframes", "-3"}), HasSubstr("--max-keyframes takes a positive integer"));
  EXPECT_THAT(estimate({"--max-iterations", "few"}), HasSubstr("--max-iterations takes a positive integer"));
  EXPECT_THAT(estimate({"--time-limit", "soon"}), HasSubstr("--time-limit: 'soon' is not a number"));
  EXPECT_THAT(estimate({"--plots", "gif"}), HasSubstr("--plots takes svg, png, pdf or off, not 'gif'"));
  if (ipopt_available()) {
    EXPECT_THAT(estimate({"--solver", "ipopt", "--ipopt", "tool=1"}), HasSubstr("did you mean tol?"));
  }
}

TEST(CommandLine, RejectsInvalidOutputFolderBeforeSolve) {
  const ScratchFolder scratch;
  const std::string file = scratch.write("file", "").string();
  const Outcome run = run_tandem({"estimate", "docking_a", "--out", file});
  EXPECT_EQ(run.status, 1);
  EXPECT_EQ(run.output, "");
  EXPECT_THAT(run.errors, HasSubstr("is not a folder"));
  EXPECT_THAT(run_tandem({"estimate", "docking_a", "--out", "/proc/tandem"}).errors,
              HasSubstr("cannot write to /proc"));
}

}  // namespace
}  // namespace tandem
