#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/import/imported_sensor.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

std::string value_text(const RecordedValue& value) {
  if (!value.text.empty()) return "is " + quote(value.text);
  return std::isnan(value.number) ? "has no value" : fmt::format("is {:.10g}", value.number);
}

}  // namespace

void LargestAngle::note(const std::string& name, const std::string& of_unit, double angle) {
  // A pitch is within a quarter of a turn, other angles within a turn. A yaw of a stated unit may count turns.
  constexpr double kPi = std::numbers::pi, kRounding = 1e-3;
  constexpr int kTurns = 10;
  const bool counts_turns = !of_unit.empty() && (name == "yaw" || name == "heading");
  const double most = name == "pitch" ? kPi / 2 : counts_turns ? kTurns * 2 * kPi : 2 * kPi;
  if (std::abs(angle) <= most + kRounding || std::abs(angle) <= std::abs(value)) return;
  quantity = name;
  unit = of_unit;
  value = angle;
}

void PackedTimes::note(double number) {
  constexpr double kMostStep = 30;  // s
  const double t = packed_time_of_day(number), step = t - packed_time_of_day(last_);
  possible_ = possible_ && std::fmod(number, 100) < 60 && !std::isnan(t);
  if (possible_ && last_ > 0 && step > 0 && step < kMostStep && number - last_ > step + 1) ++minutes_;
  last_ = number;
}

void SerialDays::note(double number) {
  constexpr double kFirst = 36526, kLast = 73051;  // 2000 and 2100
  possible_ = possible_ && number > kFirst && number < kLast;
  least_ = count_ == 0 ? number : std::min(least_, number);
  most_ = count_ == 0 ? number : std::max(most_, number);
  ++count_;
}

bool SerialDays::found(double highest_rate) const {
  constexpr std::size_t kLeast = 3;
  return possible_ && count_ >= kLeast && (most_ - least_) * highest_rate < static_cast<double>(count_ - 1);
}

std::vector<std::string> ImportedSensor::findings() const {
  std::vector<std::string> result;
  if (packed_times_.found())
    result.push_back(fmt::format("{0}: the times in {1} look like hhmmss; give time: {{field: {1}, unit: hhmmss}}",
                                 sensor_.name, time_.field.field));
  constexpr double kHighestRate = 200, kHighestImuRate = 20000;  // Hz
  if (serial_days_.found(sensor_.type->name == "imu" ? kHighestImuRate : kHighestRate))
    result.push_back(
        fmt::format("{0}: the times in {1} look like days since 1899-12-30, as spreadsheets count; give time: {{field: "
                    "{1}, unit: days, offset: -2209161600}}",
                    sensor_.name, time_.field.field));
  if (angles_.value == 0) return result;
  const auto unit = find_unit(angles_.unit);
  const bool stated = unit && unit->factor > 0;
  result.push_back(
      fmt::format("{}: {} reaches {:.4g} {}; {}", sensor_.name, angles_.quantity,
                  angles_.value / (stated ? unit->factor : 1), stated ? unit->name : "rad",
                  stated ? fmt::format("is its unit {}?", unit->name) : "is it in degrees (FIELD [deg])?"));
  return result;
}

void ImportedSensor::require_date_order(const Bound& field, std::string_view text) const {
  if (sensor_.time.date_order != DateOrder::unknown || !day_and_month(text)) return;
  throw Error(
      fmt::format("{}: {} has the date {}, whose order of day and month is not stated; give tables: {{date_order: "
                  "dmy}} (day/month/year) or mdy in the map",
                  sensor_.stream, field.field.field, quote(text)));
}

/// Returns a time of day plus the days since the first row. A step back by more than half a day is a midnight.
double ImportedSensor::after_midnight(double of_day) {
  if (last_of_day_ - of_day > kSecondsPerDay / 2) midnight_ += kSecondsPerDay;
  if (of_day - last_of_day_ > kSecondsPerDay / 2 && midnight_ > 0) midnight_ -= kSecondsPerDay;  // an unordered row
  last_of_day_ = of_day;
  return of_day + midnight_;
}

std::optional<double> ImportedSensor::time(const RecordedRow& row) {
  const ImportTime& time = sensor_.time;
  double t = row.received;
  if (!time.receive) {
    const RecordedValue* recorded =
        time_.field.field.empty() || time_.field.field == kReceiveTime ? nullptr : &row.values[time_.index];
    if (recorded && !recorded->text.empty()) {
      const auto parsed = parse_time_text(recorded->text, time.date_order);
      if (!parsed) require_date_order(time_, recorded->text);
      if (!parsed) return {};
      t = *parsed;
    } else {
      t = value(time_, row);
      if (recorded && time_.field.unit.empty()) {
        packed_times_.note(t);
        serial_days_.note(t);
        if (!(unstated_time_ >= t)) unstated_time_ = t;
        t = seconds_by_magnitude(t);
      }
    }
    const bool is_text = recorded && !recorded->text.empty();
    const bool of_day = is_text || time_.field.time_of_day || time.date != 0;
    if (of_day && time.week.empty() && time.date_field.empty() && t >= 0 && t <= kSecondsPerDay) t = after_midnight(t);
    if (!time.week.empty()) t += row.values[week_.index].number * 7 * kSecondsPerDay;
    if (time.gps) t += kGpsEpoch - time.leap_seconds;
    t += time.date;
    if (!time.date_field.empty()) {
      const RecordedValue& day = row.values[date_.index];
      const auto date = recorded_date(day.number, day.text, time.date_order);
      if (!date) require_date_order(date_, day.text);
      if (!date) return {};
      t += *date;
    }
  }
  if (sensor_.latency) t -= value(latency_, row);
  t += time.offset;
  return std::isfinite(t) ? std::optional(t) : std::nullopt;
}

bool ImportedSensor::drop(const std::string& reason, double t, const std::string& detail) {
  DroppedRows& dropped = dropped_[reason];
  if (dropped.count++ > 0) return false;
  const auto add = [&](const std::string& text) { dropped.example += (dropped.example.empty() ? "" : ", ") + text; };
  if (current_ && current_->line > 0) add(fmt::format("line {}", current_->line));
  if (std::isfinite(t)) add(fmt::format("t = {:.3f}", t));
  if (!detail.empty()) add(detail);
  if (dropped.example.empty()) dropped.example = fmt::format("row {}", read_);
  return false;
}

bool ImportedSensor::drop(const std::string& reason, double t, double value) {
  return drop(reason, t, fmt::format("value {:.6g}", value));
}

bool ImportedSensor::drop_missing(const std::vector<Bound>& fields, double t) {
  std::vector<std::string> names;
  std::string detail;
  for (const Bound& field : fields) {
    const std::string& name = field.field.field;
    names.push_back(name);
    if (current_ && detail.empty() && !name.empty() && name != kReceiveTime)
      if (const RecordedValue& v = current_->values[field.index]; !std::isfinite(v.number))
        detail = fmt::format("{} {}", name, value_text(v));
  }
  return drop(fmt::format("no number in {}", fmt::join(names, ", ")), t, detail);
}

void ImportedSensor::drop_without_time() {
  const ImportTime& time = sensor_.time;
  const auto of_field = [&](const std::string& name, std::size_t index) {
    if (!name.empty() && name != kReceiveTime) return fmt::format("{} {}", name, value_text(current_->values[index]));
    return std::string();
  };
  std::string detail = time.receive ? "" : of_field(time_.field.field, time_.index);
  if (!time.receive && !time.date_field.empty()) detail += ", " + of_field(time.date_field, date_.index);
  if (time.receive && std::isnan(current_->received))
    drop("no receive time, since the recording has none (give time: FIELD)", current_->received);
  else
    drop("no time", current_->received, detail);
}

}  // namespace tandem
