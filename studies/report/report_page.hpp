#pragma once

#include <filesystem>
#include <string>

namespace tandem {

/// A page about what is in a folder, a study's or that of a run's --out: self-contained HTML. Of a study it estimates
/// a few trials again, to show them. Throws Error where the folder is neither, or cannot be read.
std::string report_page(const std::filesystem::path& folder);

}  // namespace tandem
