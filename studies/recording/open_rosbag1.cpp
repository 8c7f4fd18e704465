#include <map>
#include <set>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/byte_reader.hpp>
#include <tandem/studies/recording/decompress.hpp>
#include <tandem/studies/recording/file_bytes.hpp>
#include <tandem/studies/recording/message_recording.hpp>
#include <tandem/studies/recording/recording_formats.hpp>
#include <tandem/studies/recording/resync.hpp>

namespace tandem {
namespace {

constexpr std::uint64_t kFirstRecord = 13;  // after "#ROSBAG V2.0\n"

enum Operation : unsigned char {
  kMessageData = 2,
  kBagHeader = 3,
  kIndexData = 4,
  kBagChunk = 5,
  kChunkInfo = 6,
  kConnection = 7,
};

/// The fields of a record's header: NAME=VALUE, each after its length.
class RecordHeader {
 public:
  explicit RecordHeader(std::string_view bytes) {
    ByteReader in(bytes);
    while (!in.empty()) {
      const std::string_view field = in.text32();
      const std::size_t equals = field.find('=');
      if (equals == std::string_view::npos) throw OutOfBytes();
      fields_[field.substr(0, equals)] = field.substr(equals + 1);
    }
  }
  std::string_view text(std::string_view name) const {
    const auto field = fields_.find(name);
    return field == fields_.end() ? std::string_view() : field->second;
  }
  template <class T>
  T number(std::string_view name) const {
    return ByteReader(text(name)).number<T>();
  }
  unsigned char operation() const { return number<std::uint8_t>("op"); }
  double time(std::string_view name) const {
    ByteReader in(text(name));
    const double seconds = in.u32();
    return seconds + 1e-9 * in.u32();
  }

 private:
  std::map<std::string_view, std::string_view> fields_;
};

/// A ROS 1 bag of version 2.0 (https://wiki.ros.org/Bags/Format/2.0). Its index gives topics and counts. If there is no
/// index, as in an interrupted recording, or if the file is damaged, the chunks give them. After a damaged record,
/// reading goes on at the next bytes that are a record; these may be the messages in a chunk that is not compressed.
class Rosbag1Recording : public MessageRecording {
 public:
  explicit Rosbag1Recording(const std::filesystem::path& file) : bytes_(file) {
    file_ = file;
    format_ = "ROS 1 bag";
    scan([] {}, Pass::list);
    if (!damaged_ || !indexed_) return;
    reset_counts();
    early_counts_.clear();
    chunk_connections_.clear();
    ignores_index_ = true;
    scan([] {}, Pass::list);
  }

 protected:
  void read_messages(const std::function<void()>& stop) override { scan(stop, Pass::deliver); }

 private:
  enum class Pass { list, deliver };

  void scan(const std::function<void()>& stop, Pass pass) {
    pass_ = pass;
    std::uint64_t at = kFirstRecord;
    DamagedPlaces damage(at);
    while (at < bytes_.size()) {
      stop();
      try {
        at = file_record(at, damage);
      } catch (const OutOfBytes&) {
        const auto next = damage.resume(at, bytes_.size(), [this](auto... place) { return find(place...); });
        if (!next) {
          add_truncation(at);
          break;
        }
        at = *next;
      }
    }
    damaged_ |= damage.any();
    if (damage.any()) add_defect(damage.sentence());
  }

  void add_truncation(std::uint64_t at) {
    add_defect(
        fmt::format("the file is truncated or corrupted: the record at byte {} does not fit into the file ({} "
                    "bytes); all records before are used",
                    at, bytes_.size()));
  }

  /// Returns the first record in [from, end). `any`: also one of those that are in chunks.
  std::optional<std::uint64_t> find(std::uint64_t from, std::uint64_t end, bool any) {
    constexpr std::uint32_t kMostHeader = 1 << 16;
    return find_record(
        bytes_, from, end, 8,
        [](std::string_view head) {
          if (head.size() < 8) return false;
          ByteReader in(head);
          const std::uint32_t size = in.u32(), field = in.u32();
          return size <= kMostHeader && field > 2 && field + 4 <= size;
        },
        [&](std::uint64_t at) {
          const std::uint32_t size = ByteReader(bytes_.read(at, 4)).u32();
          const std::string text(bytes_.read(at + 4, size));
          const RecordHeader header(text);
          const std::uint32_t content = ByteReader(bytes_.read(at + 4 + size, 4)).u32();
          const unsigned char operation = header.operation();
          const bool in_chunk = operation == kMessageData || operation == kConnection;
          const bool known = operation == kIndexData || operation == kBagChunk || operation == kChunkInfo;
          return (known || (any && in_chunk)) && (operation == kBagChunk || content <= bytes_.size() - at - 8 - size);
        });
  }

  /// Handles the record of the file at a byte and returns the byte after it.
  std::uint64_t file_record(std::uint64_t at, DamagedPlaces& damage) {
    const std::uint32_t header_size = ByteReader(bytes_.read(at, 4)).u32();
    const std::string header_bytes(bytes_.read(at + 4, header_size));
    const RecordHeader header(header_bytes);
    const std::uint32_t size = ByteReader(bytes_.read(at + 4 + header_size, 4)).u32();
    const std::uint64_t data_at = at + 8 + header_size;
    if (size > bytes_.size() - data_at) {
      if (header.operation() != kBagChunk) throw OutOfBytes();
      // The length is damaged, or the chunk is truncated. It is used up to the next record, or to the end of the file.
      const auto next = find(data_at, bytes_.size(), false);
      const std::uint64_t end = next.value_or(bytes_.size());
      if (!skips_chunk(at)) chunk(header, bytes_.read_at_most(data_at, end - data_at), at);
      if (next)
        damage.add(at, end);
      else
        add_truncation(at);
      return end;
    }
    damage.read(at, data_at);
    switch (header.operation()) {
      case kBagHeader: {
        const auto index = header.number<std::uint64_t>("index_pos");
        indexed_ = index > 0 && index < bytes_.size() && !ignores_index_;
        break;
      }
      case kBagChunk:
        if (!skips_chunk(at)) chunk(header, bytes_.read(data_at, size), at);
        break;
      case kIndexData:
        if (pass_ == Pass::list && indexed_) index_data(header, bytes_.read(data_at, size));
        break;
      case kChunkInfo:
        if (pass_ == Pass::list && indexed_) chunk_info(header, bytes_.read(data_at, size));
        break;
      case kConnection:
        connection(header, bytes_.read(data_at, size));
        break;
      case kMessageData:
        message(header, bytes_.read(data_at, size));
        break;
    }
    return data_at + size;
  }

  bool skips_chunk(std::uint64_t at) const {
    if (pass_ == Pass::list) return indexed_;
    const auto info = chunk_connections_.find(at);
    if (info == chunk_connections_.end()) return false;
    for (const std::uint32_t connection : info->second)
      if (const auto topic = topic_of_.find(connection); topic == topic_of_.end() || is_wanted(topic->second))
        return false;
    return true;
  }

  void chunk(const RecordHeader& header, std::string_view data, std::uint64_t at) {
    const std::string why = decompress(header.text("compression"), data, header.number<std::uint32_t>("size"), chunk_);
    if (!why.empty())
      add_defect(fmt::format("the chunk at byte {} is {}: {}", at, chunk_.empty() ? "skipped" : "used in part", why));
    ByteReader in(chunk_);
    try {
      while (!in.empty()) {
        const RecordHeader record(in.text32());
        const std::string_view content = in.text32();
        if (record.operation() == kConnection) connection(record, content);
        if (record.operation() == kMessageData) message(record, content);
      }
    } catch (const OutOfBytes&) {
      add_defect(
          fmt::format("the chunk at byte {} is corrupted after {} of its {} bytes; its other messages are skipped", at,
                      in.position(), chunk_.size()));
    }
  }

  void connection(const RecordHeader& header, std::string_view data) {
    const auto id = header.number<std::uint32_t>("conn");
    if (topic_of_.contains(id)) return;
    const RecordHeader details(data);
    const std::string topic(header.text("topic")), type(details.text("type"));
    std::size_t index = topic_index(topic, type);
    if (index == topics()) add_topic(topic, type, "ros1", std::string(details.text("message_definition")));
    topic_of_[id] = index;
    for (const double t : early_counts_[id]) count(index, t);  // its index was read before the connection
    early_counts_.erase(id);
  }

  void index_data(const RecordHeader& header, std::string_view data) {
    const auto id = header.number<std::uint32_t>("conn");
    const auto n = header.number<std::uint32_t>("count");
    ByteReader in(data);
    for (std::uint32_t i = 0; i < n; ++i) {
      const double seconds = in.u32(), t = seconds + 1e-9 * in.u32();
      in.skip(4);  // offset
      if (const auto topic = topic_of_.find(id); topic != topic_of_.end())
        count(topic->second, t);
      else
        early_counts_[id].push_back(t);
    }
  }

  void chunk_info(const RecordHeader& header, std::string_view data) {
    ByteReader in(data);
    auto& connections = chunk_connections_[header.number<std::uint64_t>("chunk_pos")];
    for (auto n = header.number<std::uint32_t>("count"); n > 0; --n) {
      connections.insert(in.u32());
      in.skip(4);  // number of messages
    }
  }

  void message(const RecordHeader& header, std::string_view data) {
    const auto topic = topic_of_.find(header.number<std::uint32_t>("conn"));
    if (topic == topic_of_.end()) return;
    if (pass_ == Pass::list)
      count(topic->second, header.time("time"));
    else if (is_wanted(topic->second))
      receive(topic->second, header.time("time"), data);
  }

  FileBytes bytes_;
  std::string chunk_;
  Pass pass_ = Pass::list;
  bool indexed_ = false, ignores_index_ = false, damaged_ = false;
  std::map<std::uint32_t, std::size_t> topic_of_;  ///< key: ID of the connection
  std::map<std::uint32_t, std::vector<double>> early_counts_;
  std::map<std::uint64_t, std::set<std::uint32_t>> chunk_connections_;  ///< key: position of the chunk [bytes]
};

}  // namespace

std::unique_ptr<Recording> open_rosbag1(const std::filesystem::path& file) {
  return std::make_unique<Rosbag1Recording>(file);
}

}  // namespace tandem
