#pragma once

#include <string>
#include <string_view>

namespace tandem {

/// Decompresses a chunk of a bag into `out`, whose size is known to be `size` bytes. `compression` is "", "none", "lz4",
/// "zstd" or "bz2". Throws Error if the compression is unknown, was not built, or if the data are corrupted.
void decompress(std::string_view compression, std::string_view data, std::size_t size, std::string& out);

}  // namespace tandem
