#pragma once

#include <filesystem>
#include <fstream>

namespace tandem {

/// Opens a file to read. Throws Error when it is missing, a folder or cannot be read, and without opening it when it is a
/// pipe or a device, which may have no end.
std::ifstream open_input(const std::filesystem::path& file);

}  // namespace tandem
