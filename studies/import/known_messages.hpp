#pragma once

#include <string_view>

namespace tandem {

/// Returns the entry of a map, as yaml, for a message type whose meaning is known, for example "sensor_msgs/Imu" or
/// "NMEA/GGA"; empty for other types. The entry has no name and no stream.
std::string_view known_message(std::string_view type);

}  // namespace tandem
