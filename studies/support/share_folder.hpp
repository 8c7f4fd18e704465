#pragma once

#include <filesystem>

namespace tandem {

/// The folder with bin, libexec and share that the executable is in: of an installation, or a build directory, which has its
/// layout.
std::filesystem::path installation_folder();

/// share/tandem there.
std::filesystem::path share_folder();

}  // namespace tandem
