#pragma once

#include <filesystem>
#include <iostream>
#include <string>

#include <gtest/gtest.h>

#include "paths.hpp"
#include "required.hpp"

/// Reference values and recordings kept beside the repository, in ../shared, because they may not be copied
/// into it.
namespace tandem {

inline std::filesystem::path shared_path(const std::string& relative) {
  return std::filesystem::path(paths::shared) / relative;
}

inline bool shared_present() { return std::filesystem::is_directory(paths::shared); }

}  // namespace tandem

/// First line of a test that reads ../shared. Where the folder is absent the test says how many checks did not run, and
/// is skipped or, with TANDEM_REQUIRE_SHARED=1, fails; where the folder is there, a file missing from it is for the test
/// to fail on.
#define TANDEM_NEEDS_SHARED(checks)                                               \
  do {                                                                            \
    if (!tandem::shared_present()) {                                              \
      if (tandem::everything_required())                                          \
        FAIL() << tandem::paths::shared << " is absent, and is required here: "   \
               << "put the reference data there, or unset TANDEM_REQUIRE_SHARED"; \
      std::cerr << "../shared absent: " << (checks) << " checks not run\n";       \
      GTEST_SKIP() << "../shared absent: " << (checks) << " checks not run";      \
    }                                                                             \
  } while (false)
