#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace tandem::faults {

/// A scenario folder as text, cut short.
struct Folder {
  std::string yaml;
  std::map<std::string, std::vector<std::string>> files;  ///< lines of each, without their ends
  std::string motion, sensor;  ///< files: what the chaser moves by, and the sensor that tells most of the errors

  /// Rows that are later than `until` s after the first of `motion` are left out, of truth too.
  Folder(const std::filesystem::path& from, std::string motion, std::string sensor, double until);

  /// Writes it into an empty folder.
  void write(const std::filesystem::path& to) const;
  std::vector<std::string>& motion_lines() { return files.at(motion); }
  std::vector<std::string>& sensor_lines() { return files.at(sensor); }
};

/// What has to come of a fault.
enum class Outlook {
  refused,   ///< status 1, one sentence, no results
  survived,  ///< as if nothing had been, but for the error's ratio
  either,    ///< one of the two: it is refused for some kinds of sensors
  finite,    ///< refused, not done (status 2) or done, but nothing that is no number
};

/// What may go wrong with a folder.
struct FolderFault {
  std::string name;
  std::function<void(Folder&)> inject{};
  Outlook outlook = Outlook::refused;
  /// Part of what a refusal says; MOTION and SENSOR stand for the files' names.
  std::string said{};
  /// Done to the folder as it is written.
  std::function<void(const std::filesystem::path& folder, const Folder&)> inject_written{};
};

const std::vector<FolderFault>& folder_faults();

}  // namespace tandem::faults
