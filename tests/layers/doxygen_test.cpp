#include <cstdlib>

#include <gtest/gtest.h>

#include "needs_program.hpp"
#include "paths.hpp"
#include "studies/scratch.hpp"

namespace tandem {
namespace {

/// Runs Doxygen as the target `docs` does; warnings are errors.
TEST(Doxygen, BuildsReferencePagesWithoutWarnings) {
  TANDEM_NEEDS_PROGRAM("doxygen", "the comments of public headers");
  const ScratchFolder scratch;
  const std::string command = "cd '" + std::string(paths::source) +
                              "' && (cat cmake/Doxyfile.in; echo OUTPUT_DIRECTORY=" + scratch.path().string() +
                              ") | doxygen - > '" + (scratch.path() / "log").string() + "' 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << read_file(scratch.path() / "log");
  EXPECT_TRUE(std::filesystem::exists(scratch.path() / "html/index.html"));
}

}  // namespace
}  // namespace tandem
