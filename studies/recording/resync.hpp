#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include <tandem/studies/recording/file_bytes.hpp>

namespace tandem {

/// Returns the first byte in [from, end) at which a record begins, or nothing. `may_begin` is a fast test of the bytes
/// from there on, at least `head` of them unless the file ends. `begins` reads the file to decide.
std::optional<std::uint64_t> find_record(FileBytes& file, std::uint64_t from, std::uint64_t end, std::size_t head,
                                         const std::function<bool(std::string_view)>& may_begin,
                                         const std::function<bool(std::uint64_t)>& begins);

/// Places of a file that cannot be read, after which reading goes on.
class DamagedPlaces {
 public:
  /// Returns the first record in [from, end), or nothing. `any`: also one of those that are in chunks.
  using Find = std::function<std::optional<std::uint64_t>(std::uint64_t from, std::uint64_t end, bool any)>;

  /// `first`: the first record of the file.
  explicit DamagedPlaces(std::uint64_t first) : record_(first), content_(first) {}

  /// Notes the last record that was read, and the byte at which its content begins.
  void read(std::uint64_t record, std::uint64_t content) {
    record_ = record;
    content_ = content;
  }
  /// Adds a damaged record and the byte at which reading goes on.
  void add(std::uint64_t record, std::uint64_t next);
  /// Adds the place at byte `at`, where no record is, and returns the byte at which reading goes on, or nothing. If
  /// there is a record before `at`, the length of the last one that was read is too large.
  std::optional<std::uint64_t> resume(std::uint64_t at, std::uint64_t end, const Find& find);
  bool any() const { return places_ > 0; }
  /// Returns one sentence with the first place and the number of the others.
  std::string sentence() const;

 private:
  std::size_t places_ = 0;
  std::uint64_t first_ = 0, next_ = 0, bytes_ = 0;
  std::uint64_t record_, content_;  // of the last record that was read
};

}  // namespace tandem
