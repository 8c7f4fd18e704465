#pragma once

#include <filesystem>
#include <string>

namespace tandem {

/// Runs a gnuplot script, data inline, with its terminal's output going to `file`; no shell is involved, and
/// no name reaches the script. Empty, or a sentence that says why there is no plot.
std::string run_gnuplot(const std::string& script, const std::filesystem::path& file);

/// `text` as a gnuplot string literal.
std::string gnuplot_string(const std::string& text);

}  // namespace tandem
