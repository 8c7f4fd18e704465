#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include <tandem/lie/error.hpp>

/// Common parts of the fuzz targets. libFuzzer calls a target with bytes, from which it derives user input. Misuse and
/// invalid input must throw tandem::Error. Violated properties and other exceptions abort the process, which libFuzzer
/// reports as a find.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace tandem::fuzz {

/// Aborts the process if a property does not hold.
inline void expect(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "fuzz: property violated: %s\n", what);
  std::abort();
}

/// Reads bytes one by one; zeros after the end.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : at_(data), end_(data + size) {}

  bool empty() const { return at_ == end_; }
  std::uint8_t byte() { return empty() ? std::uint8_t(0) : *at_++; }
  /// Returns a number below n, which is at most 256.
  std::size_t below(std::size_t n) { return n == 0 ? 0 : byte() % n; }
  /// Returns all remaining bytes.
  std::string text() {
    const auto* begin = reinterpret_cast<const char*>(at_);
    at_ = end_;
    return {begin, reinterpret_cast<const char*>(end_)};
  }

 private:
  const std::uint8_t* at_;
  const std::uint8_t* end_;
};

/// Returns whether a message is safe for a terminal: one line of UTF-8 without control characters.
inline bool is_printable(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c < 0x20 || c == 0x7f) return false;
    if (c < 0x80) continue;
    const int more = c >= 0xc2 && c < 0xe0 ? 1 : c >= 0xe0 && c < 0xf0 ? 2 : c >= 0xf0 && c < 0xf5 ? 3 : 0;
    if (more == 0 || (c == 0xc2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xa0)) return false;
    for (int k = 0; k < more; ++k)
      if (++i == text.size() || (static_cast<unsigned char>(text[i]) & 0xc0) != 0x80) return false;
  }
  return true;
}

/// Numbers of inputs that accepts() has seen.
inline int accepted = 0, rejected = 0;

/// Runs f() and returns whether it succeeded. The message of an Error must be one printable line.
template <class F>
bool accepts(F f) {
  try {
    f();
    ++accepted;
    return true;
  } catch (const Error& error) {
    expect(error.what()[0] != '\0', "an error has a message");
    expect(is_printable(error.what()), "an error's message is one printable line");
    ++rejected;
    return false;
  }
}

}  // namespace tandem::fuzz
