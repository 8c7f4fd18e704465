#include <csignal>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <tandem/studies/support/output_folder.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::UnorderedElementsAre;

void write(const std::filesystem::path& file, const std::string& text) { std::ofstream(file) << text; }

TEST(OutputFolder, MakesNothingBeforeItIsFilled) {
  const ScratchFolder scratch;
  const OutputFolder out(scratch.path() / "a" / "b/");
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre());
  out.fill([&](const std::filesystem::path& folder) {
    write(folder / "x", "new");
    EXPECT_FALSE(std::filesystem::exists(scratch.path() / "a" / "b")) << "nobody sees half of it";
  });
  EXPECT_THAT(files(scratch.path() / "a"), UnorderedElementsAre("b"));
  EXPECT_EQ(read_file(scratch.path() / "a" / "b" / "x"), "new");
}

/// Writes files of these names, each of its own name and `text`.
auto writing(const std::vector<std::string>& names, const std::string& text) {
  return [=](const std::filesystem::path& folder) {
    for (const std::string& name : names) write(folder / name, name + text);
  };
}

TEST(OutputFolder, EverythingThatIsWrittenIsMovedIntoAnOldFolderToo) {
  const ScratchFolder scratch;
  scratch.write("x", "old");
  scratch.write("foreign", "keep");
  OutputFolder(scratch.path()).fill(writing({"x", "nobody has heard of it"}, " new"));
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("x", "nobody has heard of it", "foreign"));
  EXPECT_EQ(read_file(scratch.path() / "x"), "x new");
  EXPECT_EQ(read_file(scratch.path() / "foreign"), "keep");
}

TEST(OutputFolder, WhatTheLastRunWroteDoesNotOutliveTheNext) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  OutputFolder(out).fill(writing({"a", "b", "of another command"}, " 1"));
  write(out / "notes", "of the user");
  OutputFolder(out).fill(writing({"a", "c"}, " 2"));
  EXPECT_THAT(files(out), UnorderedElementsAre("a", "c", "notes"));
  EXPECT_EQ(read_file(out / "a"), "a 2");
  OutputFolder(out).fill(writing({"b"}, " 3"));
  EXPECT_THAT(files(out), UnorderedElementsAre("b", "notes"));
  EXPECT_EQ(read_file(out / "notes"), "of the user");
}

TEST(OutputFolder, TheListOfFilesLeadsNowhereElse) {
  const ScratchFolder scratch;
  scratch.write("outside", "keep");
  const auto out = scratch.path() / "out";
  std::filesystem::create_directories(out / "folder");
  write(out / "folder" / "in it", "keep");
  write(out / OutputFolder::manifest, "../outside\n..\n.\n\nfolder\nfolder/in it\n");
  OutputFolder(out).fill(writing({"a"}, ""));
  EXPECT_THAT(files(out), UnorderedElementsAre("a", "folder"));
  EXPECT_THAT(files(out / "folder"), UnorderedElementsAre("in it"));
  EXPECT_EQ(read_file(scratch.path() / "outside"), "keep");
}

TEST(OutputFolder, AFolderInTheWayLeavesAllAsItWas) {
  const ScratchFolder scratch;
  OutputFolder(scratch.path()).fill(writing({"a", "b"}, " 1"));
  std::filesystem::create_directories(scratch.path() / "z");
  write(scratch.path() / "z" / "in it", "keep");
  EXPECT_THAT(error_of([&] {
                OutputFolder(scratch.path()).fill(writing({"a", "c", "z"}, " 2"));
              }),
              HasSubstr("z is a folder, and a file of that name is to be written"));
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("a", "b", "z"));
  EXPECT_EQ(read_file(scratch.path() / "a"), "a 1");
  EXPECT_EQ(read_file(scratch.path() / "z" / "in it"), "keep");
}

TEST(OutputFolder, TwoThatMakeTheSameFolderDoNotLoseEachOther) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  OutputFolder(out).fill([&](const std::filesystem::path& folder) {
    write(folder / "a", "ours");
    std::filesystem::create_directories(out);
    write(out / "b", "another's");
  });
  EXPECT_THAT(files(out), UnorderedElementsAre("a", "b"));
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("out"));
}

TEST(OutputFolder, AFailureLeavesNothingBehind) {
  const ScratchFolder scratch;
  const auto fail = [](const std::filesystem::path& folder) {
    write(folder / "x", "half");
    throw Error("the disk is full");
  };
  EXPECT_EQ(error_of([&] { OutputFolder(scratch.path() / "out").fill(fail); }), "the disk is full");
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre());
  scratch.write("x", "old");
  EXPECT_EQ(error_of([&] { OutputFolder(scratch.path()).fill(fail); }), "the disk is full");
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("x"));
  EXPECT_EQ(read_file(scratch.path() / "x"), "old");
}

TEST(OutputFolder, IsReplacedAsAWholeByOneRename) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  OutputFolder(out).fill(writing({"a", "b"}, " 1"));
  const int before = open(out.c_str(), O_RDONLY | O_DIRECTORY);
  std::filesystem::create_directories(out / "folder");
  write(out / "folder" / "in it", "keep");
  OutputFolder(out).fill(writing({"a", "b"}, " 2"));
  struct stat then {};
  struct stat now {};
  ASSERT_EQ(fstat(before, &then), 0);
  ASSERT_EQ(stat(out.c_str(), &now), 0);
  EXPECT_NE(then.st_ino, now.st_ino) << "another folder has its name";
  EXPECT_EQ(read_file(out / "folder" / "in it"), "keep");
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("out"));
  close(before);
}

TEST(OutputFolder, BehindALinkItIsTheFolderThatIsReplaced) {
  const ScratchFolder scratch;
  std::filesystem::create_directory(scratch.path() / "there");
  std::filesystem::create_directory_symlink("there", scratch.path() / "link");
  OutputFolder(scratch.path() / "link").fill(writing({"a"}, ""));
  EXPECT_TRUE(std::filesystem::is_symlink(scratch.path() / "link"));
  EXPECT_THAT(files(scratch.path() / "there"), UnorderedElementsAre("a"));
}

TEST(OutputFolder, WhereOneStandsItIsFilledFileByFile) {
  const ScratchFolder scratch;
  scratch.write("foreign", "keep");
  const auto here = std::filesystem::current_path();
  std::filesystem::current_path(scratch.path());
  OutputFolder(".").fill(writing({"a", "b"}, " 1"));
  OutputFolder(".").fill(writing({"a"}, " 2"));
  EXPECT_THAT(files("."), UnorderedElementsAre("a", "foreign")) << "who stands in it sees it";
  std::filesystem::current_path(here);
}

TEST(OutputFolder, KilledRunsLeaveNothingMixedAndAreCleanedUp) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  OutputFolder(out).fill(writing({"a", "b", "c"}, " 0"));
  std::filesystem::create_directories(out / "folder");
  write(out / "notes", "keep");
  for (int i = 1; i <= 60; ++i) {
    const pid_t child = fork();
    if (child == 0) {
      for (int n = 0;; ++n)
        OutputFolder(out).fill(writing({"a", "b", "c"}, " " + std::to_string(i) + std::to_string(n)));
    }
    usleep(static_cast<useconds_t>(2000 + 137 * i));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    const std::string a = read_file(out / "a"), b = read_file(out / "b"), c = read_file(out / "c");
    EXPECT_EQ(a.substr(1), b.substr(1)) << "two runs mixed";
    EXPECT_EQ(a.substr(1), c.substr(1)) << "two runs mixed";
    EXPECT_EQ(read_file(out / "notes"), "keep");
  }
  OutputFolder(out).fill(writing({"a"}, " last"));
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("out"));
  EXPECT_THAT(files(out), UnorderedElementsAre("a", "notes", "folder"));
}

TEST(OutputFolder, TwoWritersTakeTurns) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  const pid_t child = fork();
  for (int n = 0; n < 50; ++n)
    OutputFolder(out).fill(writing({"a", "b", child == 0 ? "c" : "d"}, (child == 0 ? " c" : " p") + std::to_string(n)));
  if (child == 0) _exit(0);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(read_file(out / "a").substr(1), read_file(out / "b").substr(1));
  EXPECT_EQ(files(out).size(), 3u) << "of the last one alone";
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("out"));
}

TEST(OutputFolder, WhatIsNotDoneHasAPlaceBesideItOrOnItsOwnDisk) {
  const ScratchFolder scratch;
  EXPECT_EQ(OutputFolder(scratch.path() / "a" / "b/").partial(), scratch.path() / "a" / "b.partial");
  EXPECT_THAT(files(scratch.path()), testing::IsEmpty()) << "nothing is made";
  struct stat root {
  }, shm{};
  if (stat("/dev", &root) == 0 && stat("/dev/shm", &shm) == 0 && root.st_dev != shm.st_dev)
    EXPECT_EQ(OutputFolder("/dev/shm").partial(), "/dev/shm/partial");
}

TEST(OutputFolder, RefusesWhatIsNoFolder) {
  const ScratchFolder scratch;
  scratch.write("file", "");
  EXPECT_THAT(error_of([&] { OutputFolder(scratch.path() / "file"); }), HasSubstr("file is not a folder"));
  EXPECT_THAT(error_of([&] { OutputFolder(scratch.path() / "file" / "out"); }), HasSubstr("file is not a folder"));
  EXPECT_EQ(error_of([] { OutputFolder(""); }), "--out needs the name of a folder");
}

}  // namespace
}  // namespace tandem
