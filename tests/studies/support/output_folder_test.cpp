#include <csignal>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/output_folder.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::UnorderedElementsAre;

void write(const std::filesystem::path& file, const std::string& text) { std::ofstream(file) << text; }

TEST(OutputFolder, CreatesNothingBeforeFill) {
  const ScratchFolder scratch;
  const OutputFolder out(scratch.path() / "a" / "b/");
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre());
  out.fill([&](const std::filesystem::path& folder) {
    write(folder / "x", "new");
    EXPECT_FALSE(std::filesystem::exists(scratch.path() / "a" / "b")) << "incomplete results are not visible";
  });
  EXPECT_THAT(files(scratch.path() / "a"), UnorderedElementsAre("b"));
  EXPECT_EQ(read_file(scratch.path() / "a" / "b" / "x"), "new");
}

/// Returns a function that writes files of these names, each with its name and `text` as content.
auto writing(const std::vector<std::string>& names, const std::string& text) {
  return [=](const std::filesystem::path& folder) {
    for (const std::string& name : names) write(folder / name, name + text);
  };
}

TEST(OutputFolder, AddsRunFile) {
  const ScratchFolder scratch;
  set_run_file("command: probe\n");
  OutputFolder(scratch.path() / "out").fill(writing({"a"}, ""));
  set_run_file("");
  EXPECT_THAT(files(scratch.path() / "out"), UnorderedElementsAre("a", "run.yaml"));
  EXPECT_EQ(read_file(scratch.path() / "out" / "run.yaml"), "command: probe\n");
  OutputFolder(scratch.path() / "out").fill(writing({"a"}, ""));
  EXPECT_THAT(files(scratch.path() / "out"), UnorderedElementsAre("a")) << "that of the previous run is removed";
}

TEST(OutputFolder, OverwritesForeignFilesOnlyByForce) {
  const ScratchFolder scratch;
  scratch.write("x", "old");
  scratch.write("user file", "keep");
  OutputFolder out(scratch.path());
  EXPECT_THAT(error_of([&] { out.check({"x", "y"}); }), HasSubstr("tandem did not write x; name another folder, or"));
  EXPECT_THAT(error_of([&] { out.fill(writing({"x", "new file"}, " new")); }), HasSubstr("tandem did not write x"));
  EXPECT_EQ(read_file(scratch.path() / "x"), "old");
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("x", "user file"));
  out.force();
  out.fill(writing({"x", "new file"}, " new"));
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("x", "new file", "user file"));
  EXPECT_EQ(read_file(scratch.path() / "x"), "x new");
  EXPECT_EQ(read_file(scratch.path() / "user file"), "keep");
  OutputFolder(scratch.path()).fill(writing({"x"}, " newer"));
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("x", "user file")) << "its own files now";
}

TEST(OutputFolder, KeepsScenarioThatTandemWrote) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  OutputFolder(out).fill(writing({"scenario.yaml", "usbl.csv"}, " 1"));
  EXPECT_THAT(error_of([&] { OutputFolder(out).check({"x"}); }), HasSubstr("is a scenario that tandem wrote"));
  EXPECT_THAT(error_of([&] { OutputFolder(out).fill(writing({"x"}, "")); }), HasSubstr("is a scenario that tandem"));
  OutputFolder forced(out);
  forced.force();
  forced.fill(writing({"x"}, " 2"));
  EXPECT_THAT(files(out), UnorderedElementsAre("scenario.yaml", "usbl.csv", "x"));
  OutputFolder(scratch.path() / "other").fill(writing({"scenario.yaml", "usbl.csv"}, " 1"));
  OutputFolder(scratch.path() / "other").fill(writing({"scenario.yaml"}, " 2"));
  EXPECT_THAT(files(scratch.path() / "other"), UnorderedElementsAre("scenario.yaml")) << "by another scenario";
}

/// A folder with the name of a killed run's temporary folder, for example from an untrusted archive.
TEST(OutputFolder, RecoversOnlyFoldersOfItsOwnRuns) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out", docs = scratch.path() / "docs";
  std::filesystem::create_directories(docs);
  std::filesystem::create_directories(out);
  scratch.write("docs/thesis", "keep");
  const auto planted = [&](const char* name) {
    const auto folder = scratch.path() / name;
    std::filesystem::create_directories(folder / "id-1");
    std::filesystem::create_directories(folder / "id-1-0-0");
    std::ofstream(folder / "swap") << "";
    return folder;
  };
  std::filesystem::create_directory_symlink(docs, planted(".out.tandem-4000001-0") / "new");
  std::filesystem::create_directory(planted(".out.tandem-4000001-abcdef") / "new");
  std::ofstream(scratch.path() / ".out.tandem-4000001-abcdef" / "new" / "thesis") << "planted";
  std::filesystem::create_directory_symlink(docs, scratch.path() / ".out.tandem-4000001-1");
  std::filesystem::create_directory(scratch.path() / ".out.tandem-4000001-2");
  OutputFolder(out).fill(writing({"a"}, ""));
  EXPECT_THAT(files(out), UnorderedElementsAre("a"));
  EXPECT_EQ(read_file(docs / "thesis"), "keep");
  EXPECT_TRUE(std::filesystem::exists(scratch.path() / ".out.tandem-4000001-abcdef" / "new" / "thesis"));
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / ".out.tandem-4000001-2")) << "empty ones are removed";
}

TEST(OutputFolder, RefusesInputsInIt) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  OutputFolder(out).fill(writing({"noise.yaml"}, ""));
  OutputFolder(out).check({});
  EXPECT_THAT(error_of([&] { read_text(out / "noise.yaml"); }),
              HasSubstr("is an input of this run, but in the output"));
  std::filesystem::create_symlink(out / "noise.yaml", scratch.path() / "link");
  EXPECT_THAT(error_of([&] { read_text(scratch.path() / "link"); }), HasSubstr("is an input of this run"));
  EXPECT_EQ(read_state(out / "noise.yaml"), "noise.yaml");
  refuse_inputs_in({});
  EXPECT_EQ(read_text(out / "noise.yaml"), "noise.yaml");
}

TEST(OutputFolder, RemovesFilesOfLastRun) {
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

TEST(OutputFolder, ManifestCannotNameFilesOutsideFolder) {
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

TEST(OutputFolder, FolderWithNameOfOutputFileIsErrorWithoutChanges) {
  const ScratchFolder scratch;
  OutputFolder(scratch.path()).fill(writing({"a", "b"}, " 1"));
  std::filesystem::create_directories(scratch.path() / "z");
  write(scratch.path() / "z" / "in it", "keep");
  EXPECT_THAT(error_of([&] {
                OutputFolder(scratch.path()).fill(writing({"a", "c", "z"}, " 2"));
              }),
              HasSubstr("z is a folder; remove or rename it, since a file of that name must be written"));
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("a", "b", "z"));
  EXPECT_EQ(read_file(scratch.path() / "a"), "a 1");
  EXPECT_EQ(read_file(scratch.path() / "z" / "in it"), "keep");
}

TEST(OutputFolder, KeepsFolderCreatedMeanwhile) {
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

TEST(OutputFolder, FailureLeavesNothingBehind) {
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

TEST(OutputFolder, ReplacesFolderByOneRename) {
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
  EXPECT_NE(then.st_ino, now.st_ino) << "the name refers to another folder";
  EXPECT_EQ(read_file(out / "folder" / "in it"), "keep");
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("out"));
  close(before);
}

TEST(OutputFolder, ReplacesFolderBehindLink) {
  const ScratchFolder scratch;
  std::filesystem::create_directory(scratch.path() / "there");
  std::filesystem::create_directory_symlink("there", scratch.path() / "link");
  OutputFolder(scratch.path() / "link").fill(writing({"a"}, ""));
  EXPECT_TRUE(std::filesystem::is_symlink(scratch.path() / "link"));
  EXPECT_THAT(files(scratch.path() / "there"), UnorderedElementsAre("a"));
}

TEST(OutputFolder, ReplacesFilesOfCurrentFolderOneByOne) {
  const ScratchFolder scratch;
  scratch.write("user file", "keep");
  const auto here = std::filesystem::current_path();
  std::filesystem::current_path(scratch.path());
  OutputFolder(".").fill(writing({"a", "b"}, " 1"));
  OutputFolder(".").fill(writing({"a"}, " 2"));
  EXPECT_THAT(files("."), UnorderedElementsAre("a", "user file")) << "visible in the current folder";
  std::filesystem::current_path(here);
}

TEST(OutputFolder, KilledRunsLeaveCompleteFolderAndAreCleanedUp) {
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
    EXPECT_EQ(a.substr(1), b.substr(1)) << "files of two runs are mixed";
    EXPECT_EQ(a.substr(1), c.substr(1)) << "files of two runs are mixed";
    EXPECT_EQ(read_file(out / "notes"), "keep");
  }
  OutputFolder(out).fill(writing({"a"}, " last"));
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("out"));
  EXPECT_THAT(files(out), UnorderedElementsAre("a", "notes", "folder"));
}

TEST(OutputFolder, SerialisesTwoWriters) {
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
  EXPECT_EQ(files(out).size(), 3u) << "only files of the last writer";
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("out"));
}

TEST(OutputFolder, PartialFolderIsOnSameFileSystem) {
  const ScratchFolder scratch;
  EXPECT_EQ(OutputFolder(scratch.path() / "a" / "b/").partial(), scratch.path() / "a" / "b.partial");
  EXPECT_THAT(files(scratch.path()), testing::IsEmpty()) << "nothing is created";
  struct stat root {
  }, shm{};
  if (stat("/dev", &root) == 0 && stat("/dev/shm", &shm) == 0 && root.st_dev != shm.st_dev)
    EXPECT_EQ(OutputFolder("/dev/shm").partial(), "/dev/shm/partial");
}

TEST(OutputFolder, RejectsPathsThatAreNotFolders) {
  const ScratchFolder scratch;
  scratch.write("file", "");
  EXPECT_THAT(error_of([&] { OutputFolder(scratch.path() / "file"); }), HasSubstr("file is not a folder"));
  EXPECT_THAT(error_of([&] { OutputFolder(scratch.path() / "file" / "out"); }), HasSubstr("file is not a folder"));
  EXPECT_EQ(error_of([] { OutputFolder(""); }), "--out needs a folder name");
}

}  // namespace
}  // namespace tandem
