#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/studies/recording/recording.hpp>

namespace tandem {

/// The parts of a sentence between its commas, the address first.
using NmeaParts = std::vector<std::string_view>;

/// Conversion of a part of a sentence to a number.
enum class NmeaPart {
  number,
  text,
  latitude,   ///< ddmm.mm and N or S in the next part
  longitude,  ///< dddmm.mm and E or W in the next part
  east,       ///< degrees and E or W in the next part
  knots,
  kmh,
  magnetic_heading,  ///< HDG: heading and deviation
  true_heading,      ///< HDG: heading, deviation and variation; nan without a variation
};

struct NmeaField {
  const char* name;
  const char* unit;
  std::size_t part;  ///< index after the address, from 1
  NmeaPart kind;
};

/// A sentence whose fields have names.
struct NmeaSentence {
  std::string_view type;
  std::vector<NmeaField> fields;
};

/// Returns the sentence of this type, or null if its parts only have numbers.
const NmeaSentence* find_nmea_sentence(std::string_view type);
/// Returns the type of a sentence: "GGA" for "GPGGA", or the whole address of vendor sentences.
std::string nmea_type(std::string_view address);
/// Returns the value of a field.
RecordedValue nmea_value(const NmeaParts& parts, const NmeaField& field);

/// Returns the number of a part, or nan.
double nmea_number(const NmeaParts& parts, std::size_t part);
/// Returns the seconds since midnight of hhmmss.ss.
std::optional<double> nmea_time(std::string_view text);

enum class NmeaChecksum { none, right, wrong };
NmeaChecksum nmea_checksum(std::string_view sentence);

/// Returns the time [s] that a logger wrote in front of a sentence, or nan.
double nmea_receive_time(std::string_view prefix);

}  // namespace tandem
