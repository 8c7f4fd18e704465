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
  open_input(scratch.path() / "link") >> text;
  EXPECT_EQ(text, "text");
}

TEST(InputFile, RejectsPipesDevicesFoldersAndMissingFiles) {
  const ScratchFolder scratch;
  ASSERT_EQ(mkfifo((scratch.path() / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(error_of([&] { open_input(scratch.path() / "pipe"); }), HasSubstr("pipe is a pipe or a device"));
  EXPECT_THAT(error_of([] { open_input("/dev/zero"); }), HasSubstr("/dev/zero is a pipe or a device"));
  EXPECT_THAT(error_of([&] { open_input(scratch.path()); }), HasSubstr("is a folder, not a file"));
  EXPECT_THAT(error_of([&] { open_input(scratch.path() / "none"); }), HasSubstr("none is missing"));
}

}  // namespace
}  // namespace tandem
