#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/studies/recording/recorded_units.hpp>

namespace tandem {

/// A part of the rows of a scenario file.
enum class ImportPart {
  world_position,     ///< Position x y z along the world's axes [m].
  world_orientation,  ///< Orientation qx qy qz qw of the body in the world.
  height,             ///< Height: z along the world's axes [m].
  body_position,      ///< Position x y z along the chaser's axes [m].
  body_orientation,   ///< Orientation qx qy qz qw of the target in the chaser's body.
  velocity,           ///< Velocity along the body's axes [m/s].
  acceleration,       ///< Specific force along the sensor's axes [m/s²].
  angular_rate,       ///< Angular rate along the sensor's axes [rad/s].
  range,              ///< m
  direction,          ///< Azimuth and elevation [rad].
};

/// A type of sensor that an import can write.
struct ImportType {
  std::string_view name;
  std::vector<ImportPart> parts;
  std::string_view columns;  ///< header of the file; empty for a TUM file
  std::string_view file;     ///< fixed file name; if empty, NAME.csv
  std::string_view sigma;    ///< standard deviations if neither the map nor the data state them
};

const std::vector<ImportType>& import_types();
/// Returns the type of this name, or null.
const ImportType* find_import_type(std::string_view name);
std::vector<std::string> import_type_names();

/// Returns whether sensors of this type observe the target.
bool observes_target(const ImportType& type);

/// Returns whether rows of this type have an orientation in the world, whose north may be the magnetic one.
bool has_world_orientation(const ImportType& type);

/// A quantity that the key `fields` of a map names.
struct ImportQuantity {
  std::string_view name;
  Quantity quantity;
  int count;  ///< number of fields
};
/// Returns the quantities that describe a part.
std::span<const ImportQuantity> quantities(ImportPart part);

/// Returns the quantity of each standard deviation of a type.
std::vector<Quantity> sigma_quantities(const ImportType& type);

}  // namespace tandem
