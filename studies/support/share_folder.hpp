#pragma once

#include <filesystem>

namespace tandem {

/// share/tandem beside the folder that the executable is in: of an installation or of a build directory, which has its layout.
std::filesystem::path share_folder();

}  // namespace tandem
