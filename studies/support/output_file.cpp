#include <cerrno>
#include <cstring>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/replace_file.hpp>
#include <tandem/studies/support/output_file.hpp>

namespace tandem {

OutputFile::OutputFile(std::filesystem::path file) : file_(std::move(file)), stream_(file_, std::ios::binary) {
  if (!stream_) reason_ = errno;
}

void OutputFile::write(std::string_view text) {
  stream_.write(text.data(), static_cast<std::streamsize>(text.size()));
  if (!stream_ && reason_ == 0) reason_ = errno;
}

void OutputFile::close() {
  stream_.close();
  if (!stream_ && reason_ == 0) reason_ = errno;
  if (!stream_)
    throw Error(fmt::format("{} cannot be written{}", file_.string(),
                            reason_ ? fmt::format(": {}", std::strerror(reason_)) : ""));
}

void write_file(const std::filesystem::path& file, std::string_view text) {
  OutputFile out(file);
  out.write(text);
  out.close();
}

void replace_file(const std::filesystem::path& file, std::string_view text) {
  if (const std::error_code reason = detail::replace_file(file, text))
    throw Error(fmt::format("{} cannot be written: {}", file.string(), reason.message()));
}

}  // namespace tandem
