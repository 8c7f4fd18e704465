#include <cerrno>

#include <gtest/gtest.h>

#include <tandem/studies/support/file_lock.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

TEST(FileLock, IsExclusiveUntilDestroyed) {
  const ScratchFolder scratch;
  for (const std::filesystem::path& path : {scratch.path(), scratch.path() / "study.lock"}) {
    {
      const FileLock first(path, FileLock::Busy::wait);
      EXPECT_EQ(first.failure(), 0) << path;
      EXPECT_EQ(FileLock(path, FileLock::Busy::give_up).failure(), EWOULDBLOCK) << path;
    }
    EXPECT_EQ(FileLock(path, FileLock::Busy::give_up).failure(), 0) << path;
  }
  EXPECT_EQ(FileLock(scratch.path() / "no" / "file", FileLock::Busy::wait).failure(), ENOENT);
}

}  // namespace
}  // namespace tandem
