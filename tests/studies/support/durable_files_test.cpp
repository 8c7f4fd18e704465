#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <tandem/studies/support/durable_files.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::UnorderedElementsAre;
using namespace std::chrono_literals;

TEST(DurableFiles, WritesAppendedTextAfterPeriod) {
  const ScratchFolder scratch;
  DurableFiles disk(10ms);
  const std::size_t a = disk.open(scratch.path() / "a"), b = disk.open(scratch.path() / "b");
  disk.append(a, "one\n");
  disk.append(b, "two\n");
  disk.append(a, "three\n");
  EXPECT_EQ(disk.size(a), 10u);
  for (int i = 0; i < 1000 && read_file(scratch.path() / "b").empty(); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(read_file(scratch.path() / "a"), "one\nthree\n");
  EXPECT_EQ(read_file(scratch.path() / "b"), "two\n");
}

TEST(DurableFiles, DestructorWritesPendingText) {
  const ScratchFolder scratch;
  const auto file = scratch.write("a", "0123456789");
  {
    DurableFiles disk(1h);
    const std::size_t a = disk.open(file, 4);
    EXPECT_EQ(disk.size(a), 4u);
    disk.append(a, "abc");
  }
  EXPECT_EQ(read_file(file), "0123abc");
}

TEST(DurableFiles, ReplacesWholeFile) {
  const ScratchFolder scratch;
  const auto file = scratch.write("a", "old");
  DurableFiles disk(1h);
  disk.replace(file, "new");
  disk.flush();
  EXPECT_EQ(read_file(file), "new");
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("a"));
  EXPECT_EQ(disk.failure(), "");
  disk.replace(scratch.path() / "missing" / "a", "new");
  disk.flush();
  EXPECT_THAT(disk.failure(), HasSubstr("missing/a cannot be written: No such file or directory"));
  EXPECT_EQ(disk.failure(), "") << "each failure is reported once";
}

/// Limits the size of files that this process writes, for its lifetime.
class SmallFiles {
 public:
  explicit SmallFiles(rlim_t bytes) {
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallFiles() {
    setrlimit(RLIMIT_FSIZE, &before_);
    signal(SIGXFSZ, SIG_DFL);
  }

 private:
  rlimit before_{};
};

TEST(DurableFiles, ReportsAndRetriesFailedWrites) {
  const ScratchFolder scratch;
  const auto file = scratch.path() / "a";
  DurableFiles disk(1h);
  const std::size_t a = disk.open(file);
  disk.append(a, "first\n");
  disk.flush();
  {
    const SmallFiles limit(8);
    disk.append(a, "second\n");
    disk.replace(scratch.path() / "b", "refers to the second line");
    disk.flush();
  }
  EXPECT_THAT(disk.failure(), HasSubstr("a cannot be written: File too large"));
  EXPECT_EQ(read_file(file), "first\n") << "no partial line";
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "b"));
  disk.flush();
  EXPECT_EQ(disk.failure(), "");
  EXPECT_EQ(read_file(file), "first\nsecond\n");
  EXPECT_EQ(read_file(scratch.path() / "b"), "refers to the second line");
}

TEST(DurableFiles, RemovesPartialLine) {
  const ScratchFolder scratch;
  for (const auto& [text, whole] : {std::pair{"a\nb\nha", "a\nb\n"}, {"a\n", "a\n"}, {"half", ""}, {"", ""}}) {
    const auto file = scratch.write("a", text);
    remove_partial_line(file);
    EXPECT_EQ(read_file(file), whole);
  }
}

}  // namespace
}  // namespace tandem
