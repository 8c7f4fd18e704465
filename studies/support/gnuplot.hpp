#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem {

struct GnuplotRun {
  bool started = false;
  std::string output;   ///< its standard output; empty after a failure
  std::string warning;  ///< why it failed; empty on success
};

/// Runs a gnuplot script with arguments. Uses neither a shell nor the user's gnuplot settings.
GnuplotRun run_gnuplot(const std::filesystem::path& script, const std::vector<std::string>& arguments);

}  // namespace tandem
