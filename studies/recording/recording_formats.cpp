#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <tandem/studies/recording/recording_formats.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

using namespace std::string_view_literals;

constexpr std::array kFormats = {
    RecordingFormat{"\x89MCAP0\r\n"sv, "MCAP", open_mcap},
    RecordingFormat{"#ROSBAG V2.0\n"sv, "ROS 1 bag", open_rosbag1},
    RecordingFormat{"SQLite format 3\0"sv, "ROS 2 bag (SQLite)", open_rosbag2},
    RecordingFormat{"\xA3\x95"sv, "ArduPilot log", open_dataflash},
    RecordingFormat{"ULog\x01\x12\x35"sv, "PX4 log", open_ulog},
};

struct CompressedFormat {
  std::string_view magic, name, command;
};
constexpr std::array kCompressed = {CompressedFormat{"\x28\xB5\x2F\xFD"sv, "zstd", "unzstd"},
                                    CompressedFormat{"\x1F\x8B"sv, "gzip", "gunzip"},
                                    CompressedFormat{"BZh"sv, "bzip2", "bunzip2"},
                                    CompressedFormat{"\xFD"
                                                     "7zXZ\0"sv,
                                                     "xz", "unxz"}};

constexpr std::array kExtensions = {".mcap"sv, ".bag"sv, ".db3"sv, ".bin"sv, ".ulg"sv,  ".nmea"sv,  ".csv"sv,
                                    ".tsv"sv,  ".txt"sv, ".log"sv, ".dat"sv, ".json"sv, ".jsonl"sv, ".ndjson"sv};

}  // namespace

std::span<const RecordingFormat> recording_formats() { return kFormats; }

std::string why_compressed(std::string_view head) {
  for (const CompressedFormat& format : kCompressed)
    if (head.starts_with(format.magic))
      return fmt::format("the file is compressed with {}; decompress it ({} FILE) and import the result", format.name,
                         format.command);
  return "";
}

std::string why_unreadable(std::string_view head) {
  constexpr std::size_t kLeast = 4;
  for (const RecordingFormat& format : kFormats)
    if (head.size() >= kLeast && format.magic.starts_with(head))
      return fmt::format("the file is cut after {} bytes (format: {})", head.size(), format.name);
  constexpr std::string_view kBag = "#ROSBAG V", kMcap = "\x89MCAP";
  if (head.starts_with(kBag)) {
    const std::string_view version = head.substr(kBag.size(), head.find('\n') - kBag.size());
    return fmt::format("a ROS 1 bag of version {} is not supported; readable are those of version 2.0", version);
  }
  if (head.starts_with(kMcap)) return "this version of MCAP is not supported; readable is version 0";
  return "";
}

bool is_recording_name(const std::filesystem::path& file) {
  const std::string extension = lower_case(file.extension().string());
  return std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

std::string readable_formats() {
  return "ROS 2 bags (.db3, .mcap), ROS 1 bags (.bag), ArduPilot logs (.bin), PX4 logs (.ulg), NMEA, JSON lines, and "
         "tables (.csv, .tsv, .txt)";
}

}  // namespace tandem
