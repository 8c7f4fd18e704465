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

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/decompress.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kMaxChunk = std::size_t(1) << 30;  // bytes; larger sizes are corrupted

[[maybe_unused]] [[noreturn]] void not_built(const char* name, const char* package) {
  throw Error(fmt::format("it is compressed with {}, but Tandem was built without it: install {} and build again", name,
                          package));
}

[[noreturn]] void corrupted(std::string_view name) { throw Error(fmt::format("the {} data are corrupted", name)); }

void lz4(std::string_view data, std::string& out) {
#ifdef TANDEM_HAS_LZ4
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) corrupted("lz4");
  std::size_t written = 0, left = 1;
  while (!data.empty() && written < out.size() && left != 0) {
    std::size_t n_out = out.size() - written, n_in = data.size();
    left = LZ4F_decompress(context, out.data() + written, &n_out, data.data(), &n_in, nullptr);
    if (LZ4F_isError(left) || (n_in == 0 && n_out == 0)) break;
    written += n_out;
    data.remove_prefix(n_in);
  }
  LZ4F_freeDecompressionContext(context);
  if (written != out.size()) corrupted("lz4");
#else
  (void)data, (void)out;
  not_built("lz4", "liblz4-dev");
#endif
}

void zstd(std::string_view data, std::string& out) {
#ifdef TANDEM_HAS_ZSTD
  if (ZSTD_decompress(out.data(), out.size(), data.data(), data.size()) != out.size()) corrupted("zstd");
#else
  (void)data, (void)out;
  not_built("zstd", "libzstd-dev");
#endif
}

void bz2(std::string_view data, std::string& out) {
#ifdef TANDEM_HAS_BZIP2
  auto size = static_cast<unsigned>(out.size());
  // The library does not write to its input, although its declaration lacks const.
  if (BZ2_bzBuffToBuffDecompress(out.data(), &size, const_cast<char*>(data.data()), static_cast<unsigned>(data.size()),
                                 0, 0) != BZ_OK ||
      size != out.size())
    corrupted("bz2");
#else
  (void)data, (void)out;
  not_built("bz2", "libbz2-dev");
#endif
}

}  // namespace

void decompress(std::string_view compression, std::string_view data, std::size_t size, std::string& out) {
  if (size > kMaxChunk) throw Error(fmt::format("its stated size of {} bytes is not plausible", size));
  if (compression.empty() || compression == "none") {
    out.assign(data);
    return;
  }
  out.resize(size);
  if (size == 0) return;
  if (compression == "lz4")
    lz4(data, out);
  else if (compression == "zstd")
    zstd(data, out);
  else if (compression == "bz2")
    bz2(data, out);
  else
    throw Error(
        fmt::format("it has the unknown compression {}; known are none, lz4, zstd and bz2", quote(compression)));
}

}  // namespace tandem
