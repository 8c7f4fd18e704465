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
  /// Adds a damaged record and the byte at which reading goes on.
  void add(std::uint64_t record, std::uint64_t next);
  bool any() const { return places_ > 0; }
  /// Returns one sentence with the first place and the number of the others.
  std::string sentence() const;

 private:
  std::size_t places_ = 0;
  std::uint64_t first_ = 0, next_ = 0, bytes_ = 0;
};

}  // namespace tandem
