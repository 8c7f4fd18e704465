#include <algorithm>

#include <tandem/problem/navigation/reading_screen.hpp>

namespace tandem {
namespace {

constexpr double kZeroSigmas = 5;     // reach of exact zeros in standard deviations
constexpr std::size_t kFewRuns = 20;  // too few runs of equal values for a usual length
constexpr double kQuanta = 4;         // usual steps, in smallest steps, below which a value is coarse
constexpr double kStop = 0.1;         // share of the usual root of the steps below which the step into a run is small
constexpr std::size_t kSettled = 3;   // multiple of the thresholds after a small step
constexpr double kVaries = 0.5;       // smallest share of the usual root of the steps of an axis that varies
constexpr double kMaxRepeat = 5.0;    // s; normal duration of a repeated value, if EgoSensorTraits::may_repeat

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

void ReadingScreen::set_recording(const std::vector<Reading>& readings) {
  recorded_ = true;
  lines_ = readings.size();
  for (std::size_t i = 0; i < lines_; ++i) {
    runs_ += i == 0 || readings[i] != readings[i - 1];
    for (Eigen::Index k = 0; i > 0 && k < std::min(options_.axes, readings[i].size()); ++k)
      add_step(std::size_t(k), std::abs(readings[i][k] - readings[i - 1][k]));
  }
}

/// Adds a step between successive values of an axis to the usual ones.
void ReadingScreen::add_step(std::size_t axis, double step) {
  if (!(step > 0) || !std::isfinite(step)) return;
  Axis& of = axes_[axis];
  ++of.runs;
  of.usual_roots += std::sqrt(step);
  of.smallest = std::min(of.smallest, step);
}

std::size_t ReadingScreen::run() const { return stuck_ ? axes_[*stuck_].run.lines : run_.lines; }

void ReadingScreen::follow_axes(double t, const Reading& reading) {
  const std::size_t n = std::size_t(std::min(options_.axes, reading.size()));
  for (std::size_t k = 0; k < n; ++k) {
    Axis& axis = axes_[k];
    const double step = last_ ? std::abs(reading[Eigen::Index(k)] - (*last_)[Eigen::Index(k)]) : 0;
    const double before = axis.roots;
    if (std::isfinite(step)) axis.roots += std::sqrt(step);
    if (!recorded_) add_step(k, step);
    if (last_ && step == 0) {
      ++axis.run.lines;
    } else {
      axis.run = {1, t, {}};
      axis.run.roots_before[k] = before;
    }
  }
  for (std::size_t k = 0; k < n; ++k)
    if (axes_[k].run.lines == 1)
      for (std::size_t i = 0; i < n; ++i)
        if (i != k) axes_[k].run.roots_before[i] = axes_[i].roots;
}

/// Returns whether an axis repeats its value for unusually long while another one varies as usual. Coarse values, whose
/// usual steps are a few quanta, may repeat. A value that has settled may repeat for longer. Roots of the steps are
/// averaged, because outliers hardly change these.
bool ReadingScreen::is_stuck(std::size_t k, double t) const {
  const Axis& axis = axes_[k];
  if (!axis.run.lasts(t, options_) || axis.runs < kFewRuns || (*last_)[Eigen::Index(k)] == 0) return false;
  if (axis.usual_roots < std::sqrt(kQuanta * axis.smallest) * double(axis.runs)) return false;
  const bool settled = (axis.roots - axis.run.roots_before[k]) * double(axis.runs) < kStop * axis.usual_roots;
  const std::size_t lines = axis.run.lines / (settled ? kSettled : 1);
  if (lines < options_.frozen_lines) return false;
  if (!(double(lines) * double(axis.runs) > options_.run_ratio * double(lines_ - axis.run.lines))) return false;
  for (std::size_t i = 0; i < std::size_t(options_.axes); ++i)
    if (i != k && (axes_[i].roots - axis.run.roots_before[i]) * double(lines_) >
                      kVaries * axes_[i].usual_roots * double(axis.run.lines))
      return true;
  return false;
}

bool ReadingScreen::is_zero(const Reading& reading) const {
  if (options_.vector_rows == 0 || !reading.head(options_.vector_rows).isZero(0)) return false;
  return options_.zero_reach < 0 || last_length_ > options_.zero_reach;
}

bool ReadingScreen::is_frozen(double t) const {
  if (!run_.lasts(t, options_)) return false;
  if (recorded_ && runs_ <= 1) return !options_.may_be_constant;
  if (recorded_ && runs_ < kFewRuns) return true;
  if (!recorded_ && runs_ <= options_.min_runs) return false;
  return double(run_.lines) * double(runs_ - 1) > options_.run_ratio * double(lines_ - run_.lines);
}

std::optional<ReadingFault> ReadingScreen::judge(double t, const Reading& reading) {
  if (!reading.allFinite()) return ReadingFault::missing;
  if (!recorded_) ++lines_;
  follow_axes(t, reading);
  if (last_ && *last_ == reading) {
    ++run_.lines;
  } else {
    if (!recorded_) ++runs_;
    run_ = {1, t, {}};
    last_ = reading;
  }
  stuck_.reset();
  const double length = reading.head(options_.vector_rows).norm();
  if (!(length <= options_.max_magnitude)) return ReadingFault::out_of_range;
  if (is_zero(reading)) return ReadingFault::zero;
  if (is_frozen(t)) {
    // A vehicle at rest may read zero for long.
    if (options_.vector_rows == 0 || !reading.head(options_.vector_rows).isZero(0)) return ReadingFault::frozen;
  }
  for (std::size_t k = 0; k < std::size_t(options_.axes) && !stuck_; ++k)
    if (is_stuck(k, t)) stuck_ = k;
  if (stuck_) return ReadingFault::frozen;
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
  options.axes = options.vector_rows == 3 ? 3 : 0;
  if (sensor.sigma.size() > 0) options.zero_reach = kZeroSigmas * sensor.sigma.norm();
  options.may_be_constant = sensor.type->may_repeat;
  if (sensor.type->may_repeat) options.min_frozen_time = kMaxRepeat;
  return options;
}

}  // namespace tandem
