#pragma once

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "required.hpp"

namespace tandem {

inline bool program_present(const std::string& program) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (std::filesystem::exists(std::filesystem::path(folder) / program)) return true;
  return false;
}

inline bool gnuplot_present() { return program_present("gnuplot"); }

}  // namespace tandem

/// First line of a test that needs an optional program or library `name`. If it is not `present`, the test is skipped
/// and reports `what` was not checked; with TANDEM_REQUIRE_SHARED=1 it fails.
#define TANDEM_NEEDS(present, name, what)                                                        \
  do {                                                                                           \
    if (!(present)) {                                                                            \
      if (tandem::everything_required()) FAIL() << (name) << " absent: not checked: " << (what); \
      std::cerr << (name) << " absent: not checked: " << (what) << "\n";                         \
      GTEST_SKIP() << (name) << " absent: not checked: " << (what);                              \
    }                                                                                            \
  } while (false)
#define TANDEM_NEEDS_PROGRAM(name, what) TANDEM_NEEDS(tandem::program_present(name), name, what)
#define TANDEM_NEEDS_GNUPLOT(what) TANDEM_NEEDS_PROGRAM("gnuplot", what)
