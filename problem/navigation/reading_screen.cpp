#include <tandem/problem/navigation/reading_screen.hpp>

namespace tandem {
namespace {

constexpr double kZeroSigmas = 5;   // reach of exact zeros in standard deviations
constexpr double kMaxRepeat = 5.0;  // s; normal duration of a repeated value, if EgoSensorTraits::may_repeat

}  // namespace

std::string_view text(ReadingFault fault) {
  switch (fault) {
    case ReadingFault::missing:
      return "with NaN, infinite numbers or a marker of missing data";
    case ReadingFault::out_of_range:
      return "with values that no such sensor reads";
    case ReadingFault::zero:
      return "with exact zeros, which mark missing data";
    case ReadingFault::frozen:
      break;
  }
  return "with a repeated value; the sensor may be stuck";
}

void ReadingScreen::set_runs(std::size_t lines, std::size_t runs) {
  recorded_ = true;
  lines_ = lines;
  runs_ = runs;
}

bool ReadingScreen::is_zero(const Reading& reading) const {
  if (options_.vector_rows == 0 || !reading.head(options_.vector_rows).isZero(0)) return false;
  return options_.zero_reach < 0 || last_length_ > options_.zero_reach;
}

bool ReadingScreen::is_frozen(double t) const {
  constexpr std::size_t kFewRuns = 20;
  if (run_ < options_.frozen_lines || t - run_begin_ < options_.min_frozen_time) return false;
  if (recorded_ && runs_ <= 1) return !options_.may_be_constant;
  if (recorded_ && runs_ < kFewRuns) return true;  // too few runs for a usual length
  if (!recorded_ && runs_ <= options_.min_runs) return false;
  return double(run_) * double(runs_ - 1) > options_.run_ratio * double(lines_ - run_);
}

std::optional<ReadingFault> ReadingScreen::judge(double t, const Reading& reading) {
  if (!reading.allFinite()) return ReadingFault::missing;
  if (!recorded_) ++lines_;
  if (last_ && *last_ == reading) {
    ++run_;
  } else {
    if (!recorded_) ++runs_;
    run_ = 1;
    run_begin_ = t;
    last_ = reading;
  }
  const double length = reading.head(options_.vector_rows).norm();
  if (!(length <= options_.max_magnitude)) return ReadingFault::out_of_range;
  if (is_zero(reading)) return ReadingFault::zero;
  if (is_frozen(t)) {
    // A vehicle at rest may read zero for long.
    if (options_.vector_rows == 0 || !reading.head(options_.vector_rows).isZero(0)) return ReadingFault::frozen;
  }
  last_length_ = length;
  return {};
}

Reading reading(EgoSensorType type, const EgoMeasurement& m) {
  switch (type->reading) {
    case EgoReading::world_height:
      return m.value.tail<1>();
    case EgoReading::orientation:
      if (!m.value.allFinite()) return m.value;  // a missing orientation
      return m.rotation.quaternion().coeffs();
    default:
      return m.value;
  }
}

ReadingScreen::Options screen_options(const EgoSensor& sensor) {
  ReadingScreen::Options options;
  options.max_magnitude = sensor.type->max_magnitude;
  const EgoReading reading = sensor.type->reading;
  options.vector_rows = reading == EgoReading::orientation ? 0 : reading == EgoReading::world_height ? 1 : 3;
  if (sensor.sigma.size() > 0) options.zero_reach = kZeroSigmas * sensor.sigma.norm();
  options.may_be_constant = sensor.type->may_repeat;
  if (sensor.type->may_repeat) options.min_frozen_time = kMaxRepeat;
  return options;
}

}  // namespace tandem
