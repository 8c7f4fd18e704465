#include <algorithm>
#include <cmath>

#include <tandem/studies/recording/nmea_clock.hpp>
#include <tandem/studies/recording/recorded_time.hpp>

namespace tandem {
namespace {

constexpr double kLargestGap = 60;  // s, in a run

std::optional<double> midnight_of(double year, double month, double day) {
  if (!(day >= 1 && day <= 31 && month >= 1 && month <= 12 && year >= 1980)) return {};
  return kSecondsPerDay *
         static_cast<double>(days_since_1970(static_cast<int>(year), static_cast<int>(month), static_cast<int>(day)));
}

/// Returns the date ddmmyy.
std::optional<double> date_of(const NmeaParts& parts, std::size_t part) {
  if (part >= parts.size() || parts[part].size() != 6) return {};
  const double ddmmyy = nmea_number(parts, part), year = std::fmod(ddmmyy, 100);
  return midnight_of(year + (year < 80 ? 2000 : 1900), std::fmod(std::floor(ddmmyy / 100), 100),
                     std::floor(ddmmyy / 10000));
}

}  // namespace

bool NmeaClock::is_timed(std::string_view type) {
  return type == "GGA" || type == "RMC" || type == "ZDA" || type == "GNS" || type == "GST" || type == "GLL";
}

std::optional<NmeaClock::Reading> NmeaClock::read(std::string_view type, const NmeaParts& parts) {
  const auto part = [&](std::size_t i) { return i < parts.size() ? parts[i] : std::string_view(); };
  if (type == "GGA") void_ = !(nmea_number(parts, 6) > 0);
  if (type == "RMC") void_ = part(2) != "A";
  if (type == "GNS") void_ = part(6).find_first_not_of('N') == std::string_view::npos;
  has_status_ |= type == "GGA" || type == "RMC" || type == "GNS";
  if (!is_timed(type)) return {};
  const auto of_day = nmea_time(part(type == "GLL" ? 5 : 1));
  if (!of_day) return {};
  const bool stated = type == "GLL" && !part(6).empty();
  Reading reading{*of_day, stated ? part(6) == "A" : !void_};
  if (type == "RMC") reading.date = date_of(parts, 9);
  if (type == "ZDA") reading.date = midnight_of(nmea_number(parts, 4), nmea_number(parts, 3), nmea_number(parts, 2));
  if (reading.fix) return reading;
  has_void_date_ |= reading.date.has_value();
  reading.date.reset();
  return reading;
}

NmeaClock::Stamp NmeaClock::stamp(std::size_t line, std::string_view type, const NmeaParts& parts) {
  const auto reading = read(type, parts);
  if (!reading) return {is_timed(type)};
  const double step = of_day_ ? reading->of_day - *of_day_ : 0;
  const bool jump = !of_day_ || std::abs(std::remainder(step, kSecondsPerDay)) > kLargestGap;
  if (jump && any_fix_ && !reading->fix) return {true};
  if (jump && !any_fix_)
    day_ = 0;
  else if (step < -kSecondsPerDay / 2)
    ++day_;
  else if (step > kSecondsPerDay / 2 && !jump)
    --day_;
  of_day_ = reading->of_day;
  any_fix_ |= reading->fix;
  if (first_pass_) {
    if (jump) runs_.push_back({line});
    runs_.back().fix |= reading->fix;
    if (reading->date) add_date(line, *reading->date - kSecondsPerDay * day_);
    return {true};
  }
  while (run_ + 1 < runs_.size() && runs_[run_ + 1].line <= line) ++run_;
  const auto& midnight = runs_[run_].midnight;
  return midnight ? Stamp{true, *midnight + kSecondsPerDay * day_ + reading->of_day} : Stamp{true};
}

void NmeaClock::add_date(std::size_t line, double midnight) {
  has_date_ = true;
  if (!runs_.back().midnight)
    runs_.back().midnight = midnight;
  else if (*runs_.back().midnight != midnight)
    runs_.push_back({line, true, midnight});
}

void NmeaClock::end_first_pass() {
  first_pass_ = false;
  const auto first = std::find_if(runs_.begin(), runs_.end(), [](const Run& run) { return run.fix; });
  // Runs before the first fix are those of a receiver that does not know the time yet.
  const auto begin = first == runs_.end() ? runs_.begin() : first;
  const auto dated = std::find_if(begin, runs_.end(), [](const Run& run) { return run.midnight.has_value(); });
  double midnight = dated == runs_.end() ? 0 : *dated->midnight;
  for (auto run = begin; run != runs_.end(); ++run) {
    midnight = run->midnight.value_or(midnight);
    run->midnight = midnight;
  }
  restart();
}

void NmeaClock::restart() {
  void_ = !trusted_;
  any_fix_ = false;
  of_day_.reset();
  day_ = 0;
  run_ = 0;
}

}  // namespace tandem
