#pragma once

#include <filesystem>
#include <string_view>
#include <system_error>

namespace tandem::detail {

/// Replaces the whole content of a file, following symbolic links. Writes a temporary file beside it and renames that,
/// both flushed to the disk. The file is thus never incomplete, and a failure leaves the old content. Pipes and devices
/// are written in place.
std::error_code replace_file(const std::filesystem::path& file, std::string_view text);

/// Writes the whole text to a descriptor.
std::error_code write_text(int descriptor, std::string_view text);
/// Flushes the data of a file to the disk.
std::error_code sync_file(int descriptor);
/// Flushes the entries of a file's folder to the disk, so that a new or renamed file survives a power failure.
void sync_folder_of(const std::filesystem::path& file);

}  // namespace tandem::detail
