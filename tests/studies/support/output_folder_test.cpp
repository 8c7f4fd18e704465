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
  out.fill({"x"}, [&](const std::filesystem::path& folder) {
    write(folder / "x", "new");
    EXPECT_FALSE(std::filesystem::exists(scratch.path() / "a" / "b")) << "nobody sees half of it";
  });
  EXPECT_THAT(files(scratch.path() / "a"), UnorderedElementsAre("b"));
  EXPECT_EQ(read_file(scratch.path() / "a" / "b" / "x"), "new");
}

TEST(OutputFolder, ReplacesOnlyItsOwnFiles) {
  const ScratchFolder scratch;
  scratch.write("x", "old");
  scratch.write("y", "of an earlier run");
  scratch.write("foreign", "keep");
  OutputFolder(scratch.path()).fill({"x", "y"}, [](const std::filesystem::path& folder) {
    write(folder / "x", "new");
  });
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre("x", "foreign"));
  EXPECT_EQ(read_file(scratch.path() / "x"), "new");
  EXPECT_EQ(read_file(scratch.path() / "foreign"), "keep");
}

TEST(OutputFolder, AFailureLeavesNothingBehind) {
  const ScratchFolder scratch;
  const auto fail = [](const std::filesystem::path& folder) {
    write(folder / "x", "half");
    throw Error("the disk is full");
  };
  EXPECT_EQ(error_of([&] { OutputFolder(scratch.path() / "out").fill({"x"}, fail); }), "the disk is full");
  EXPECT_THAT(files(scratch.path()), UnorderedElementsAre());
  scratch.write("x", "old");
  EXPECT_EQ(error_of([&] { OutputFolder(scratch.path()).fill({"x"}, fail); }), "the disk is full");
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
