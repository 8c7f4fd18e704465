#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem {

struct GnuplotRun {
  bool started = false;
  std::string output;     ///< what it wrote to standard output
  std::string complaint;  ///< why it failed, or nothing
};

/// Runs a gnuplot script with arguments, without the user's own settings; no shell is involved.
GnuplotRun run_gnuplot(const std::filesystem::path& script, const std::vector<std::string>& arguments);

}  // namespace tandem
