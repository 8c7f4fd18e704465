#include <algorithm>
#include <map>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/byte_reader.hpp>
#include <tandem/studies/recording/decompress.hpp>
#include <tandem/studies/recording/file_bytes.hpp>
#include <tandem/studies/recording/message_recording.hpp>
#include <tandem/studies/recording/recording_formats.hpp>

namespace tandem {
namespace {

constexpr std::uint64_t kMagicSize = 8, kRecordHead = 9;  // bytes; opcode and length

enum Opcode : unsigned char { kSchema = 3, kChannel = 4, kMessage = 5, kChunk = 6, kDataEnd = 15 };

/// An MCAP file (https://mcap.dev/spec). Records are read in the order of the file; the index is not needed, so that
/// files without one, for example of an interrupted recording, are read in the same way.
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
    bool ended = false;
    while (!ended && at < bytes_.size()) {
      stop();
      try {
        ByteReader head(bytes_.read(at, kRecordHead));
        const unsigned char opcode = head.u8();
        const std::uint64_t length = head.u64();
        ended = opcode == kDataEnd;
        const bool wanted = opcode == kSchema || opcode == kChannel || opcode == kMessage || opcode == kChunk;
        const auto data = [&](auto read) { record(opcode, (bytes_.*read)(at + kRecordHead, length), at, deliver); };
        // A truncated chunk is used up to the end of the file.
        if (wanted) data(opcode == kChunk ? &FileBytes::read_at_most : &FileBytes::read);
        if (length > bytes_.size() - at) throw OutOfBytes();
        at += kRecordHead + length;
      } catch (const OutOfBytes&) {
        add_defect(
            fmt::format("the file is truncated: the record at byte {} ends after the end of the file ({} bytes); "
                        "all records before are used",
                        at, bytes_.size()));
        return;
      }
    }
    if (!ended)
      add_defect(
          fmt::format("the file has no end record after byte {}: the recording was interrupted or the file was "
                      "cut; all records before are used",
                      at));
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
