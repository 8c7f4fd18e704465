#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace tandem {

/// Seconds from 1970-01-01 (Unix) to 1980-01-06 (GPS).
inline constexpr double kGpsEpoch = 315964800.0;
inline constexpr double kSecondsPerDay = 86400.0;
/// GPS time minus UTC since 2017 [s].
inline constexpr double kLeapSeconds = 18.0;

/// Returns the days from 1970-01-01 to a date of the Gregorian calendar.
long days_since_1970(int year, int month, int day);

/// Order of day and month in dates like 05/06/2024.
enum class DateOrder { unknown, dmy, mdy };

/// Returns the time of a text such as "2024-11-26T05:46:40.123Z", "2024/11/26 05:46:40", "26.11.2024 05:46:40",
/// "26-Nov-2024 5:46:40 AM UTC", "20241126T054640Z" or "…+02:00" in seconds since 1970 (UTC without an offset), or
/// nothing. "05:46:40.5" is a time of day [s]. "26/11/2024" needs the order.
std::optional<double> parse_time_text(std::string_view text, DateOrder order = DateOrder::unknown);

/// Returns the first two numbers of a date like "26/11/2024" or "11-26-2024", whose order the text does not state;
/// nothing for other texts.
std::optional<std::pair<int, int>> day_and_month(std::string_view text);

/// Returns the time of a date: of its text, or of a number such as 20241126.
std::optional<double> recorded_date(double number, std::string_view text, DateOrder order = DateOrder::unknown);

/// Returns the seconds since midnight of a number hhmmss.ss, or nan if it is no time of day.
double packed_time_of_day(double number);

/// Returns the seconds of a time since 1970 whose unit is not stated: its magnitude tells s, ms, μs and ns apart. A
/// number such as 20241126054640 is a date and a time of day.
double seconds_by_magnitude(double time);

/// Returns the unit that seconds_by_magnitude() takes: "s", "ms", "us", "ns" or "YYYYMMDDhhmmss".
std::string_view unit_by_magnitude(double time);

/// Returns a time since 1970 [s] as "2024-11-26T05:46:40.123Z".
std::string utc_text(double t);

}  // namespace tandem
