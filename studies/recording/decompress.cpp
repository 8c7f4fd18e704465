#include <new>

#include <fmt/format.h>
#ifdef TANDEM_HAS_BZIP2
#include <bzlib.h>
#endif
#ifdef TANDEM_HAS_LZ4
#include <lz4frame.h>
#endif
#ifdef TANDEM_HAS_ZSTD
#include <zstd.h>
#endif

#include <tandem/studies/recording/decompress.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kMaxChunk = std::size_t(1) << 30;  // bytes; larger sizes are corrupted

[[maybe_unused]] std::string not_built(const char* name, const char* package) {
  return fmt::format("it is compressed with {}, but Tandem was built without it: install {} and build again", name,
                     package);
}

#if defined(TANDEM_HAS_LZ4) || defined(TANDEM_HAS_ZSTD) || defined(TANDEM_HAS_BZIP2)
/// Shortens `out` to the bytes that were written, and returns the reason if they are too few.
std::string shortened(const char* name, std::size_t written, std::string& out) {
  if (written == out.size()) return "";
  const std::size_t size = out.size();
  out.resize(written);
  return fmt::format("the {} data are corrupted or incomplete after {} of {} bytes", name, written, size);
}
#endif

#ifdef TANDEM_HAS_LZ4
std::string lz4(std::string_view data, std::string& out) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) throw std::bad_alloc();
  std::size_t written = 0, left = 1;
  while (!data.empty() && written < out.size() && left != 0) {
    std::size_t n_out = out.size() - written, n_in = data.size();
    left = LZ4F_decompress(context, out.data() + written, &n_out, data.data(), &n_in, nullptr);
    if (LZ4F_isError(left) || (n_in == 0 && n_out == 0)) break;
    written += n_out;
    data.remove_prefix(n_in);
  }
  LZ4F_freeDecompressionContext(context);
  return shortened("lz4", written, out);
}
#endif

#ifdef TANDEM_HAS_ZSTD
std::string zstd(std::string_view data, std::string& out) {
  ZSTD_DCtx* context = ZSTD_createDCtx();
  if (!context) throw std::bad_alloc();
  ZSTD_inBuffer input{data.data(), data.size(), 0};
  ZSTD_outBuffer output{out.data(), out.size(), 0};
  for (std::size_t before = 1, now = 0; before != now && output.pos < output.size;) {
    before = input.pos + output.pos;
    if (ZSTD_isError(ZSTD_decompressStream(context, &output, &input))) break;
    now = input.pos + output.pos;
  }
  ZSTD_freeDCtx(context);
  return shortened("zstd", output.pos, out);
}
#endif

#ifdef TANDEM_HAS_BZIP2
std::string bz2(std::string_view data, std::string& out) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw std::bad_alloc();
  // The library does not write to its input, although its declaration lacks const.
  stream.next_in = const_cast<char*>(data.data());
  stream.avail_in = static_cast<unsigned>(data.size());
  stream.next_out = out.data();
  stream.avail_out = static_cast<unsigned>(out.size());
  while (stream.avail_out > 0 && stream.avail_in > 0 && BZ2_bzDecompress(&stream) == BZ_OK) {
  }
  const std::size_t written = out.size() - stream.avail_out;
  BZ2_bzDecompressEnd(&stream);
  return shortened("bz2", written, out);
}
#endif

}  // namespace

std::string decompress(std::string_view compression, std::string_view data, std::size_t size, std::string& out) {
  out.clear();
  if (size > kMaxChunk) return fmt::format("its stated size of {} bytes is not plausible", size);
  if (compression.empty() || compression == "none") {
    out.assign(data);
    return "";
  }
  [[maybe_unused]] const auto with = [&](auto decompressor) {
    out.resize(size);
    return decompressor(data, out);
  };
  if (compression == "lz4") {
#ifdef TANDEM_HAS_LZ4
    return with(lz4);
#else
    return not_built("lz4", "liblz4-dev");
#endif
  }
  if (compression == "zstd") {
#ifdef TANDEM_HAS_ZSTD
    return with(zstd);
#else
    return not_built("zstd", "libzstd-dev");
#endif
  }
  if (compression == "bz2") {
#ifdef TANDEM_HAS_BZIP2
    return with(bz2);
#else
    return not_built("bz2", "libbz2-dev");
#endif
  }
  return fmt::format("it has the unknown compression {}; known are none, lz4, zstd and bz2", quote(compression));
}

bool is_zstd(std::string_view data) { return data.starts_with("\x28\xB5\x2F\xFD"); }

std::string decompress_message(std::string_view data, std::string& out) {
#ifdef TANDEM_HAS_ZSTD
  const unsigned long long size = ZSTD_getFrameContentSize(data.data(), data.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN)
    return "it is compressed with zstd, but does not state its size";
  return decompress("zstd", data, static_cast<std::size_t>(size), out);
#else
  return decompress("zstd", data, 0, out);
#endif
}

}  // namespace tandem
