#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <tandem/studies/study/builtin_studies.hpp>
#include <tandem/studies/study/study_database.hpp>

#include "needs_program.hpp"
#include "run_tandem.hpp"
#include "sanitized.hpp"

namespace tandem {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

const char* const kStudy =
    "name: small\nquestion: Does it run?\nparameters: {minutes: 2, gap: [0, 10], gap_period: 40}\n"
    "models: [constant-twist, mode-b]\nseeds: 10\n";

/// Returns kStudy with another number of seeds.
std::string study_of(int seeds) {
  std::string study = kStudy;
  return study.replace(study.find("seeds: 10"), 9, fmt::format("seeds: {}", seeds));
}

std::string all_tables(const std::filesystem::path& folder) {
  std::string all;
  for (const char* file : {"tables.txt", "summary.csv", "pairs.csv", "consistency.csv"})
    all += read_file(folder / file);
  return all;
}

TEST(StudyCommand, RunsExportsAndShowsStudy) {
  const ScratchFolder scratch;
  const std::string file = scratch.write("small.yaml", kStudy), out = scratch.path() / "out";
  const Outcome run = run_tandem({"study", "run", file, "--out", out, "--threads", "2"});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(run.errors, "") << "no progress without a terminal";
  EXPECT_THAT(run.output, HasSubstr("small: Does it run?\n40 of 40 trials, "));
  EXPECT_THAT(run.output, ContainsRegex("\n(constant-twist|mode-b) has the least at_all_error_m"));
  EXPECT_LT(std::count(run.output.begin(), run.output.end(), '\n'), 60);
  EXPECT_THAT(files(out), UnorderedElementsAre("study.sqlite", "study.lock", "tables.txt", "summary.csv", "pairs.csv",
                                               "consistency.csv", "timing.csv", "run.yaml"));
  EXPECT_THAT(read_file(out + "/tables.txt"), ContainsRegex("\nraw +[0-9.]+ ± [0-9.]+ "));
  EXPECT_THAT(run_tandem({"study", "show", out, "--full"}).output, HasSubstr(read_file(out + "/tables.txt")));
  EXPECT_EQ(run_tandem({"study", "show", out}).output + "\nWritten to " + out + "\n", run.output);
  ASSERT_EQ(run_tandem({"study", "export", out, "--out", out + "2", "--plots", "off"}).status, 0);
  EXPECT_EQ(all_tables(out + "2"), all_tables(out));
  EXPECT_THAT(read_file(out + "2/trials.csv"), HasSubstr("\n39,9,2,10,40,mode-b,automatic,converged,"));

  const std::string trial = scratch.path() / "trial";
  const Outcome again = run_tandem({"study", "trial", out, "39", "--out", trial});
  ASSERT_EQ(again.status, 0) << again.errors;
  EXPECT_THAT(again.output, HasSubstr("gap=10, mode-b"));
  EXPECT_THAT(again.output, HasSubstr("; to estimate it: tandem models " + trial + " --models 'mode-b'\n"));
  EXPECT_EQ(run_tandem({"models", trial, "--models", "mode-b", "--quiet"}).status, 0);
}

TEST(StudyCommand, ExportDrawsPlots) {
  TANDEM_NEEDS_GNUPLOT("the plots of a study");
  const ScratchFolder scratch;
  const std::string file = scratch.write("grid.yaml",
                                         "name: grid\nquestion: Is it drawn?\n"
                                         "parameters: {minutes: 2, gap: [0, 10], gap_period: [40, 50]}\n"
                                         "models: [constant-twist, mode-b]\nseeds: 3\n");
  const std::string out = scratch.path() / "out";
  ASSERT_EQ(run_tandem({"study", "run", file, "--out", out, "--quiet"}).status, 0);
  const Outcome exported = run_tandem({"study", "export", out});
  ASSERT_EQ(exported.status, 0);
  EXPECT_EQ(exported.errors, "");
  for (const char* plot : {"study_means", "study_consistency"})
    EXPECT_THAT(read_file(out + "/" + plot + ".svg"), HasSubstr("gap=10, gap_period=40: mode-b")) << plot;
  EXPECT_THAT(read_file(out + "/study_distribution.svg"), AllOf(HasSubstr("constant-twist"), HasSubstr("mode-b")));
}

/// Kills the process repeatedly while it writes, each time after a given number of trials.
TEST(StudyCommand, KilledAndResumedStudyGivesSameTables) {
  const ScratchFolder scratch;
  const std::string file = scratch.write("small.yaml", study_of(5)), out = scratch.path() / "out";
  ASSERT_EQ(run_tandem({"study", "run", file, "--out", out, "--threads", "1"}).status, 0);
  const std::string killed = scratch.path() / "killed";
  const auto count = [&]() -> std::size_t {
    try {
      return StudyDatabase::is_in(killed) ? StudyDatabase::read(killed).count() : 0;
    } catch (const Error&) {  // the database is not written yet
      return 0;
    }
  };
  const int nowhere = open("/dev/null", O_WRONLY);
  for (const std::size_t enough : {1u, 4u, 8u, 12u, 16u}) {
    const pid_t child = start_tandem({"study", "run", file, "--out", killed, "--resume", "--threads", "2"},
                                     scratch.path() / "output", nowhere);
    while (count() < enough && waitpid(child, nullptr, WNOHANG) == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
  }
  close(nowhere);
  const Outcome last = run_tandem({"study", "run", file, "--out", killed, "--resume"});
  ASSERT_EQ(last.status, 0) << last.errors;
  EXPECT_EQ(all_tables(killed), all_tables(out));
}

TEST(StudyCommand, MergesShards) {
  const ScratchFolder scratch;
  const std::string file = scratch.write("small.yaml", study_of(4)), out = scratch.path() / "out";
  const std::string a = scratch.path() / "a", b = scratch.path() / "b", merged = scratch.path() / "merged";
  ASSERT_EQ(run_tandem({"study", "run", file, "--out", out, "--quiet"}).status, 0);
  EXPECT_THAT(run_tandem({"study", "run", file, "--out", a, "--shard", "0/2"}).output, HasSubstr("8 of 16 trials"));
  ASSERT_EQ(run_tandem({"study", "run", file, "--out", b, "--shard", "1/2", "--quiet"}).status, 0);
  const Outcome half = run_tandem({"study", "merge", a, "--out", scratch.path() / "half"});
  EXPECT_EQ(half.status, 2);
  EXPECT_THAT(half.errors, HasSubstr("8 of 16 trials are present; add the missing shards"));
  ASSERT_EQ(run_tandem({"study", "merge", a, b, "--out", merged}).status, 0);
  EXPECT_EQ(all_tables(merged), all_tables(out));
}

/// The tables do not depend on the number of ranks, also with more ranks than cores and after a rank was killed.
TEST(StudyCommand, RanksGiveSameTables) {
  TANDEM_NEEDS_PROGRAM("mpirun", "ranks of a study");
  const ScratchFolder scratch;
  const std::string file = scratch.write("small.yaml", study_of(3)), log = scratch.path() / "log";
  const auto mpirun = [&](int ranks, const std::string& study, const std::string& out, const std::string& more) {
    // Open MPI leaks memory; the leak check is off.
    return std::system(fmt::format("ASAN_OPTIONS=detect_leaks=0 timeout 200 mpirun --allow-run-as-root --oversubscribe "
                                   "-n {} '{}' study run '{}' "
                                   "--out '{}' --quiet {} > '{}' 2>&1",
                                   ranks, paths::executable, study, out, more, log)
                           .c_str());
  };
  const std::string alone = scratch.path() / "alone";
  ASSERT_EQ(run_tandem({"study", "run", file, "--out", alone, "--quiet"}).status, 0);
  for (const int ranks : {1, 2, 4}) {
    const std::string out = scratch.path() / std::to_string(ranks);
    if (mpirun(ranks, file, out, "") != 0 && read_file(log).find("this build has no MPI") != std::string::npos)
      GTEST_SKIP() << "a build without MPI";
    EXPECT_EQ(all_tables(out), all_tables(alone)) << ranks << read_file(log);
  }
  EXPECT_NE(mpirun(2, file, scratch.path() / "2", ""), 0) << "the folder contains a study";
  EXPECT_THAT(read_file(log), HasSubstr("has a study already"));
  EXPECT_NE(mpirun(2, file, scratch.path() / "x", "--threads 2"), 0);
  EXPECT_THAT(read_file(log), HasSubstr("--threads and --shard are not supported under mpirun"));

  // Long enough that the study does not end before its worker is killed.
  const std::string many = scratch.write("many.yaml", study_of(kSanitized ? 10 : 60));
  const std::string whole = scratch.path() / "whole", killed = scratch.path() / "killed";
  ASSERT_EQ(run_tandem({"study", "run", many, "--out", whole, "--quiet"}).status, 0);
  std::vector<std::string> words = {"mpirun",
                                    "--allow-run-as-root",
                                    "--oversubscribe",
                                    "-n",
                                    "3",
                                    paths::executable,
                                    "study",
                                    "run",
                                    many,
                                    "--out",
                                    killed,
                                    "--quiet"};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t launcher = -1;
  ASSERT_EQ(posix_spawnp(&launcher, "mpirun", &actions, nullptr, argv.data(), environ), 0);
  posix_spawn_file_actions_destroy(&actions);
  const auto count = [&]() -> std::size_t {
    try {
      return StudyDatabase::is_in(killed) ? StudyDatabase::read(killed).count() : 0;
    } catch (const Error&) {
      return 0;
    }
  };
  // The kernel's list of children is complete only while no child starts or ends.
  std::vector<pid_t> ranks;
  while (ranks.size() < 3 || count() < 5) {
    std::ifstream children(fmt::format("/proc/{0}/task/{0}/children", launcher));
    ranks.assign(std::istream_iterator<pid_t>(children), {});
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ASSERT_EQ(waitpid(launcher, nullptr, WNOHANG), 0) << "ended before a worker was killed";
  }
  kill(ranks.back(), SIGKILL);  // a worker
  waitpid(launcher, nullptr, 0);
  EXPECT_GE(count(), 5u);
  EXPECT_LT(count(), kSanitized ? 40u : 240u);
  EXPECT_EQ(mpirun(2, many, killed, "--resume"), 0) << read_file(log);
  EXPECT_EQ(all_tables(killed), all_tables(whole));
}

TEST(StudyCommand, RunsRendezvousStudy) {
  const ScratchFolder scratch;
  const auto study = [&](const std::string& methods) {
    return scratch.write("chase.yaml", "name: chase\nquestion: Which way docks?\nparameters: {rendezvous: [" + methods +
                                           "]}\nmodels: [constant-twist]\nseeds: 2\n");
  };
  const std::string out = scratch.path() / "out";
  const Outcome run = run_tandem({"study", "run", study("decoupled, pursuit"), "--out", out, "--quiet"});
  ASSERT_EQ(run.status, 0) << run.errors;
  ASSERT_EQ(run_tandem({"study", "export", out, "--plots", "off"}).status, 0);
  EXPECT_THAT(read_file(out + "/trials.csv"), HasSubstr("docked"));
  EXPECT_THAT(read_file(out + "/tables.txt"), ContainsRegex("docked +.*miss \\[m\\]"));
  const std::string summary = read_file(out + "/summary.csv");
  EXPECT_THAT(summary, HasSubstr("rendezvous=decoupled,constant-twist,automatic,docked,2,"));
  EXPECT_THAT(summary, HasSubstr("rendezvous=pursuit,constant-twist,automatic,dock_miss_m,2,"));
  EXPECT_THAT(rejection_as_given({"study", "run", study("pursiut"), "--out", out + "2"}),
              HasSubstr("did you mean pursuit?"));
}

/// Studies of dives without and with a target: tables, threads, export, and a trial written as a folder and navigated.
TEST(LongStudyCommand, RunsDiveStudies) {
  const ScratchFolder scratch;
  const std::string alone =
      scratch.write("alone.yaml",
                    "name: alone\nsimulation: dive\nparameters: {minutes: 1, estimate_dvl_scale: 1, loss: huber:3, "
                    "grade: [mems, tactical]}\nseeds: 3\n");
  const std::string out = scratch.path() / "out", threads = scratch.path() / "threads";
  const Outcome run = run_tandem({"study", "run", alone, "--out", out, "--threads", "1"});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_THAT(read_file(out + "/tables.txt"), HasSubstr("confidence interval: errors of the chaser"));
  EXPECT_THAT(run.output, ContainsRegex("own-sensors +[0-9.]+ ± [0-9.]+"));
  EXPECT_THAT(run.output, HasSubstr("nis_dvl"));
  ASSERT_EQ(run_tandem({"study", "run", alone, "--out", threads, "--threads", "3", "--quiet"}).status, 0);
  EXPECT_EQ(all_tables(threads), all_tables(out));
  const Outcome trial = run_tandem({"study", "trial", out, "1", "--out", scratch.path() / "trial"});
  EXPECT_THAT(trial.output, ContainsRegex("to estimate it: tandem navigate .*/trial --loss huber:3 --dvl-scale\n"));
  EXPECT_EQ(run_tandem({"navigate", scratch.path() / "trial", "--loss", "huber:3", "--dvl-scale"}).status, 0);

  const std::string joint = scratch.write("joint.yaml",
                                          "name: joint\nsimulation: dive\nparameters: {minutes: 1, target: 1}\n"
                                          "models: [constant-twist, mode-b]\nseeds: 2\n");
  const Outcome together = run_tandem({"study", "run", joint, "--out", scratch.path() / "joint"});
  ASSERT_EQ(together.status, 0) << together.errors;
  EXPECT_THAT(read_file(scratch.path() / "joint/tables.txt"), ContainsRegex("position \\[m\\].*chaser \\[m\\]"));
  EXPECT_EQ(run_tandem({"study", "export", scratch.path() / "joint", "--plots", "off"}).status, 0);
}

TEST(StudyCommand, ListsBuiltInStudies) {
  const Outcome list = run_tandem({"study", "list"});
  ASSERT_EQ(list.status, 0) << list.errors;
  for (const char* name : {"table1", "motion_models", "constraints", "prior_sigma", "solvers", "outliers", "window",
                           "starts", "level", "junction", "online", "calibrated", "no_motion", "rendezvous", "dive",
                           "dive_noise", "dive_scale", "dive_target", "planar"})
    EXPECT_THAT(list.output, ContainsRegex(std::string(name) + " +[0-9]+ trials  [A-Z]"));
}

TEST(StudyCommand, RejectsInvalidUsage) {
  const ScratchFolder scratch;
  const std::string file = scratch.write("small.yaml", study_of(2)), out = scratch.path() / "out";
  EXPECT_THAT(rejection_as_given({"study", "rum", file}), HasSubstr("did you mean run?"));
  EXPECT_THAT(rejection_as_given({"study", "run", file}), HasSubstr("study run needs --out DIR"));
  EXPECT_THAT(rejection_as_given({"study", "run", "--out", out}), HasSubstr("usage: tandem study run FILE"));
  EXPECT_THAT(rejection_as_given({"study", "run", "tabel1", "--out", out}), HasSubstr("did you mean table1?"));
  EXPECT_THAT(rejection_as_given({"study", "show", out}), HasSubstr("has no study"));
  EXPECT_THAT(rejection_as_given({"study", "show", out, "--threads", "2"}),
              HasSubstr("study show does not take --threads"));
  EXPECT_THAT(rejection_as_given({"study", "run", file, "--out", out, "--shard", "2/2"}),
              HasSubstr("--shard takes I/N with I from 0 to N-1"));
  EXPECT_THAT(rejection_as_given({"study", "trial", file, "8", "--out", out}),
              HasSubstr("has the trials 0 to 7, not '8'"));
  EXPECT_THAT(rejection_as_given({"study", "run", file, "--out", "/proc/study"}), HasSubstr("cannot write to /proc"));
  std::string wrong = kStudy;
  wrong.replace(wrong.find("gap_period"), 10, "gap_perido");
  EXPECT_THAT(rejection_as_given({"study", "run", scratch.write("wrong.yaml", wrong), "--out", out}),
              HasSubstr("wrong.yaml:3: unknown key 'gap_perido' in parameters; did you mean gap_period?"));
  EXPECT_FALSE(std::filesystem::exists(out)) << "nothing is started";

  ASSERT_EQ(run_tandem({"study", "run", file, "--out", out, "--quiet"}).status, 0);
  EXPECT_THAT(rejection_as_given({"study", "run", file, "--out", out}), HasSubstr("has a study already"));
  EXPECT_THAT(rejection_as_given({"study", "run", scratch.write("o.yaml", study_of(11)), "--out", out, "--resume"}),
              HasSubstr("has trials of another study: its hash is"));
  std::ofstream(out + "/study.sqlite", std::ios::trunc)
      << "a text instead of a database, but long enough for its header";
  EXPECT_THAT(rejection_as_given({"study", "run", file, "--out", out, "--resume"}),
              HasSubstr("study.sqlite is damaged"));
}

/// Simulates a full disk by a limit of the file size.
TEST(StudyCommand, ReportsFullDiskAtStart) {
  const ScratchFolder scratch;
  const std::string file = scratch.write("many.yaml", study_of(1000));
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  rlimit little = before;
  little.rlim_cur = 100000;
  std::signal(SIGXFSZ, SIG_IGN);         // inherited by child processes
  setenv("OMPI_MCA_btl", "self", true);  // Debian 13's Ipopt initialises Open MPI, which would write files, too
  setrlimit(RLIMIT_FSIZE, &little);
  const std::string error = rejection_as_given({"study", "run", file, "--out", scratch.path() / "out"});
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, SIG_DFL);
  unsetenv("OMPI_MCA_btl");
  EXPECT_THAT(error, HasSubstr("study.sqlite"));
}

}  // namespace
}  // namespace tandem
