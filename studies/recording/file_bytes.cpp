#include <tandem/studies/recording/byte_reader.hpp>
#include <tandem/studies/recording/file_bytes.hpp>
#include <tandem/studies/support/input_file.hpp>

namespace tandem {

FileBytes::FileBytes(const std::filesystem::path& file) : stream_(file), size_(std::filesystem::file_size(file)) {}

std::string_view FileBytes::read(std::uint64_t position, std::uint64_t n) {
  if (position > size_ || n > size_ - position) throw OutOfBytes();
  if (buffer_.size() < n) buffer_.resize(static_cast<std::size_t>(n));
  if (position != at_) stream_.seekg(static_cast<std::streamoff>(position));
  stream_.read(buffer_.data(), static_cast<std::streamsize>(n));
  if (static_cast<std::uint64_t>(stream_.gcount()) != n) {
    stream_.clear();
    at_ = size_ + 1;
    throw OutOfBytes();
  }
  at_ = position + n;
  return {buffer_.data(), static_cast<std::size_t>(n)};
}

}  // namespace tandem
