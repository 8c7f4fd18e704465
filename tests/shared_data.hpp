#pragma once

#include <filesystem>
#include <iostream>
#include <string>

#include <gtest/gtest.h>

/// Reference values and recordings kept beside the repository, in ../shared, because they may not be copied
/// into it.
namespace tandem {

inline std::filesystem::path shared_path(const std::string& relative) {
  return std::filesystem::path(TANDEM_SHARED_DIR) / relative;
}

inline bool shared_present() { return std::filesystem::is_directory(TANDEM_SHARED_DIR); }

}  // namespace tandem

/// First line of a test that reads ../shared. Where the folder is absent the test is reported as skipped and
/// says how many checks did not run; where the folder is there, a file missing from it is for the test to
/// fail on.
#define TANDEM_NEEDS_SHARED(checks)                                          \
  do {                                                                       \
    if (!tandem::shared_present()) {                                         \
      std::cerr << "../shared absent: " << (checks) << " checks not run\n";  \
      GTEST_SKIP() << "../shared absent: " << (checks) << " checks not run"; \
    }                                                                        \
  } while (false)
