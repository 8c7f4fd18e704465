#pragma once

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <sstream>

#include <gtest/gtest.h>

namespace tandem {

inline bool gnuplot_present() {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (std::filesystem::exists(std::filesystem::path(folder) / "gnuplot")) return true;
  return false;
}

}  // namespace tandem

/// First line of a test that draws. Without gnuplot, which is optional, it is reported as skipped and says what was not
/// checked; where TANDEM_REQUIRE_SHARED asks for every check, it fails.
#define TANDEM_NEEDS_GNUPLOT(what)                                                                   \
  do {                                                                                               \
    if (!tandem::gnuplot_present()) {                                                                \
      if (std::getenv("TANDEM_REQUIRE_SHARED")) FAIL() << "gnuplot absent: not checked: " << (what); \
      std::cerr << "gnuplot absent: not checked: " << (what) << "\n";                                \
      GTEST_SKIP() << "gnuplot absent: not checked: " << (what);                                     \
    }                                                                                                \
  } while (false)
