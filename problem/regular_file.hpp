#pragma once

#include <filesystem>
#include <string>

namespace tandem::detail {

/// Opens a regular file for reading, following symbolic links, and returns its descriptor. Throws Error if the file is
/// missing, unreadable, a folder, a pipe or a device. Reading a pipe or a device may never end, so the type of the
/// opened file is checked, and opening never waits.
int open_regular_file(const std::filesystem::path& file);

/// Reads up to `size` bytes from a descriptor and returns their number, 0 at the end. Throws Error with the name `file`
/// if that fails.
std::size_t read_some(int descriptor, char* bytes, std::size_t size, const std::filesystem::path& file);

/// Returns the content of a regular file. Throws Error like open_regular_file() and read_some() do.
std::string read_regular_file(const std::filesystem::path& file);

}  // namespace tandem::detail
