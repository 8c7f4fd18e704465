#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace tandem::faults {

/// The beginning of a scenario folder, as text.
struct Folder {
  std::string yaml;
  std::map<std::string, std::vector<std::string>> files;  ///< lines of each file, without line ends
  std::string motion, sensor;  ///< file names: the chaser's motion, and the sensor that affects the errors most

  /// Reads a folder. Omits rows of all files that are more than `until` s later than the first row of `motion`.
  Folder(const std::filesystem::path& from, std::string motion, std::string sensor, double until);

  /// Writes the files to an empty folder.
  void write(const std::filesystem::path& to) const;
  std::vector<std::string>& motion_lines() { return files.at(motion); }
  std::vector<std::string>& sensor_lines() { return files.at(sensor); }
};

/// The expected result of a fault.
enum class ExpectedOutcome {
  rejected,  ///< Status 1, one sentence, no results.
  survived,  ///< Status 0 and an error close to that without the fault.
  either,    ///< One of the two, depending on the kind of sensor.
  finite,    ///< Rejected, incomplete (status 2) or done, with finite numbers only.
};

/// A fault of a scenario folder.
struct FolderFault {
  std::string name;
  std::function<void(Folder&)> inject{};
  ExpectedOutcome expected_outcome = ExpectedOutcome::rejected;
  /// Part of the expected error message; MOTION and SENSOR stand for the file names.
  std::string expected_message{};
  /// Injects a fault into the written folder.
  std::function<void(const std::filesystem::path& folder, const Folder&)> inject_written{};
};

/// Returns all faults of folders.
const std::vector<FolderFault>& folder_faults();

}  // namespace tandem::faults
