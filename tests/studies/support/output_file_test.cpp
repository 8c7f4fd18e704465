#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/output_file.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

TEST(ReplaceFile, ReplacesTheContentAndLeavesNoOtherFile) {
  const ScratchFolder scratch;
  const auto file = scratch.write("noise.yaml", "old and longer");
  replace_file(file, "new");
  EXPECT_EQ(read_file(file), "new");
  replace_file(scratch.path() / "other", "first");
  EXPECT_EQ(read_file(scratch.path() / "other"), "first");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 2);
}

TEST(ReplaceFile, FollowsSymbolicLinksAndWritesDevices) {
  const ScratchFolder scratch;
  const auto file = scratch.write("noise.yaml", "old");
  std::filesystem::create_symlink(file, scratch.path() / "link");
  replace_file(scratch.path() / "link", "new");
  EXPECT_TRUE(std::filesystem::is_symlink(scratch.path() / "link"));
  EXPECT_EQ(read_file(file), "new");
  replace_file("/dev/null", "nothing");
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

TEST(ReplaceFile, KeepsTheOldContentIfItFails) {
  const ScratchFolder scratch;
  const auto file = scratch.write("noise.yaml", "old");
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{10, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  std::string why;
  try {
    replace_file(file, std::string(100, 'x'));
  } catch (const Error& error) {
    why = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(why, HasSubstr("noise.yaml cannot be written: File too large"));
  EXPECT_EQ(read_file(file), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 1);
  EXPECT_THROW(replace_file(scratch.path(), "x"), Error) << "a folder";
  EXPECT_THROW(replace_file(scratch.path() / "no" / "file", "x"), Error);
}

}  // namespace
}  // namespace tandem
