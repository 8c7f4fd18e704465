#pragma once

#include <filesystem>
#include <iostream>
#include <string>

#include <gtest/gtest.h>

#include "paths.hpp"
#include "required.hpp"

/// Access to reference values and recordings in ../shared, whose licences do not allow a copy in the repository.
namespace tandem {

inline std::filesystem::path shared_path(const std::string& relative) {
  return std::filesystem::path(paths::shared) / relative;
}

inline bool shared_present() { return std::filesystem::is_directory(paths::shared); }

}  // namespace tandem

/// First line of a test that reads ../shared. If the folder is absent, the test is skipped and reports how many checks
/// did not run; with TANDEM_REQUIRE_SHARED=1 it fails. If the folder exists but a file is missing, the test itself must
/// fail.
#define TANDEM_NEEDS_SHARED(checks)                                               \
  do {                                                                            \
    if (!tandem::shared_present()) {                                              \
      if (tandem::everything_required())                                          \
        FAIL() << tandem::paths::shared << " is absent but required: "            \
               << "put the reference data there, or unset TANDEM_REQUIRE_SHARED"; \
      std::cerr << "../shared absent: " << (checks) << " checks not run\n";       \
      GTEST_SKIP() << "../shared absent: " << (checks) << " checks not run";      \
    }                                                                             \
  } while (false)
