#include <cstring>
#include <limits>

#include <tandem/lie/error.hpp>
#include <tandem/studies/study/trial_message.hpp>

namespace tandem {
namespace {

void append_bytes(std::string& bytes, const void* from, std::size_t size) {
  bytes.append(static_cast<const char*>(from), size);
}

/// Reads values from the front of a byte string.
class ByteReader {
 public:
  explicit ByteReader(const std::string& bytes) : bytes_(bytes) {}
  template <class T>
  T take() {
    T value;
    std::memcpy(&value, part(sizeof(T)), sizeof(T));
    return value;
  }
  std::string take_text() {
    const auto size = take<std::size_t>();
    return {part(size), size};
  }
  bool at_end() const { return at_ == bytes_.size(); }

 private:
  const char* part(std::size_t size) {
    if (size > bytes_.size() - at_) throw Error("a trial message is truncated: all ranks must run the same program");
    at_ += size;
    return bytes_.data() + at_ - size;
  }
  const std::string& bytes_;
  std::size_t at_ = 0;
};

}  // namespace

std::string serialized(const TrialResult& result) {
  std::string bytes;
  append_bytes(bytes, &result.trial, sizeof result.trial);
  for (const std::string* text : {&result.status, &result.message}) {
    const std::size_t size = text->size();
    append_bytes(bytes, &size, sizeof size);
    bytes += *text;
  }
  for (const auto& metric : result.metrics) {
    const double value = metric.value_or(std::numeric_limits<double>::quiet_NaN());  // metrics are finite
    append_bytes(bytes, &value, sizeof value);
  }
  return bytes;
}

TrialResult deserialized(const std::string& bytes) {
  ByteReader reader(bytes);
  TrialResult result;
  result.trial = reader.take<std::size_t>();
  result.status = reader.take_text();
  result.message = reader.take_text();
  for (auto& metric : result.metrics)
    if (const double value = reader.take<double>(); value == value) metric = value;
  if (!reader.at_end()) throw Error("a trial message is too long: all ranks must run the same program");
  return result;
}

}  // namespace tandem
