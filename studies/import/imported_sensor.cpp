#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/lie/wrapped_angle.hpp>
#include <tandem/studies/import/frame_names.hpp>
#include <tandem/studies/import/imported_rotation.hpp>
#include <tandem/studies/import/imported_sensor.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kVarianceSamples = 10000, kMostFrames = 4;

std::size_t width_of(ImportPart part) {
  switch (part) {
    case ImportPart::world_orientation:
    case ImportPart::body_orientation:
      return 4;
    case ImportPart::height:
    case ImportPart::range:
      return 1;
    case ImportPart::direction:
      return 2;
    default:
      return 3;
  }
}

}  // namespace

ImportedSensor::ImportedSensor(const ImportSensor& sensor, const ImportMap& map) : sensor_(sensor), map_(map) {
  world_ = axis_map(sensor.axes.world, map.ned ? "NED" : "ENU");
  body_ = axis_map(sensor.axes.body, map.ned ? "FRD" : "FLU");
  for (const auto& [name, fields] : sensor.fields) {
    std::vector<Bound> bounds;
    for (const ImportField& field : fields) bounds.push_back(bind(field));
    quantities_.emplace_back(name, std::move(bounds));
  }
  geographic_ = bound("latitude") != nullptr;
  for (const ImportPart part : sensor.type->parts) {
    if (part == ImportPart::world_orientation) orientation_ = static_cast<int>(width_);
    width_ += width_of(part);
  }
  if (!sensor.time.receive) time_ = bind(sensor.time.field);
  if (!sensor.time.week.empty()) week_ = bind({sensor.time.week});
  if (!sensor.time.date_field.empty()) date_ = bind({sensor.time.date_field});
  if (sensor.latency) latency_ = bind(*sensor.latency);
  for (const ImportField& field : sensor.variances) variances_.push_back(bind(field));
  for (const ImportCondition& condition : sensor.conditions)
    conditions_.emplace_back(condition, index_of(condition.field));
  if (!sensor.frame_field.empty()) frame_ = index_of(sensor.frame_field);
  variance_samples_.resize(variances_.size());
}

std::string ImportedSensor::file() const {
  return sensor_.type->file.empty() ? sensor_.name + ".csv" : std::string(sensor_.type->file);
}

RowRequest ImportedSensor::request() {
  return {sensor_.stream, fields_, [this](const RecordedRow& row) { add(row); }};
}

std::size_t ImportedSensor::index_of(const std::string& field) {
  const auto at = std::find(fields_.begin(), fields_.end(), field);
  if (at != fields_.end()) return static_cast<std::size_t>(at - fields_.begin());
  fields_.push_back(field);
  return fields_.size() - 1;
}

ImportedSensor::Bound ImportedSensor::bind(const ImportField& field) {
  return {field, field.field.empty() || field.field == kReceiveTime ? 0 : index_of(field.field)};
}

const std::vector<ImportedSensor::Bound>* ImportedSensor::bound(std::string_view quantity) const {
  for (const auto& [name, bounds] : quantities_)
    if (name == quantity) return &bounds;
  return nullptr;
}

double ImportedSensor::value(const Bound& bound, const RecordedRow& row) const {
  if (bound.field.field.empty()) return bound.field.constant;
  if (bound.field.field == kReceiveTime) return row.received;
  double number = row.values[bound.index].number;
  if (bound.field.degrees_and_minutes) {
    const double degrees = std::trunc(number / 100);
    number = degrees + (number - 100 * degrees) / 60;
  }
  if (bound.field.time_of_day) number = packed_time_of_day(number);
  return bound.field.factor * number;
}

bool ImportedSensor::accepted(const RecordedRow& row, double t) {
  for (const auto& [condition, index] : conditions_)
    if (const RecordedValue& value = row.values[index]; !is_met(condition, value))
      return drop(condition_text(condition) + " is not met", t,
                  value.text.empty() ? fmt::format("value {:.6g}", value.number) : quote(value.text));
  if (sensor_.frame_field.empty()) return true;
  const std::string_view frame = row.values[frame_].text;
  if (is_world_frame(frame))
    return drop(
        fmt::format("{} {} is a frame of the world, and a {} is along the chaser's axes (for another type, name "
                    "the stream in a map)",
                    sensor_.frame_field, frame, sensor_.type->name),
        t);
  if (frames_.size() < kMostFrames) frames_.emplace(frame);
  return true;
}

void ImportedSensor::add(const RecordedRow& row) {
  ++read_;
  current_ = &row;
  const std::optional<double> t = time(row);
  if (!t) {
    drop_without_time();
    return;
  }
  if (*t == 0 && row.received > 1) {
    drop("a stamp of 0 (give time: receive to use the receive times)", row.received);
    return;
  }
  if (!accepted(row, *t)) return;
  row_.assign(1, *t);
  for (const ImportPart part : sensor_.type->parts)
    if (!append_part(part, row, *t)) return;
  if (!values_.empty() && *t < values_[values_.size() - width_]) ++backwards_;
  values_.insert(values_.end(), row_.begin(), row_.end());
  for (std::size_t i = 0; i < variances_.size(); ++i)
    if (const double v = value(variances_[i], row); v > 0 && variance_samples_[i].size() < kVarianceSamples)
      variance_samples_[i].push_back(static_cast<float>(v));
}

bool ImportedSensor::append_part(ImportPart part, const RecordedRow& row, double t) {
  switch (part) {
    case ImportPart::world_position:
      return append_position(row, t);
    case ImportPart::world_orientation:
    case ImportPart::body_orientation:
      return append_orientation(part, row, t);
    case ImportPart::height:
      return append_height(row, t);
    case ImportPart::body_position:
      return append_vector("position", body_, row, t);
    case ImportPart::velocity:
      return append_vector("velocity", body_, row, t);
    case ImportPart::acceleration:
      return append_vector("acceleration", body_, row, t);
    case ImportPart::angular_rate:
      return append_vector("angular_rate", body_, row, t);
    case ImportPart::range: {
      const double r = value(bound("range")->front(), row);
      if (!std::isfinite(r)) return drop_missing(*bound("range"), t);
      if (!(r > 0)) return drop("a range that is not above zero", t, r);
      row_.push_back(r);
      return true;
    }
    case ImportPart::direction:
      return append_angles(row, t);
  }
  return false;
}

bool ImportedSensor::append_vector(const char* quantity, const AxisMap& axes, const RecordedRow& row, double t) {
  const std::vector<Bound>& fields = *bound(quantity);
  std::array<double, 3> v{};
  for (std::size_t i = 0; i < 3; ++i) {
    v[i] = value(fields[i], row);
    if (!std::isfinite(v[i])) return drop_missing(fields, t);
  }
  const std::array<double, 3> turned = axes.apply(v);
  row_.insert(row_.end(), turned.begin(), turned.end());
  return true;
}

bool ImportedSensor::append_position(const RecordedRow& row, double t) {
  const auto* depth = bound("depth");
  const auto* height = bound("height");
  std::optional<double> up;
  if (depth) up = -value(depth->front(), row);
  if (height) up = value(height->front(), row);
  if (up && !std::isfinite(*up)) return drop_missing(depth ? *depth : *height, t);
  if (geographic_) {
    const double latitude = value(bound("latitude")->front(), row) * 180 / kPi;
    const double longitude = value(bound("longitude")->front(), row) * 180 / kPi;
    if (!std::isfinite(latitude) || !std::isfinite(longitude)) return drop_missing(*bound("latitude"), t);
    if (std::abs(latitude) < 1e-9 && std::abs(longitude) < 1e-9)
      return drop("before the first fix: latitude and longitude are 0", t, 0);
    if (std::abs(latitude) > 90 || std::abs(longitude) > 360)
      return drop("a latitude beyond 90 or a longitude beyond 360 degrees", t,
                  std::abs(latitude) > 90 ? latitude : longitude);
    row_.insert(row_.end(), {latitude, longitude, up.value_or(0)});
    return true;
  }
  if (!append_vector("position", world_, row, t)) return false;
  if (up) row_.back() = map_.ned ? -*up : *up;
  return true;
}

bool ImportedSensor::append_height(const RecordedRow& row, double t) {
  double up = 0;
  if (const auto* depth = bound("depth")) up = -value(depth->front(), row);
  if (const auto* height = bound("height")) up = value(height->front(), row);
  if (const auto* pressure = bound("pressure")) {
    constexpr double kStandardGravity = 9.80665;
    up = -(value(pressure->front(), row) - map_.atmosphere) / (map_.density * kStandardGravity);
  }
  if (!std::isfinite(up)) return drop_missing(quantities_.front().second, t);
  row_.push_back(map_.ned ? -up : up);
  return true;
}

bool ImportedSensor::append_angles(const RecordedRow& row, double t) {
  const double azimuth = value(bound("azimuth")->front(), row), elevation = value(bound("elevation")->front(), row);
  if (!std::isfinite(azimuth)) return drop_missing(*bound("azimuth"), t);
  if (!std::isfinite(elevation)) return drop_missing(*bound("elevation"), t);
  constexpr double kRounding = 1e-6;
  if (std::abs(elevation) > kPi / 2 + kRounding)
    return drop("an elevation beyond 90 degrees (is its unit right?)", t, elevation);
  if (std::abs(azimuth) > 2 * kPi + kRounding)
    return drop("an azimuth beyond 360 degrees (is its unit right?)", t, azimuth);
  if (body_.is_identity()) {
    row_.insert(row_.end(), {wrapped_angle(azimuth), elevation});
    return true;
  }
  const std::array<double, 3> d = body_.apply(
      {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation)});
  row_.insert(row_.end(), {std::atan2(d[1], d[0]), std::atan2(d[2], std::hypot(d[0], d[1]))});
  return true;
}

bool ImportedSensor::append_orientation(ImportPart part, const RecordedRow& row, double t) {
  RotationInput input;
  input.euler_order = sensor_.euler_order;
  bool given = false;
  for (const auto& [name, fields] : quantities_) {
    double* target = input.find(name);
    if (!target) continue;
    given = true;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      target[i] = value(fields[i], row);
      if (!std::isfinite(target[i])) return drop_missing(fields, t);
      if (name != "magnetic_field" && !name.starts_with("quaternion"))
        angles_.note(name, fields[i].field.unit, target[i]);
    }
  }
  if (!given) {  // possible for truth only, whose orientation is optional
    row_.insert(row_.end(), {0, 0, 0, 1});
    return true;
  }
  // The orientation of a body in the world is converted by both sets of axes. The orientation of one body in another is
  // converted by the body axes only.
  const bool in_world = part == ImportPart::world_orientation;
  const auto q = rotation_of(input, sensor_.axes, in_world ? world_ : body_, body_);
  if (!q) return drop("a quaternion whose norm is not 1", t, input.norm());
  row_.insert(row_.end(), q->begin(), q->end());
  return true;
}

std::vector<double> ImportedSensor::stated_sigma() const {
  std::vector<double> sigma;
  for (const std::deque<float>& samples : variance_samples_) {
    if (samples.empty()) return {};
    std::vector<float> sorted(samples.begin(), samples.end());
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<long>(sorted.size() / 2), sorted.end());
    sigma.push_back(std::sqrt(static_cast<double>(sorted[sorted.size() / 2])));
  }
  const ImportPart part = sensor_.type->parts.front();
  if (part == ImportPart::range || part == ImportPart::direction) return sigma;
  // Each triple gets the order of the converted axes, as the values do.
  std::vector<double> converted = sigma;
  for (std::size_t first = 0; first + 3 <= sigma.size(); first += 3) {
    const AxisMap& axes = first == 0 && part == ImportPart::world_position ? world_ : body_;
    for (std::size_t i = 0; i < 3; ++i) converted[first + i] = sigma[first + std::size_t(axes.from[i])];
  }
  return converted;
}

std::optional<GeographicPoint> ImportedSensor::first_fix() const {
  if (!geographic_ || values_.empty()) return {};
  return GeographicPoint{values_[1], values_[2], values_[3]};
}

void ImportedSensor::finish(const std::optional<LocalFrame>& frame, double declination) {
  const std::size_t n = rows();
  if (geographic_ && frame)
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t at = i * width_ + 1;
      std::array<double, 3> p = frame->local({values_[at], values_[at + 1], values_[at + 2]});
      if (map_.ned) p = {p[1], p[0], -p[2]};
      std::copy(p.begin(), p.end(), values_.begin() + static_cast<long>(at));
    }
  if (needs_declination() && declination != 0)
    for (std::size_t i = 0; i < n; ++i) {
      const auto at = values_.begin() + static_cast<long>(i * width_ + static_cast<std::size_t>(orientation_));
      const auto q = turned_clockwise({at[0], at[1], at[2], at[3]}, declination, map_.ned);
      std::copy(q.begin(), q.end(), at);
    }
  current_ = nullptr;
  bool sorted = true;
  for (std::size_t i = 1; i < n && sorted; ++i) sorted = values_[(i - 1) * width_] < values_[i * width_];
  if (sorted) return;
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return values_[a * width_] < values_[b * width_]; });
  std::deque<double> in_order;
  for (const std::uint32_t i : order) {
    const double t = values_[i * width_];
    if (!in_order.empty() && t <= in_order[in_order.size() - width_]) {
      drop("the time of the row before", t);
      continue;
    }
    for (std::size_t c = 0; c < width_; ++c) in_order.push_back(values_[i * width_ + c]);
  }
  values_ = std::move(in_order);
}

void ImportedSensor::trim(double first, double last, const std::string& reason) {
  std::size_t begin = 0, end = rows();
  while (begin < end && t(begin) < first) {
    drop(reason, t(begin));
    ++begin;
  }
  while (end > begin && t(end - 1) > last) {
    drop(reason, t(end - 1));
    --end;
  }
  values_.erase(values_.begin() + static_cast<long>(end * width_), values_.end());
  values_.erase(values_.begin(), values_.begin() + static_cast<long>(begin * width_));
}

}  // namespace tandem
