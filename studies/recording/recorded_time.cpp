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

/// Reads HH:MM:SS, or HHMMSS if `packed`, with an optional fraction.
std::optional<double> time_of_day(std::string_view& text, bool packed = false) {
  const auto hour = digits(text, packed ? 2 : 1, 2);
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
  if (*hour > 24 || *minute > 59 || seconds >= 61) return {};
  return *hour * 3600.0 + *minute * 60.0 + seconds;
}

struct Date {
  int year, month, day;
};

/// Reads YYYY-MM-DD, YYYY/MM/DD, YYYY.MM.DD, DD.MM.YYYY, or YYYYMMDD before a T (then `packed` is set).
std::optional<Date> date(std::string_view& text, bool& packed) {
  const std::string_view all = text;
  packed = text.size() > 8 && text[8] == 'T';
  if (const auto year = digits(text, 4, 4); year && (packed || take(text, "-/."))) {
    const auto month = digits(text, packed ? 2 : 1, 2);
    if (!month || (!packed && !take(text, "-/."))) return {};
    const auto day = digits(text, packed ? 2 : 1, 2);
    return day ? std::optional(Date{*year, *month, *day}) : std::nullopt;
  }
  text = all;
  packed = false;
  const auto day = digits(text, 1, 2);
  if (!day || !take(text, ".")) return {};
  const auto month = digits(text, 1, 2);
  if (!month || !take(text, ".")) return {};
  const auto year = digits(text, 4, 4);
  return year ? std::optional(Date{*year, *month, *day}) : std::nullopt;
}

}  // namespace

long days_since_1970(int year, int month, int day) {  // Hinnant, "chrono-compatible low-level date algorithms"
  year -= month <= 2;
  const long era = (year >= 0 ? year : year - 399) / 400;
  const long of_era = year - era * 400;
  const long of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
  return era * 146097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719468;
}

std::optional<double> parse_time_text(std::string_view text) {
  text = trimmed(text);
  std::string_view rest = text;
  if (const auto of_day = time_of_day(rest); of_day && rest.empty()) return of_day;
  rest = text;
  bool packed = false;
  const auto day = date(rest, packed);
  if (!day || day->month < 1 || day->month > 12 || day->day < 1 || day->day > 31) return {};
  double t = kSecondsPerDay * static_cast<double>(days_since_1970(day->year, day->month, day->day));
  if (rest.empty()) return t;
  if (!take(rest, "T t_")) return {};
  const auto of_day = time_of_day(rest, packed);
  if (!of_day) return {};
  t += *of_day;
  if (take(rest, "Zz") || rest.empty()) return rest.empty() ? std::optional(t) : std::nullopt;
  const double sign = rest.front() == '-' ? 1 : -1;
  if (!take(rest, "+-")) return {};
  const auto hours = digits(rest, 2, 2);
  if (!hours) return {};
  take(rest, ":");
  const auto minutes = rest.empty() ? std::optional(0) : digits(rest, 2, 2);
  if (!minutes || !rest.empty()) return {};
  return t + sign * (*hours * 3600.0 + *minutes * 60.0);
}

std::optional<double> recorded_date(double number, std::string_view text) {
  if (!text.empty()) return parse_time_text(text);
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

double seconds_by_magnitude(double time) {
  return time * (time > 1e17 ? 1e-9 : time > 1e14 ? 1e-6 : time > 1e11 ? 1e-3 : 1);
}

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
