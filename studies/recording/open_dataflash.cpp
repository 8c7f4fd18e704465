#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/byte_reader.hpp>
#include <tandem/studies/recording/file_bytes.hpp>
#include <tandem/studies/recording/log_recording.hpp>
#include <tandem/studies/recording/recorded_units.hpp>
#include <tandem/studies/recording/recording_formats.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kBuffer = std::size_t(1) << 20;  // bytes read at a time; a message has 255 at most
constexpr std::size_t kHead = 3;                       // 0xA3 0x95 TYPE
constexpr unsigned char kFormatType = 128;             // FMT
constexpr std::size_t kFormatSize = 89;

/// Returns a member for a format character, or nothing if the character is unknown.
std::optional<MessageMember> member_of(char format, const std::string& name) {
  const auto fixed_text = [&](std::size_t n) { return MessageMember{name, Primitive::chars, {}, {}, n}; };
  const auto scaled = [&](Primitive type, double factor, const char* unit = "") {
    return MessageMember{name, type, {}, {}, 0, factor, unit};
  };
  switch (format) {
    case 'a': {  // 32 numbers
      MessageMember member{name, Primitive::int16};
      member.array = MessageMember::Array::fixed;
      member.length = 32;
      return member;
    }
    case 'b':
      return scaled(Primitive::int8, 1);
    case 'B':
    case 'M':
      return scaled(Primitive::uint8, 1);
    case 'h':
      return scaled(Primitive::int16, 1);
    case 'H':
      return scaled(Primitive::uint16, 1);
    case 'i':
      return scaled(Primitive::int32, 1);
    case 'I':
      return scaled(Primitive::uint32, 1);
    case 'f':
      return scaled(Primitive::float32, 1);
    case 'd':
      return scaled(Primitive::float64, 1);
    case 'n':
      return fixed_text(4);
    case 'N':
      return fixed_text(16);
    case 'Z':
      return fixed_text(64);
    case 'c':
      return scaled(Primitive::int16, 0.01);
    case 'C':
      return scaled(Primitive::uint16, 0.01);
    case 'e':
      return scaled(Primitive::int32, 0.01);
    case 'E':
      return scaled(Primitive::uint32, 0.01);
    case 'L':
      return scaled(Primitive::int32, 1e-7, "deg");
    case 'q':
      return scaled(Primitive::int64, 1);
    case 'Q':
      return scaled(Primitive::uint64, 1);
    default:
      return {};
  }
}

std::string text_of(std::string_view bytes) { return std::string(bytes.substr(0, bytes.find('\0'))); }

/// Returns a unit of a log in the spelling of recorded_units.hpp; empty if it is none of those.
std::string unit_text(const std::string& unit) {
  if (unit == "deglatitude" || unit == "deglongitude" || unit == "degheading") return "deg";
  const auto known = find_unit(unit);
  return known ? std::string(known->name) : "";
}

/// A log of ArduPilot ("dataflash"), which describes its messages by FMT, FMTU, UNIT and MULT.
class DataflashRecording : public LogRecording {
 public:
  explicit DataflashRecording(const std::filesystem::path& file) : bytes_(file) {
    file_ = file;
    format_ = "ArduPilot log";
    read_descriptions();
    count_rows();
    std::erase_if(described_, [&](const auto& entry) {
      return streams_[entry.second.stream].rows == 0 && entry.second.of_instances.empty();
    });
  }

 protected:
  void scan(const std::function<void()>& stop) override {
    each_message(stop, [&](unsigned char type, std::string_view body) {
      if (const auto described = described_.find(type); described != described_.end())
        receive(stream_of(described->second, body), body);
    });
  }

 private:
  struct Format {
    std::string name, format;
    std::vector<std::string> columns;
    std::string units, multipliers;
    std::size_t size = 0;
  };
  struct Described {
    std::size_t stream = 0;
    std::shared_ptr<const MessageType> type{};
    std::string time_field{};
    std::unique_ptr<MessageDecoder> instance{};           ///< of the member I; null if there is none
    std::map<unsigned char, std::size_t> of_instances{};  ///< streams of the instances after the first
  };

  /// Returns the stream of a message: "GPS" for the first receiver (I = 0), "GPS.1" for the next one.
  std::size_t stream_of(Described& described, std::string_view body) {
    if (!described.instance) return described.stream;
    double number = 0;
    try {
      number = described.instance->decode(body)[0].number;
    } catch (const OutOfBytes&) {  // receive() counts it
    }
    if (!(number > 0)) return described.stream;
    const auto [at, added] = described.of_instances.try_emplace(static_cast<unsigned char>(number));
    if (added) {
      const std::string name = fmt::format("{}.{}", described.type->name, number);
      at->second = add_stream(name, "ArduPilot/" + described.type->name, described.type, described.time_field);
    }
    return at->second;
  }

  /// Calls f(type, body) for each message. Resynchronises after damaged bytes and counts them.
  template <class F>
  void each_message(const std::function<void()>& stop, F f) {
    std::uint64_t at = 0, damaged_from = 0, damaged = 0;
    std::string_view buffer;
    std::uint64_t buffer_at = 0;
    sizes_[kFormatType] = kFormatSize;
    while (at + kHead <= bytes_.size()) {
      if (at < buffer_at || at + 256 > buffer_at + buffer.size()) {
        if (buffer_at + buffer.size() < bytes_.size() || buffer.empty()) {
          stop();
          buffer_at = at;
          buffer = bytes_.read(at, std::min<std::uint64_t>(kBuffer, bytes_.size() - at));
        }
      }
      const std::string_view here = buffer.substr(static_cast<std::size_t>(at - buffer_at));
      const auto type = static_cast<unsigned char>(here[2]);
      const std::size_t size = here[0] == '\xA3' && here[1] == '\x95' ? sizes_[type] : 0;
      if (size < kHead || size > here.size()) {
        if (size > here.size()) {
          add_defect(
              fmt::format("the log is truncated: the message at byte {} is incomplete; all before are used", at));
          break;
        }
        if (damaged++ == 0) damaged_from = at;
        ++at;
        continue;
      }
      f(type, here.substr(kHead, size - kHead));
      at += size;
    }
    if (damaged > 0)
      add_defect(fmt::format("{} damaged bytes are skipped, the first at byte {}", damaged, damaged_from));
  }

  void read_descriptions() {
    std::map<unsigned char, Format> formats;
    std::map<char, std::string> units;
    std::map<char, double> multipliers;
    each_message([] {},
                 [&](unsigned char type, std::string_view body) {
                   ByteReader in(body);
                   if (type == kFormatType) {
                     const unsigned char id = in.u8();
                     Format format;
                     format.size = in.u8();
                     format.name = text_of(in.take(4));
                     format.format = text_of(in.take(16));
                     const std::string columns = text_of(in.take(64));
                     for (const std::string_view column : split(columns, ',')) format.columns.emplace_back(column);
                     sizes_[id] = format.size;
                     formats[id] = std::move(format);
                     return;
                   }
                   const auto known = formats.find(type);
                   if (known == formats.end()) return;
                   const std::string& name = known->second.name;
                   if (name != "FMTU" && name != "UNIT" && name != "MULT") return;
                   in.skip(8);  // TimeUS
                   const unsigned char id = in.u8();
                   if (name == "UNIT") units[static_cast<char>(id)] = text_of(in.take(in.remaining()));
                   if (name == "MULT") multipliers[static_cast<char>(id)] = in.number<double>();
                   if (name == "FMTU") {
                     formats[id].units = text_of(in.take(16));
                     formats[id].multipliers = text_of(in.take(16));
                   }
                 });
    for (const auto& [id, format] : formats) describe(id, format, units, multipliers);
  }

  void describe(unsigned char id, const Format& format, const std::map<char, std::string>& units,
                const std::map<char, double>& multipliers) {
    auto type = std::make_shared<MessageType>(MessageType{format.name, {}});
    std::string time_field;
    for (std::size_t i = 0; i < format.format.size(); ++i) {
      const std::string name = i < format.columns.size() ? format.columns[i] : fmt::format("{}", i + 1);
      auto member = member_of(format.format[i], name);
      if (!member) {
        add_defect(fmt::format("{}: unknown format character {} of {}; the messages are skipped", format.name,
                               quote(format.format.substr(i, 1)), name));
        return;
      }
      const bool is_scaled = std::string_view("cCeEL").find(format.format[i]) != std::string_view::npos;
      if (i < format.multipliers.size() && !is_scaled)
        if (const auto known = multipliers.find(format.multipliers[i]); known != multipliers.end() && known->second > 0)
          member->factor *= known->second;
      if (i < format.units.size())
        if (const auto known = units.find(format.units[i]); known != units.end())
          if (const std::string unit = unit_text(known->second); !unit.empty()) member->unit = unit;
      if (name == "TimeUS" || name == "TimeMS") {  // older logs state no units
        if (member->unit.empty()) member->factor = name == "TimeUS" ? 1e-6 : 1e-3;
        member->unit = "s";
        if (time_field.empty()) time_field = name;
      }
      if (name == "T" && time_field == "TimeMS") {  // GPS of logs up to 2014: TimeMS is the time of the GPS week
        member->factor = 1e-3;
        member->unit = "s";
        time_field = name;
      }
      type->members.push_back(std::move(*member));
    }
    Described& described = described_[id];
    described.stream = add_stream(format.name, "ArduPilot/" + format.name, type, time_field);
    described.type = type;
    described.time_field = time_field;
    const auto instance = std::find_if(type->members.begin(), type->members.end(), [](const MessageMember& m) {
      return m.name == "I" && m.type == Primitive::uint8;
    });
    if (instance != type->members.end())
      described.instance = std::make_unique<MessageDecoder>(type, MessageEncoding::packed, std::vector{instance->name});
  }

  FileBytes bytes_;
  std::array<std::size_t, 256> sizes_{};
  std::map<unsigned char, Described> described_;
};

}  // namespace

std::unique_ptr<Recording> open_dataflash(const std::filesystem::path& file) {
  return std::make_unique<DataflashRecording>(file);
}

}  // namespace tandem
