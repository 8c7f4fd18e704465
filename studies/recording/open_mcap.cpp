#include <algorithm>
#include <map>

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

constexpr std::uint64_t kMagicSize = 8, kRecordHead = 9;  // bytes; opcode and length
constexpr std::uint64_t kMessageHead = 22;                // channel, sequence number and two times

enum Opcode : unsigned char {
  kFooter = 2,
  kSchema = 3,
  kChannel = 4,
  kMessage = 5,
  kChunk = 6,
  kMessageIndex = 7,
  kDataEnd = 15,
  kFirstPrivate = 128,
};

/// An MCAP file (https://mcap.dev/spec). Records are read in the order of the file; the index is not needed, so that
/// files without one, for example of an interrupted recording, are read in the same way. After a damaged record,
/// reading goes on at the next bytes that are a record; these may be the messages in a chunk that is not compressed.
class McapRecording : public MessageRecording {
 public:
  explicit McapRecording(const std::filesystem::path& file) : bytes_(file) {
    file_ = file;
    format_ = "MCAP";
    scan([] {}, false);
  }

 protected:
  void read_messages(const std::function<void()>& stop) override { scan(stop, true); }

 private:
  struct Schema {
    std::string name, definition;
  };

  /// Goes through all records. Without `deliver`, only lists and counts; chunks are decompressed in both cases, since
  /// they contain the schemas and channels.
  void scan(const std::function<void()>& stop, bool deliver) {
    std::uint64_t at = kMagicSize;
    DamagedPlaces damage(at);
    bool ended = false;
    while (!ended && at < bytes_.size()) {
      stop();
      try {
        at = file_record(at, deliver, ended, damage);
      } catch (const OutOfBytes&) {
        const auto next = damage.resume(at, bytes_.size(), [this](auto... place) { return find(place...); });
        if (!next) {
          add_truncation(at);
          break;
        }
        at = *next;
      }
    }
    if (damage.any()) add_defect(damage.sentence());
    if (!ended && at >= bytes_.size())
      add_defect(
          fmt::format("the file has no end record after byte {}: the recording was interrupted or the file was "
                      "cut; all records before are used",
                      at));
  }

  void add_truncation(std::uint64_t at) {
    add_defect(
        fmt::format("the file is truncated: the record at byte {} ends after the end of the file ({} bytes); "
                    "all records before are used",
                    at, bytes_.size()));
  }

  /// Handles the record of the file at a byte and returns the byte after it.
  std::uint64_t file_record(std::uint64_t at, bool deliver, bool& ended, DamagedPlaces& damage) {
    ByteReader head(bytes_.read(at, kRecordHead));
    const unsigned char opcode = head.u8();
    const std::uint64_t length = head.u64(), content = at + kRecordHead;
    if (opcode == 0 || (opcode > kDataEnd && opcode < kFirstPrivate)) throw OutOfBytes();
    if (length > bytes_.size() - content) {
      if (opcode != kChunk) throw OutOfBytes();
      // The length is damaged, or the chunk is truncated. It is used up to the next record, or to the end of the file.
      const auto next = find(content, bytes_.size(), false);
      const std::uint64_t end = next.value_or(bytes_.size());
      record(opcode, bytes_.read(content, end - content), at, deliver);
      ended = !next;
      if (next)
        damage.add(at, end);
      else
        add_truncation(at);
      return end;
    }
    damage.read(at, content);
    ended = opcode == kDataEnd || opcode == kFooter;
    if (opcode == kSchema || opcode == kChannel || opcode == kMessage || opcode == kChunk)
      record(opcode, bytes_.read(content, length), at, deliver);
    return content + length;
  }

  /// Returns the first record in [from, end). `any`: also one of those that are in chunks.
  std::optional<std::uint64_t> find(std::uint64_t from, std::uint64_t end, bool any) {
    return find_record(
        bytes_, from, end, kRecordHead,
        [&](std::string_view head) {
          const auto opcode = static_cast<unsigned char>(head[0]);
          return opcode == kDataEnd || opcode == kChunk || opcode == kMessageIndex ||
                 (any && opcode >= kSchema && opcode <= kMessage);
        },
        [&](std::uint64_t at) {
          constexpr std::uint64_t kMost = std::uint64_t(1) << 20;  // bytes that are enough to check a content
          ByteReader head(bytes_.read(at, kRecordHead));
          const unsigned char opcode = head.u8();
          const std::uint64_t length = head.u64(), content = at + kRecordHead;
          if (opcode != kChunk && length > bytes_.size() - content) return false;
          return has_content(opcode, length, ByteReader(bytes_.read_at_most(content, std::min(length, kMost))));
        });
  }

  /// Returns whether bytes are the content of a record. Throws OutOfBytes if they are not.
  bool has_content(unsigned char opcode, std::uint64_t length, ByteReader in) const {
    switch (opcode) {
      case kDataEnd:
        return length == 4;
      case kMessageIndex:
        in.skip(2);  // channel
        return length == 6 + std::uint64_t(in.u32()) && (length - 6) % 16 == 0;
      case kSchema:
        if (in.u16() == 0 || in.text32().empty()) return false;
        in.text32();  // encoding
        in.text32();  // definition
        return in.empty();
      case kChannel:
        in.skip(4);  // channel and schema
        if (in.text32().empty() || in.text32().empty()) return false;
        in.text32();  // metadata
        return in.empty();
      case kMessage:
        return length >= kMessageHead && channels_.contains(in.u16());
      case kChunk: {
        const std::uint64_t first = in.u64(), last = in.u64();
        in.skip(12);  // size and checksum
        in.text32();  // compression
        const std::uint64_t stored = in.u64();
        return first <= last && length == in.position() + stored;
      }
      default:
        return false;
    }
  }

  void record(unsigned char opcode, std::string_view data, std::uint64_t at, bool deliver) {
    try {
      ByteReader in(data);
      switch (opcode) {
        case kSchema:
          schema(in);
          break;
        case kChannel:
          channel(in);
          break;
        case kMessage:
          message(in, deliver);
          break;
        case kChunk:
          chunk(in, at, deliver);
          break;
      }
    } catch (const OutOfBytes&) {
      add_defect(
          fmt::format("the record at byte {} is corrupted: its content is longer than its length; it is skipped", at));
    }
  }

  void schema(ByteReader& in) {
    const std::uint16_t id = in.u16();
    const std::string name(in.text32()), encoding(in.text32()), definition(in.text32());
    schemas_[id] = {name, encoding == "ros2idl" ? "" : definition};
  }

  void channel(ByteReader& in) {
    const std::uint16_t id = in.u16();
    if (channels_.contains(id)) return;
    const Schema schema = schemas_[in.u16()];
    const std::string topic(in.text32()), encoding(in.text32());
    std::size_t index = topic_index(topic, schema.name);
    if (index == topics()) add_topic(topic, schema.name, encoding, schema.definition);
    channels_[id] = index;
  }

  void message(ByteReader& in, bool deliver) {
    const auto channel = channels_.find(in.u16());
    if (channel == channels_.end()) return;
    in.skip(4);  // sequence number
    const double received = 1e-9 * static_cast<double>(in.u64());
    in.skip(8);  // publish time
    if (!deliver)
      count(channel->second, received);
    else if (is_wanted(channel->second))
      receive(channel->second, received, in.take(in.remaining()));
  }

  void chunk(ByteReader& in, std::uint64_t at, bool deliver) {
    in.skip(16);  // first and last time
    const std::uint64_t size = in.u64();
    in.skip(4);  // checksum
    const std::string compression(in.text32());
    const std::uint64_t stored = in.u64();
    const std::string_view data = in.take(std::min<std::uint64_t>(stored, in.remaining()));
    if (const std::string why = decompress(compression, data, static_cast<std::size_t>(size), chunk_); !why.empty())
      add_defect(fmt::format("the chunk at byte {} is {}: {}", at, chunk_.empty() ? "skipped" : "used in part", why));
    ByteReader records(chunk_);
    while (!records.empty()) {
      const unsigned char opcode = records.u8();
      const std::string_view content = records.take(records.u64());
      if (opcode != kChunk) record(opcode, content, at, deliver);
    }
  }

  FileBytes bytes_;
  std::string chunk_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, std::size_t> channels_;  ///< index of the topic
};

}  // namespace

std::unique_ptr<Recording> open_mcap(const std::filesystem::path& file) {
  return std::make_unique<McapRecording>(file);
}

}  // namespace tandem
