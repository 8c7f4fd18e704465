#pragma once

#include <filesystem>
#include <fstream>
#include <string>

namespace tandem {

/// Opens a file for reading. Throws Error if the file is missing, unreadable, a folder, a pipe or a device. Pipes and
/// devices are not opened, since reading them may never end.
std::ifstream open_input(const std::filesystem::path& file);
/// Returns the content of a file. Throws Error as open_input() does.
std::string read_text(const std::filesystem::path& file);

}  // namespace tandem
