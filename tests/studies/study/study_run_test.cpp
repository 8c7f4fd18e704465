#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <tandem/studies/study/study_report.hpp>
#include <tandem/studies/study/study_run.hpp>

#include "small_study.hpp"
#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

/// Returns the contents of all reproducible tables of a study.
std::string tables_of(const StudyDatabase& database) {
  const ScratchFolder folder;
  const std::vector<TrialResult> results = database.results();
  write_study_tables(database.study(), study_tables(database.study(), results), folder.path());
  std::string all;
  for (const char* file : {"tables.txt", "summary.csv", "pairs.csv", "consistency.csv"})
    all += read_file(folder.path() / file);
  return all;
}

/// Returns the tables of small_study(), run sequentially in one thread.
const std::string& reference_tables() {
  static const std::string tables = [] {
    const ScratchFolder folder;
    StudyDatabase database = StudyDatabase::create(folder.path(), small_study(), kSmallStudy);
    run_study(database, {.threads = 1});
    return tables_of(database);
  }();
  return tables;
}

TEST(StudyRun, TablesDoNotDependOnThreads) {
  EXPECT_THAT(reference_tables(), HasSubstr("24 of 24 trials"));
  for (const int threads : {2, 4}) {
    const ScratchFolder folder;
    StudyDatabase database = StudyDatabase::create(folder.path(), small_study(), kSmallStudy);
    std::size_t calls = 0;
    const StudyProgress progress =
        run_study(database, {.threads = threads, .progress = [&](const StudyProgress&) { ++calls; }});
    EXPECT_EQ(progress.done, 24u);
    EXPECT_EQ(progress.failed, 8u) << "trials of the invalid model";
    EXPECT_EQ(calls, 24u);
    EXPECT_EQ(tables_of(database), reference_tables());
  }
}

TEST(StudyRun, MergedShardsGiveTheSameTables) {
  const ScratchFolder folder;
  for (std::size_t i = 0; i < 3; ++i) {
    StudyDatabase shard = StudyDatabase::create(folder.path() / std::to_string(i), small_study(), kSmallStudy);
    const StudyProgress progress = run_study(shard, {.threads = 1, .shard = {i, 3}});
    EXPECT_EQ(progress.all, 8u);
    EXPECT_EQ(shard.count(), 8u);
  }
  StudyDatabase merged = StudyDatabase::create(folder.path() / "all", small_study(), kSmallStudy);
  merged.add_all(merged_results({folder.path() / "2", folder.path() / "0", folder.path() / "1", folder.path() / "0"}));
  EXPECT_EQ(tables_of(merged), reference_tables());
}

TEST(StudyRun, ShardsThatDisagreeAreNamed) {
  const ScratchFolder folder;
  const auto shard = [&](const char* name, const std::string& status, std::optional<double> error, double seconds) {
    StudyDatabase database = StudyDatabase::create(folder.path() / name, small_study(), kSmallStudy);
    TrialResult result;
    result.trial = 3;
    result.status = status;
    result.set("at_all_error_m", error);
    result.set("processor_s", seconds);
    database.add(result);
    return folder.path() / name;
  };
  const auto a = shard("a", "converged", 1.5, 1), slower = shard("slower", "converged", 1.5 + 1e-9, 2);
  EXPECT_EQ(merged_results({a, slower, a}).size(), 1u);
  EXPECT_THAT(error_of([&] {
                merged_results({a, slower, shard("b", "converged", 1.6, 1)});
              }),
              testing::AllOf(HasSubstr("/a and "), HasSubstr("/b disagree on trial 3: at_all_error_m is 1.5 and 1.6")));
  EXPECT_THAT(error_of([&] { merged_results({a, shard("c", "converged", {}, 1)}); }), HasSubstr("1.5 and missing"));
  EXPECT_THAT(error_of([&] {
                merged_results({a, shard("d", "refused", 1.5, 1)});
              }),
              HasSubstr("its status is converged and refused"));
}

/// A file from an untrusted source may have any trial number.
TEST(StudyDatabase, RejectsTrialsThatAreNotInTheStudy) {
  for (const std::size_t trial : {std::size_t(24), std::size_t(1'000'000'000), ~std::size_t(0)}) {
    const ScratchFolder folder;
    {
      StudyDatabase database = StudyDatabase::create(folder.path(), small_study(), kSmallStudy);
      TrialResult result;
      result.trial = trial;
      result.status = "converged";
      database.add(result);
    }
    const auto damaged = HasSubstr("study.sqlite is damaged: its trial ");
    const StudyDatabase database = StudyDatabase::read(folder.path());
    EXPECT_THAT(error_of([&] { database.results(); }), damaged);
    EXPECT_THAT(error_of([&] { database.finished(); }), damaged);
    StudyDatabase resumed = StudyDatabase::resume(folder.path(), small_study());
    EXPECT_THAT(error_of([&] { run_study(resumed, {.threads = 1}); }), damaged);
  }
}

TEST(StudyDatabase, RejectsLinksAndPipes) {
  const ScratchFolder folder;
  std::filesystem::create_symlink("/etc/passwd", folder.path() / "study.sqlite");
  EXPECT_THAT(error_of([&] { StudyDatabase::read(folder.path()); }), HasSubstr("study.sqlite leads outside"));
  std::filesystem::remove(folder.path() / "study.sqlite");
  ASSERT_EQ(mkfifo((folder.path() / "study.sqlite").c_str(), 0600), 0);
  EXPECT_THAT(error_of([&] { StudyDatabase::read(folder.path()); }), HasSubstr("study.sqlite is a pipe"));
}

TEST(StudyRun, InterruptedAndResumedRunsGiveTheSameTables) {
  const ScratchFolder folder;
  std::atomic<bool> stop{false};
  StudyRunOptions options{.threads = 2, .stop = &stop};
  options.progress = [&](const StudyProgress& p) { stop = p.done % 5 == 0; };
  { StudyDatabase::create(folder.path(), small_study(), kSmallStudy); }
  StudyProgress progress;
  int runs = 0;
  do {
    stop = false;
    StudyDatabase database = StudyDatabase::resume(folder.path(), small_study());
    progress = run_study(database, options);
    ASSERT_LT(++runs, 20);
  } while (progress.done < progress.all);
  EXPECT_GT(runs, 2);
  EXPECT_EQ(tables_of(StudyDatabase::read(folder.path())), reference_tables());
}

TEST(StudyDatabase, ErrorsNameFolderAndProblem) {
  const ScratchFolder folder;
  const Study study = small_study();
  EXPECT_THAT(error_of([&] { StudyDatabase::read(folder.path()); }), HasSubstr("has no study"));
  {
    StudyDatabase database = StudyDatabase::create(folder.path(), study, kSmallStudy);
    EXPECT_THAT(error_of([&] { StudyDatabase::resume(folder.path(), study); }),
                HasSubstr("another process is running this study"));
    EXPECT_THAT(error_of([&] { StudyDatabase::create(folder.path(), study, kSmallStudy); }), HasSubstr("--resume"));
    EXPECT_EQ(database.count(), 0u);
  }
  std::string other = kSmallStudy;
  other.replace(other.find("seeds: 4"), 8, "seeds: 5");
  EXPECT_THAT(error_of([&] { StudyDatabase::resume(folder.path(), parse_study(other, "o.yaml")); }),
              testing::ContainsRegex("has trials of another study: its hash is [0-9a-f]{16}, this one's"));
  const auto file = folder.path() / StudyDatabase::file_name;
  std::fstream(file, std::ios::in | std::ios::out | std::ios::binary).seekp(0).write("nonsense", 8);
  EXPECT_THAT(error_of([&] { StudyDatabase::resume(folder.path(), study); }), HasSubstr("study.sqlite is damaged"));
  std::ofstream(file, std::ios::trunc) << "";
  EXPECT_THAT(error_of([&] { StudyDatabase::read(folder.path()); }), HasSubstr("study.sqlite"));
}

/// Drops root privileges for its lifetime, so that file permissions apply. The new user owns `folder`.
class Unprivileged {
 public:
  explicit Unprivileged(const std::filesystem::path& folder) {
    constexpr uid_t kNobody = 65534;
    if (before_ == 0 && chown(folder.c_str(), kNobody, gid_t(-1)) == 0) changed_ = seteuid(kNobody) == 0;
  }
  ~Unprivileged() {
    if (changed_) EXPECT_EQ(seteuid(before_), 0);
  }
  Unprivileged(const Unprivileged&) = delete;
  Unprivileged& operator=(const Unprivileged&) = delete;

 private:
  const uid_t before_ = geteuid();
  bool changed_ = false;
};

TEST(StudyDatabase, CreateRejectsReadOnlyFolder) {
  EXPECT_THAT(error_of([] { StudyDatabase::create("/proc/study", small_study(), kSmallStudy); }),
              HasSubstr("/proc/study cannot be created"));
  const ScratchFolder folder;
  std::filesystem::permissions(folder.path(), std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  const Unprivileged user(folder.path());
  if (geteuid() == 0) GTEST_SKIP() << "runs as root and cannot drop privileges, so no folder is read-only";
  EXPECT_THAT(error_of([&] { StudyDatabase::create(folder.path(), small_study(), kSmallStudy); }),
              HasSubstr("cannot be written: Permission denied"));
}

TEST(StudyDatabase, ResultsRoundTripExactly) {
  const ScratchFolder folder;
  TrialResult result;
  result.trial = 5;
  result.status = "failed";
  result.message = "it's so";
  result.set("cost", 0.1 + 0.2);
  result.set("violation", 1e-300);
  {
    StudyDatabase database = StudyDatabase::create(folder.path(), small_study(), kSmallStudy);
    database.add(result);
    result.message = "again";
    database.add(result);
  }
  const std::vector<TrialResult> read = StudyDatabase::read(folder.path()).results();
  ASSERT_EQ(read.size(), 1u);
  EXPECT_EQ(read[0].trial, 5u);
  EXPECT_EQ(read[0].message, "it's so");
  EXPECT_EQ(read[0].get("cost"), 0.1 + 0.2);
  EXPECT_EQ(read[0].metrics, result.metrics);
}

}  // namespace
}  // namespace tandem
