#pragma once

#include <string>

#include <tandem/studies/import/import_map.hpp>
#include <tandem/studies/recording/recording.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>

namespace tandem {

/// The sources of one sensor of an import.
struct ImportEntry {
  std::string name;
  const YamlSection* given;  ///< the user's entry, or null
  const YamlSection* rule;   ///< the rule of a known message, whose keys apply if `given` lacks them, or null
  const YamlSection* map;    ///< the whole map with its defaults, or null
  const RecordedStream* stream;
};

/// Reads the key `date_order` of a map's tables. Throws Error if it is neither dmy nor mdy.
DateOrder read_date_order(const YamlSection& tables);

/// Reads one sensor. Throws Error with file and line on unknown keys, fields and units, and on missing quantities.
ImportSensor read_import_entry(const ImportEntry& entry);

}  // namespace tandem
