#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include <tandem/lie/error.hpp>

/// What the fuzz targets share. A target is the function that libFuzzer calls; it makes of some bytes what a user may
/// hand the program, and ends the process where the program does what it must not. tandem::Error is what misuse and
/// nonsense are to give; anything else that is thrown ends the process too.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace tandem::fuzz {

/// Ends the process, as a find.
inline void expect(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "fuzz: not so: %s\n", what);
  std::abort();
}

/// Bytes taken one by one; zeros after their end.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : at_(data), end_(data + size) {}

  bool empty() const { return at_ == end_; }
  std::uint8_t byte() { return empty() ? std::uint8_t(0) : *at_++; }
  /// Below n, which is at most 256.
  std::size_t below(std::size_t n) { return n == 0 ? 0 : byte() % n; }
  /// All that are left.
  std::string text() {
    const auto* begin = reinterpret_cast<const char*>(at_);
    at_ = end_;
    return {begin, reinterpret_cast<const char*>(end_)};
  }

 private:
  const std::uint8_t* at_;
  const std::uint8_t* end_;
};

/// Whether a message is what a terminal should be sent, whatever it quotes: one line of UTF-8 without control characters.
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

/// Runs f(); an Error is one printable sentence.
template <class F>
bool accepts(F f) {
  try {
    f();
    return true;
  } catch (const Error& error) {
    expect(error.what()[0] != '\0', "an error has a message");
    expect(is_printable(error.what()), "an error's message is one printable line");
    return false;
  }
}

}  // namespace tandem::fuzz
