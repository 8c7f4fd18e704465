#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <tandem/studies/support/input_file.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

TEST(InputFile, OpensFileThroughLink) {
  const ScratchFolder scratch;
  scratch.write("file", "text");
  std::filesystem::create_symlink("file", scratch.path() / "link");
  std::string text;
  InputFile(scratch.path() / "link") >> text;
  EXPECT_EQ(text, "text");
}

TEST(InputFile, ReadsAndSeeksLargeFiles) {
  const ScratchFolder scratch;
  std::string text;
  for (int i = 0; i < 50'000; ++i) text += std::to_string(i) + "\n";
  const auto file = scratch.write("file", text);
  EXPECT_EQ(read_text(file), text);
  InputFile stream(file);
  std::string line;
  for (int i = 0; i < 50'000; ++i) ASSERT_TRUE(std::getline(stream, line) && line == std::to_string(i)) << i;
  EXPECT_FALSE(std::getline(stream, line));
  stream.clear();
  stream.seekg(0, std::ios::end);
  EXPECT_EQ(std::size_t(stream.tellg()), text.size());
  stream.seekg(-6, std::ios::end);
  std::getline(stream, line);
  EXPECT_EQ(line, "49999");
  stream.clear();
  stream.seekg(2);
  std::getline(stream, line);
  EXPECT_EQ(line, "1");
  EXPECT_EQ(stream.tellg(), std::streampos(4));
}

TEST(InputFile, PathsThatLeadOutAreRefused) {
  const ScratchFolder scratch;
  const auto folder = scratch.path() / "folder";
  std::filesystem::create_directories(folder / "sub");
  scratch.write("outside", "secret");
  scratch.write("folder/sub/inside", "text");
  std::filesystem::create_symlink("sub/inside", folder / "link inside");
  std::filesystem::create_symlink("../outside", folder / "link outside");
  std::filesystem::create_directory_symlink("..", folder / "up");
  std::filesystem::create_directory_symlink("folder", scratch.path() / "link to folder");
  for (const char* name : {"sub/inside", "link inside", "sub/../link inside", "none"}) {
    EXPECT_FALSE(leads_outside(folder, name)) << name;
    EXPECT_FALSE(leads_outside(scratch.path() / "link to folder", name)) << name;
  }
  for (const char* name : {"../outside", "sub/../../outside", "link outside", "up/outside", "up/none", "/etc/passwd"})
    EXPECT_TRUE(leads_outside(folder, name)) << name;
  EXPECT_THAT(error_of([&] { file_in(folder, "up/outside"); }),
              HasSubstr("folder/up/outside leads outside " + folder.string() + "; use --allow-outside to read it"));
  allow_outside_files(true);
  EXPECT_EQ(file_in(folder, "up/outside"), folder / "up/outside");
  allow_outside_files(false);
}

TEST(InputFile, RejectsPipesDevicesFoldersAndMissingFiles) {
  const ScratchFolder scratch;
  ASSERT_EQ(mkfifo((scratch.path() / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(error_of([&] { InputFile file(scratch.path() / "pipe"); }), HasSubstr("pipe is a pipe or a device"));
  EXPECT_THAT(error_of([] { InputFile file("/dev/zero"); }), HasSubstr("/dev/zero is a pipe or a device"));
  EXPECT_THAT(error_of([&] { InputFile file(scratch.path()); }), HasSubstr("is a folder, not a file"));
  EXPECT_THAT(error_of([&] { InputFile file(scratch.path() / "none"); }), HasSubstr("none is missing"));
}

}  // namespace
}  // namespace tandem
