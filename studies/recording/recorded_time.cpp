#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/recording/recorded_time.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Reads digits at the front of a text.
std::optional<int> digits(std::string_view& text, std::size_t least, std::size_t most) {
  std::size_t n = 0;
  int value = 0;
  while (n < text.size() && n < most && text[n] >= '0' && text[n] <= '9') value = value * 10 + (text[n++] - '0');
  if (n < least) return {};
  text.remove_prefix(n);
  return value;
}

bool take(std::string_view& text, std::string_view any_of) {
  if (text.empty() || any_of.find(text.front()) == std::string_view::npos) return false;
  text.remove_prefix(1);
  return true;
}

void skip_blanks(std::string_view& text) { text.remove_prefix(std::min(text.find_first_not_of(' '), text.size())); }

/// Removes a word in any case from the front of a text.
bool take_word(std::string_view& text, std::string_view word) {
  if (lower_case(text.substr(0, word.size())) != word) return false;
  text.remove_prefix(word.size());
  return true;
}

/// Reads HH:MM:SS, or HHMMSS if `packed`, with an optional fraction, and AM or PM.
std::optional<double> time_of_day(std::string_view& text, bool packed = false) {
  auto hour = digits(text, packed ? 2 : 1, 2);
  if (!hour || (!packed && !take(text, ":"))) return {};
  const auto minute = digits(text, 2, 2);
  if (!minute) return {};
  double seconds = 0;
  if (packed || take(text, ":")) {
    const auto whole = digits(text, 2, 2);
    if (!whole) return {};
    seconds = *whole;
    if (take(text, ".,")) {
      double scale = 0.1;
      for (; !text.empty() && text.front() >= '0' && text.front() <= '9'; text.remove_prefix(1), scale *= 0.1)
        seconds += scale * (text.front() - '0');
    }
  }
  std::string_view rest = text;
  skip_blanks(rest);
  const bool am = take_word(rest, "am"), pm = !am && take_word(rest, "pm");
  if (am || pm) {
    if (*hour < 1 || *hour > 12) return {};
    hour = *hour % 12 + (pm ? 12 : 0);
    text = rest;
  }
  if (*hour > 24 || *minute > 59 || seconds >= 61) return {};
  return *hour * 3600.0 + *minute * 60.0 + seconds;
}

struct Date {
  int year, month, day;
};

/// Reads a number of month or a name of at least three letters.
std::optional<int> month_of(std::string_view& text, bool& named) {
  constexpr std::string_view kMonths = "janfebmaraprmayjunjulaugsepoctnovdec";
  named = false;
  if (const auto number = digits(text, 1, 2)) return number;
  const std::size_t at = text.size() < 3 ? std::string_view::npos : kMonths.find(lower_case(text.substr(0, 3)));
  if (at == std::string_view::npos || at % 3 != 0) return {};
  named = true;
  while (!text.empty() && std::isalpha(static_cast<unsigned char>(text.front()))) text.remove_prefix(1);
  return static_cast<int>(at / 3) + 1;
}

/// Reads YYYY-MM-DD, YYYY/MM/DD, YYYY.MM.DD, YYYYMMDD (then `packed` is set), DD.MM.YYYY, DD-Mon-YYYY, and, in the
/// given order, DD/MM/YYYY and MM/DD/YYYY (also with "-").
std::optional<Date> date(std::string_view& text, bool& packed, DateOrder order) {
  const std::string_view all = text;
  packed = text.size() >= 8 && text.substr(0, 8).find_first_not_of("0123456789") == std::string_view::npos;
  if (const auto year = digits(text, 4, 4); year && (packed || take(text, "-/."))) {
    const auto month = digits(text, packed ? 2 : 1, 2);
    if (!month || (!packed && !take(text, "-/."))) return {};
    const auto day = digits(text, packed ? 2 : 1, 2);
    return day ? std::optional(Date{*year, *month, *day}) : std::nullopt;
  }
  text = all;
  packed = false;
  const auto first = digits(text, 1, 2);
  if (!first || text.empty()) return {};
  const char separator = text.front();
  bool named = false;
  if (!take(text, "./- ")) return {};
  const auto second = month_of(text, named);
  if (!second || !take(text, {&separator, 1})) return {};
  const auto year = digits(text, 4, 4);
  if (!year) return {};
  if (named || separator == '.' || (order == DateOrder::dmy && separator != ' ')) return Date{*year, *second, *first};
  if (order == DateOrder::mdy && separator != ' ') return Date{*year, *first, *second};
  return {};
}

/// Returns the seconds of a number YYYYMMDDhhmmss, or nothing.
std::optional<double> packed_date(double number) {
  constexpr double kFirst = 19700101000000, kLast = 21001231235960;
  if (!(number >= kFirst && number <= kLast)) return {};
  const double day = std::floor(number / 1e6), of_day = packed_time_of_day(number - 1e6 * day);
  const auto date = recorded_date(day, "");
  return date && !std::isnan(of_day) ? std::optional(*date + of_day) : std::nullopt;
}

struct Magnitude {
  std::string_view unit;
  double seconds;
};
Magnitude magnitude_of(double time) {
  if (time > 1e17) return {"ns", 1e-9};
  if (time > 1e14) return {"us", 1e-6};
  return time > 1e11 ? Magnitude{"ms", 1e-3} : Magnitude{"s", 1};
}

}  // namespace

long days_since_1970(int year, int month, int day) {  // Hinnant, "chrono-compatible low-level date algorithms"
  year -= month <= 2;
  const long era = (year >= 0 ? year : year - 399) / 400;
  const long of_era = year - era * 400;
  const long of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
  return era * 146097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719468;
}

std::optional<double> parse_time_text(std::string_view text, DateOrder order) {
  text = trimmed(text);
  for (const std::string_view utc : {"utc", "gmt"})
    if (text.size() > utc.size() && lower_case(text.substr(text.size() - utc.size())) == utc)
      text = trimmed(text.substr(0, text.size() - utc.size()));
  std::string_view rest = text;
  if (const auto of_day = time_of_day(rest); of_day && rest.empty()) return of_day;
  rest = text;
  bool packed = false;
  const auto day = date(rest, packed, order);
  if (!day || day->month < 1 || day->month > 12 || day->day < 1 || day->day > 31) return {};
  double t = kSecondsPerDay * static_cast<double>(days_since_1970(day->year, day->month, day->day));
  if (rest.empty()) return t;
  take(rest, ",");
  if (!take(rest, "T t_") && !packed) return {};
  skip_blanks(rest);
  const auto of_day = time_of_day(rest, packed && rest.find(':') != 2);
  if (!of_day) return {};
  t += *of_day;
  if (take(rest, "Zz") || rest.empty()) return rest.empty() ? std::optional(t) : std::nullopt;
  skip_blanks(rest);
  const double sign = rest.starts_with('-') ? 1 : -1;
  if (!take(rest, "+-")) return {};
  const auto hours = digits(rest, 2, 2);
  if (!hours) return {};
  take(rest, ":");
  const auto minutes = rest.empty() ? std::optional(0) : digits(rest, 2, 2);
  if (!minutes || !rest.empty()) return {};
  return t + sign * (*hours * 3600.0 + *minutes * 60.0);
}

std::optional<std::pair<int, int>> day_and_month(std::string_view text) {
  const auto first = digits(text, 1, 2);
  if (!first || text.empty()) return {};
  const char separator = text.front();
  if (!take(text, "/-")) return {};
  const auto second = digits(text, 1, 2);
  if (!second || !take(text, {&separator, 1}) || !digits(text, 4, 4)) return {};
  return std::pair{*first, *second};
}

std::optional<double> recorded_date(double number, std::string_view text, DateOrder order) {
  if (!text.empty()) return parse_time_text(text, order);
  constexpr double kFirst = 19700101, kLast = 21001231;
  if (!(number >= kFirst && number <= kLast) || number != std::floor(number)) return {};
  const int n = static_cast<int>(number);
  return parse_time_text(fmt::format("{:04}-{:02}-{:02}", n / 10000, n / 100 % 100, n % 100));
}

double packed_time_of_day(double number) {
  const double hours = std::trunc(number / 1e4), minutes = std::trunc((number - 1e4 * hours) / 100);
  const double seconds = number - 1e4 * hours - 100 * minutes;
  return number >= 0 && hours <= 24 && minutes < 60 && seconds < 61 ? 3600 * hours + 60 * minutes + seconds
                                                                    : std::nan("");
}

std::string_view unit_by_magnitude(double time) {
  return packed_date(time) ? "YYYYMMDDhhmmss" : magnitude_of(time).unit;
}

double seconds_by_magnitude(double time) { return packed_date(time).value_or(time * magnitude_of(time).seconds); }

std::string utc_text(double t) {
  if (!(std::abs(t) < 1e11)) return fmt::format("{:g} s", t);
  const auto ms = static_cast<long long>(std::llround(t * 1000));
  const long long day_ms = 86400000;
  const long long days = (ms >= 0 ? ms : ms - day_ms + 1) / day_ms, of_day = ms - days * day_ms;
  // Hinnant, as above
  const long long z = days + 719468, era = (z >= 0 ? z : z - 146096) / 146097, doe = z - era * 146097;
  const long long yoe = (doe - doe / 1460 + doe / 36524 - doe / 146096) / 365;
  const long long doy = doe - (365 * yoe + yoe / 4 - yoe / 100), mp = (5 * doy + 2) / 153;
  const long long day = doy - (153 * mp + 2) / 5 + 1, month = mp + (mp < 10 ? 3 : -9);
  const long long year = yoe + era * 400 + (month <= 2);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", year, month, day, of_day / 3600000,
                     of_day / 60000 % 60, of_day / 1000 % 60, of_day % 1000);
}

}  // namespace tandem
