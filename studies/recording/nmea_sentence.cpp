#include <charconv>
#include <cmath>

#include <tandem/studies/recording/nmea_sentence.hpp>
#include <tandem/studies/recording/recorded_time.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr double kKnots = 1852.0 / 3600;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

const std::vector<NmeaSentence>& sentences() {
  using enum NmeaPart;
  static const std::vector<NmeaSentence> all = {
      {"GGA",
       {{"latitude", "deg", 2, latitude},
        {"longitude", "deg", 4, longitude},
        {"quality", "", 6, number},
        {"satellites", "", 7, number},
        {"hdop", "", 8, number},
        {"altitude", "m", 9, number},
        {"geoid_separation", "m", 11, number}}},
      {"RMC",
       {{"status", "", 2, text},
        {"latitude", "deg", 3, latitude},
        {"longitude", "deg", 5, longitude},
        {"speed", "m/s", 7, knots},
        {"course", "deg", 8, number},
        {"variation", "deg", 10, east}}},
      {"HDT", {{"heading", "deg", 1, number}}},
      {"HDG",
       {{"heading", "deg", 1, number},
        {"deviation", "deg", 2, east},
        {"variation", "deg", 4, east},
        {"heading_magnetic", "deg", 1, magnetic_heading},
        {"heading_true", "deg", 1, true_heading}}},
      {"VTG", {{"course", "deg", 1, number}, {"course_magnetic", "deg", 3, number}, {"speed", "m/s", 7, kmh}}},
      {"DPT", {{"depth", "m", 1, number}, {"offset", "m", 2, number}}},
      {"ROT", {{"rate", "deg/min", 1, number}, {"status", "", 2, text}}},
  };
  return all;
}

/// Returns dddmm.mmm in degrees.
double degrees(double value) {
  const double whole = std::trunc(value / 100);
  return whole + (value - 100 * whole) / 60;
}

double number_of(std::string_view text) { return parse_number(text).value_or(kNan); }

/// Returns -1 if the part is S or W, else 1.
double side(const NmeaParts& parts, std::size_t part) {
  const std::string_view text = part < parts.size() ? trimmed(parts[part]) : std::string_view();
  return text == "S" || text == "W" ? -1 : 1;
}

}  // namespace

const NmeaSentence* find_nmea_sentence(std::string_view type) {
  for (const NmeaSentence& sentence : sentences())
    if (sentence.type == type) return &sentence;
  return nullptr;
}

std::string nmea_type(std::string_view address) {
  const bool whole = address.starts_with('P') || address.size() < 5;
  return std::string(whole ? address : address.substr(address.size() - 3));
}

double nmea_number(const NmeaParts& parts, std::size_t part) {
  return part < parts.size() ? number_of(parts[part]) : kNan;
}

RecordedValue nmea_value(const NmeaParts& parts, const NmeaField& field) {
  if (field.part >= parts.size()) return {};
  const std::string_view text = trimmed(parts[field.part]);
  const double n = number_of(text);
  const double sign = side(parts, field.part + 1);
  switch (field.kind) {
    case NmeaPart::number:
      return std::isnan(n) ? RecordedValue{kNan, text} : RecordedValue{n};
    case NmeaPart::text:
      return {kNan, text};
    case NmeaPart::latitude:
    case NmeaPart::longitude:
      return {sign * degrees(n)};
    case NmeaPart::east:
      return {sign * n};
    case NmeaPart::knots:
      return {n * kKnots};
    case NmeaPart::kmh:
      return {n / 3.6};
    case NmeaPart::magnetic_heading:
    case NmeaPart::true_heading: {
      const double deviation = side(parts, 3) * nmea_number(parts, 2);
      const double magnetic = n + (std::isnan(deviation) ? 0 : deviation);
      const double variation = field.kind == NmeaPart::true_heading ? side(parts, 5) * nmea_number(parts, 4) : 0;
      const double turned = std::fmod(magnetic + variation, 360);
      return {turned < 0 ? turned + 360 : turned};
    }
  }
  return {};
}

std::optional<double> nmea_time(std::string_view text) {
  const double time = packed_time_of_day(number_of(text));
  return text.size() < 6 || std::isnan(time) ? std::nullopt : std::optional(time);
}

NmeaChecksum nmea_checksum(std::string_view sentence) {
  const std::size_t star = sentence.rfind('*');
  if (star == std::string_view::npos) return NmeaChecksum::none;
  unsigned sum = 0, stated = 0;
  for (const char c : sentence.substr(0, star)) sum ^= static_cast<unsigned char>(c);
  const std::string_view digits = sentence.substr(star + 1, 2);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), stated, 16);
  const bool whole = error == std::errc() && digits.size() == 2 && end == digits.data() + 2;
  return whole && stated == sum ? NmeaChecksum::right : NmeaChecksum::wrong;
}

double nmea_receive_time(std::string_view prefix) {
  while (!prefix.empty() && std::string_view(",; \t]").find(prefix.back()) != std::string_view::npos)
    prefix.remove_suffix(1);
  while (!prefix.empty() && std::string_view("[ ").find(prefix.front()) != std::string_view::npos)
    prefix.remove_prefix(1);
  if (prefix.empty()) return kNan;
  const std::string_view first = prefix.substr(0, prefix.find_first_of(",;"));
  if (const auto value = parse_number(first)) return seconds_by_magnitude(*value);
  return parse_time_text(first).value_or(kNan);
}

}  // namespace tandem
