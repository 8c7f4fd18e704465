#pragma once

#include <string>
#include <string_view>

namespace tandem {

/// Decompresses a chunk of a bag into `out`, whose size should be `size` bytes. `compression` is "", "none", "lz4",
/// "zstd" or "bz2". Returns an empty string, or the reason why `out` has only the first part of the data. If the
/// compression is unknown or not part of this build, `out` is empty. Other reasons are corrupted or incomplete data.
std::string decompress(std::string_view compression, std::string_view data, std::size_t size, std::string& out);

/// Returns whether data begin as a frame of zstd.
bool is_zstd(std::string_view data);

/// Decompresses a message of rosbag2's compression mode MESSAGE, which is one frame of zstd. Returns an empty string, or
/// the reason why `out` is incomplete.
std::string decompress_message(std::string_view data, std::string& out);

}  // namespace tandem
