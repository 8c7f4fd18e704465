#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/import/geodesy.hpp>
#include <tandem/studies/import/import_map.hpp>
#include <tandem/studies/import/imported_sensor.hpp>
#include <tandem/studies/recording/recording.hpp>

namespace tandem {

/// The result of an import, before it is written.
struct Import {
  std::filesystem::path source;
  std::string format;
  ImportMap map;
  std::vector<std::unique_ptr<ImportedSensor>> sensors;
  std::optional<LocalFrame> frame;       ///< if positions are geographic
  std::optional<double> declination;     ///< rad; if headings are magnetic
  std::vector<std::string> defects;      ///< defects of the file
  std::vector<std::string> assumptions;  ///< values that neither the map nor the data state
  std::vector<std::string> findings;     ///< suspicious data, one sentence each
};

/// Returns whether a sensor is of this type (ImportType::name).
bool has_type(const Import& import, std::string_view type);

/// Reads the sensors of a map from a recording and converts their rows. `stop` is called now and then and may throw.
/// Throws Error if nothing remains, or if sensors are on different clocks.
Import import_recording(Recording& recording, ImportMap map, const std::function<void()>& stop);

/// Writes the scenario folder. Throws Error, with the place in the map, if a setting of the map is not valid there.
void write_import(const Import& import, const std::filesystem::path& folder);

}  // namespace tandem
