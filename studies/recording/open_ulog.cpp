#include <algorithm>
#include <map>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/byte_reader.hpp>
#include <tandem/studies/recording/file_bytes.hpp>
#include <tandem/studies/recording/log_recording.hpp>
#include <tandem/studies/recording/recording_formats.hpp>
#include <tandem/studies/recording/resync.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::uint64_t kFirstMessage = 16;  // after magic, version and start time
constexpr std::uint64_t kUlogHead = 3;       // size and type
constexpr int kMaxNesting = 8;
constexpr std::string_view kTypes = "FADOBIMPQRLCS";
constexpr std::string_view kSync = "\x2F\x73\x13\x20\x25\x0C\xBB\x12";

/// A log of PX4 (https://docs.px4.io/main/en/dev_log/ulog_file_format.html). After damaged bytes, reading goes on where
/// several messages follow each other.
class UlogRecording : public LogRecording {
 public:
  explicit UlogRecording(const std::filesystem::path& file) : bytes_(file) {
    file_ = file;
    format_ = "PX4 log";
    count_rows();
  }

 protected:
  void scan(const std::function<void()>& stop) override {
    std::uint64_t at = kFirstMessage;
    DamagedPlaces damage(at);
    while (at < bytes_.size()) {
      stop();
      try {
        ByteReader head(bytes_.read(at, kUlogHead));
        const std::uint16_t size = head.u16();
        const char type = static_cast<char>(head.u8());
        ByteReader in(bytes_.read(at + kUlogHead, size));
        if (message(type, in)) {
          damage.read(at, at + kUlogHead);
          at += kUlogHead + size;
          continue;
        }
      } catch (const OutOfBytes&) {
      }
      const auto next = damage.resume(at, bytes_.size(), [this](auto from, auto end, bool) { return find(from, end); });
      if (!next) {
        add_defect(fmt::format(
            "the log is truncated or damaged: the message at byte {} is incomplete; all before are used", at));
        break;
      }
      at = *next;
    }
    if (damage.any()) add_defect(damage.sentence());
  }

 private:
  /// Returns the first byte in [from, end) at which several messages follow each other.
  std::optional<std::uint64_t> find(std::uint64_t from, std::uint64_t end) {
    constexpr int kFollowing = 3;
    return find_record(
        bytes_, from, end, kUlogHead,
        [](std::string_view head) { return head.size() > 2 && kTypes.find(head[2]) != std::string_view::npos; },
        [&](std::uint64_t at) {
          for (int i = 0; i < kFollowing && (i == 0 || at < bytes_.size()); ++i) {
            ByteReader head(bytes_.read(at, kUlogHead));
            const std::uint16_t size = head.u16();
            const char type = static_cast<char>(head.u8());
            if (!is_message(type, ByteReader(bytes_.read(at + kUlogHead, size)))) return false;
            at += kUlogHead + size;
          }
          return true;
        });
  }

  /// Returns whether bytes are the content of a message. Throws OutOfBytes if they are too short.
  bool is_message(char type, ByteReader in) const {
    switch (type) {
      case 'D':
        return stream_of_.contains(in.u16());
      case 'A':
        in.skip(3);  // instance and ID
        return formats_.contains(std::string(in.take(in.remaining())));
      case 'O':
      case 'R':
        return in.remaining() == 2;
      case 'S':
        return in.take(8) == kSync && in.empty();
      case 'F':
        return in.take(in.remaining()).find(':') != std::string_view::npos;
      case 'L':
      case 'C': {
        const char level = static_cast<char>(in.u8());
        return level >= '0' && level <= '7';
      }
      case 'B':
        return in.remaining() == 40;
      case 'M':
      case 'Q':
        in.skip(1);
        [[fallthrough]];
      case 'I':
      case 'P': {
        const std::string_view key = in.take(in.u8());
        return std::all_of(key.begin(), key.end(), [](char c) { return c >= ' ' && c <= '~'; }) && key.size() > 2;
      }
      default:
        return false;
    }
  }

  bool message(char type, ByteReader& in) {
    switch (type) {
      case 'F':
        if (lists()) add_format(in.take(in.remaining()));
        return true;
      case 'A':
        subscribe(in);
        return true;
      case 'D':
        if (const auto stream = stream_of_.find(in.u16()); stream != stream_of_.end())
          receive(stream->second, in.take(in.remaining()));
        return true;
      case 'O':
        dropped_ms_ += in.u16();
        if (lists()) report_dropouts();
        return true;
      default:
        return kTypes.find(type) != std::string_view::npos;
    }
  }

  void report_dropouts() {
    std::erase_if(defects_, [](const std::string& d) { return d.starts_with("the logger dropped"); });
    add_defect(fmt::format("the logger dropped messages for {:.3f} s in total", 1e-3 * dropped_ms_));
  }

  void add_format(std::string_view text) {
    const std::size_t colon = text.find(':');
    if (colon != std::string_view::npos) formats_[std::string(text.substr(0, colon))] = text.substr(colon + 1);
  }

  void subscribe(ByteReader& in) {
    const unsigned char instance = in.u8();
    const std::uint16_t id = in.u16();
    const std::string name(in.take(in.remaining()));
    if (!lists() || stream_of_.contains(id)) return;
    try {
      stream_of_[id] = add_stream(instance == 0 ? name : fmt::format("{}.{}", name, instance), "PX4/" + name,
                                  type(name, 0), "timestamp");
    } catch (const OutOfBytes&) {
      throw;
    } catch (const Error& error) {
      add_defect(fmt::format("{}: {}; its messages are skipped", name, error.what()));
    }
  }

  std::shared_ptr<const MessageType> type(const std::string& name, int depth) {
    const auto format = formats_.find(name);
    if (format == formats_.end() || depth > kMaxNesting) throw Error(fmt::format("the format of {} is missing", name));
    auto result = std::make_shared<MessageType>(MessageType{name, {}});
    for (const std::string_view field : split(format->second, ';'))
      if (!field.empty()) result->members.push_back(member(field, depth));
    return result;
  }

  MessageMember member(std::string_view field, int depth) {
    constexpr std::pair<std::string_view, Primitive> primitives[] = {
        {"int8_t", Primitive::int8},     {"uint8_t", Primitive::uint8},   {"int16_t", Primitive::int16},
        {"uint16_t", Primitive::uint16}, {"int32_t", Primitive::int32},   {"uint32_t", Primitive::uint32},
        {"int64_t", Primitive::int64},   {"uint64_t", Primitive::uint64}, {"float", Primitive::float32},
        {"double", Primitive::float64},  {"bool", Primitive::boolean},    {"char", Primitive::chars}};
    const std::size_t blank = field.find(' ');
    if (blank == std::string_view::npos) throw Error(fmt::format("the field {} is malformed", quote(field)));
    MessageMember member{std::string(field.substr(blank + 1))};
    std::string_view type = field.substr(0, blank);
    if (const std::size_t open = type.find('['); open != std::string_view::npos) {
      const auto length = parse_positive_integer(type.substr(open + 1, type.size() - open - 2));
      if (!length) throw Error(fmt::format("the field {} is malformed", quote(field)));
      member.array = MessageMember::Array::fixed;
      member.length = static_cast<std::size_t>(*length);
      type = type.substr(0, open);
    }
    for (const auto& [known, primitive] : primitives)
      if (type == known) member.type = primitive;
    if (member.type == Primitive::message) member.message = this->type(std::string(type), depth + 1);
    if (member.type == Primitive::chars) {
      if (member.array == MessageMember::Array::none) member.length = 1;
      member.array = MessageMember::Array::none;  // a text
    }
    if (member.name == "timestamp" || member.name == "timestamp_sample") {  // microseconds since the start
      member.factor = 1e-6;
      member.unit = "s";
    }
    return member;
  }

  FileBytes bytes_;
  std::map<std::string, std::string> formats_;
  std::map<std::uint16_t, std::size_t> stream_of_;
  double dropped_ms_ = 0;
};

}  // namespace

std::unique_ptr<Recording> open_ulog(const std::filesystem::path& file) {
  return std::make_unique<UlogRecording>(file);
}

}  // namespace tandem
