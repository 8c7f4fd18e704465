#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include <tandem/studies/recording/recording.hpp>

namespace tandem {

/// A binary format, recognised by the first bytes of a file.
struct RecordingFormat {
  std::string_view magic, name;
  std::unique_ptr<Recording> (*open)(const std::filesystem::path& file);
};

/// Returns all binary formats.
std::span<const RecordingFormat> recording_formats();
/// Returns one sentence if a file with these first bytes is compressed as a whole; otherwise nothing.
std::string why_compressed(std::string_view head);
/// Returns one sentence if a file with these first bytes is a binary recording that cannot be read: one of another
/// version, or one that is cut after its first bytes; otherwise nothing.
std::string why_unreadable(std::string_view head);
/// Returns whether a file of a folder may be a recording, by its extension.
bool is_recording_name(const std::filesystem::path& file);
/// Returns "ROS 2 bags (.db3, .mcap), …" for messages.
std::string readable_formats();

/// Functions that open a recording of each format. open_NAME() is in open_NAME.cpp. They throw Error if the file cannot
/// be read at all.
std::unique_ptr<Recording> open_mcap(const std::filesystem::path& file);
std::unique_ptr<Recording> open_rosbag1(const std::filesystem::path& file);
std::unique_ptr<Recording> open_rosbag2(const std::filesystem::path& file);
std::unique_ptr<Recording> open_dataflash(const std::filesystem::path& file);
std::unique_ptr<Recording> open_ulog(const std::filesystem::path& file);
std::unique_ptr<Recording> open_nmea(const std::filesystem::path& file);
std::unique_ptr<Recording> open_json_lines(const std::filesystem::path& file);
std::unique_ptr<Recording> open_table(const std::filesystem::path& file, const TableSettings& settings);

}  // namespace tandem
