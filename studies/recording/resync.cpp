#include <algorithm>

#include <fmt/format.h>

#include <tandem/studies/recording/byte_reader.hpp>
#include <tandem/studies/recording/resync.hpp>

namespace tandem {

std::optional<std::uint64_t> find_record(FileBytes& file, std::uint64_t from, std::uint64_t end, std::size_t head,
                                         const std::function<bool(std::string_view)>& may_begin,
                                         const std::function<bool(std::uint64_t)>& begins) {
  constexpr std::uint64_t kBlock = std::uint64_t(1) << 20;
  end = std::min(end, file.size());
  for (; from < end; from += kBlock) {
    const std::string block(file.read_at_most(from, kBlock + head));  // begins() reads into the buffer of the file
    const std::string_view bytes = block;
    for (std::uint64_t i = 0; i < std::min(kBlock, end - from); ++i) {
      if (!may_begin(bytes.substr(static_cast<std::size_t>(i)))) continue;
      try {
        if (begins(from + i)) return from + i;
      } catch (const OutOfBytes&) {  // no record
      }
    }
  }
  return {};
}

void DamagedPlaces::add(std::uint64_t record, std::uint64_t next) {
  content_ = next;
  if (places_++ == 0) {
    first_ = record;
    next_ = next;
  }
  bytes_ += next - record;
}

std::optional<std::uint64_t> DamagedPlaces::resume(std::uint64_t at, std::uint64_t end, const Find& find) {
  const auto inside = find(content_, at, false);
  const auto next = inside ? inside : find(at + 1, end, true);
  if (next) add(inside ? record_ : at, *next);
  return next;
}

std::string DamagedPlaces::sentence() const {
  const std::string first = fmt::format("the record at byte {} is damaged; reading goes on at byte {}", first_, next_);
  return places_ == 1 ? first
                      : fmt::format("{}; {} more places are damaged, {} bytes in total", first, places_ - 1, bytes_);
}

}  // namespace tandem
