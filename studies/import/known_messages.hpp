#pragma once

#include <string_view>

#include <tandem/studies/recording/recording.hpp>

namespace tandem {

/// Returns the entry of a map, as yaml, for a stream whose message type is known, for example "sensor_msgs/Imu" or
/// "NMEA/GGA"; empty for other types. The entry has no name and no stream. Its key `frame` names the field with the
/// frame of the rows. If `magnetic` is set, headings are magnetic ones even if the stream states the variation.
std::string_view known_message(const RecordedStream& stream, bool magnetic = false);

}  // namespace tandem
