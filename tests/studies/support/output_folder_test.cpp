#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

TEST(OutputFolder, RefusesWhatIsNoFolder) {
  const ScratchFolder scratch;
  scratch.write("file", "");
  EXPECT_THAT(error_of([&] { OutputFolder(scratch.path() / "file"); }), HasSubstr("file is not a folder"));
  EXPECT_THAT(error_of([&] { OutputFolder(scratch.path() / "file" / "out"); }), HasSubstr("file is not a folder"));
  EXPECT_EQ(error_of([] { OutputFolder(""); }), "--out needs the name of a folder");
}

}  // namespace
}  // namespace tandem
