#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace tandem {

/// Seconds from 1970-01-01 (Unix) to 1980-01-06 (GPS).
inline constexpr double kGpsEpoch = 315964800.0;
inline constexpr double kSecondsPerDay = 86400.0;
/// GPS time minus UTC since 2017 [s].
inline constexpr double kLeapSeconds = 18.0;

/// Returns the days from 1970-01-01 to a date of the Gregorian calendar.
long days_since_1970(int year, int month, int day);

/// Returns the time of a text such as "2024-11-26T05:46:40.123Z", "2024/11/26 05:46:40", "26.11.2024 05:46:40",
/// "20241126T054640Z" or "…+02:00" in seconds since 1970 (UTC without an offset), or nothing. "05:46:40.5" is a time of
/// day [s].
std::optional<double> parse_time_text(std::string_view text);

/// Returns the time of a date: of its text, or of a number such as 20241126.
std::optional<double> recorded_date(double number, std::string_view text);

/// Returns the seconds since midnight of a number hhmmss.ss, or nan if it is no time of day.
double packed_time_of_day(double number);

/// Returns the seconds of a time since 1970 whose unit is not stated: its magnitude tells s, ms, μs and ns apart.
double seconds_by_magnitude(double time);

/// Returns a time since 1970 [s] as "2024-11-26T05:46:40.123Z".
std::string utc_text(double t);

}  // namespace tandem
