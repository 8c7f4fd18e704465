#pragma once

#include <cstdint>
#include <cstring>
#include <string_view>

#include <tandem/lie/error.hpp>

namespace tandem {

/// Thrown by ByteReader at the end of the bytes.
class OutOfBytes : public Error {
 public:
  OutOfBytes() : Error("the data end before the message") {}
};

/// Reads numbers from bytes in memory, little-endian unless `big_endian`. Never reads beyond the end: throws
/// OutOfBytes.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes, bool big_endian = false) : bytes_(bytes), big_endian_(big_endian) {}

  std::size_t position() const { return at_; }
  std::size_t remaining() const { return bytes_.size() - at_; }
  bool empty() const { return at_ == bytes_.size(); }

  template <class T>
  T number() {
    unsigned char raw[sizeof(T)];
    std::memcpy(raw, take(sizeof(T)).data(), sizeof(T));
    if (big_endian_)
      for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(raw[i], raw[sizeof(T) - 1 - i]);
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return value;
  }
  std::uint8_t u8() { return number<std::uint8_t>(); }
  std::uint16_t u16() { return number<std::uint16_t>(); }
  std::uint32_t u32() { return number<std::uint32_t>(); }
  std::uint64_t u64() { return number<std::uint64_t>(); }

  std::string_view take(std::uint64_t n) {
    if (n > remaining()) throw OutOfBytes();
    const std::string_view part = bytes_.substr(at_, static_cast<std::size_t>(n));
    at_ += static_cast<std::size_t>(n);
    return part;
  }
  void skip(std::uint64_t n) { take(n); }
  /// Skips padding up to a multiple of n after `origin`.
  void align(std::size_t n, std::size_t origin = 0) {
    if (const std::size_t over = (at_ - origin) % n) skip(n - over);
  }
  /// Returns the text after its length of 32 bits.
  std::string_view text32() { return take(u32()); }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
  bool big_endian_;
};

}  // namespace tandem
