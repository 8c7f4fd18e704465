#include <algorithm>

#include <fmt/format.h>

#include <tandem/studies/online/reported_sigma.hpp>
#include <tandem/studies/online/track_lines.hpp>
#include <tandem/studies/support/units.hpp>

namespace tandem {
namespace {

constexpr int kLinesPerHeader = 25;
constexpr int kPredictionWidth = 15;      // characters
constexpr double kMinCourseSpeed = 0.01;  // m/s, below which the course is undefined

/// Returns the compass angle of a direction in the world (x east, y north): clockwise from north, 0 to 360°.
double compass(const Vector<3>& direction) {
  const double a = std::atan2(direction.x(), direction.y()) * kDegrees;
  return a < 0 ? a + 360 : a;
}

Vector<3> forward(const SO3& R) { return R.act(Vector<3>(1, 0, 0)); }

std::string shown(double value, int width, int decimals) { return fmt::format("{:>{}.{}f}", value, width, decimals); }
std::string deviation(double sigma) {
  return std::isfinite(reported_sigma(sigma)) ? fmt::format("{:.2f}", sigma) : "∞";
}
std::string deviation(const Matrix<3, 3>& covariance) { return deviation(sigmas(covariance).norm()); }
std::string absent(int width) { return fmt::format("{:>{}}", "–", width); }

}  // namespace

std::optional<double> target_heading(const TrackRecord& record) {
  if (!record.target) return {};
  if (record.target->rotation) return compass(forward(*record.target->rotation)) / kDegrees;
  if (!(record.target_velocity.norm() > kMinCourseSpeed)) return {};
  return compass(record.target_velocity) / kDegrees;
}

std::string TrackLines::header() const {
  std::string predictions;
  if (target_)
    for (const double h : ahead_)
      predictions += fmt::format(" {:>{}}", fmt::format("in {:g} s [m]", h), kPredictionWidth);
  const auto line = [&](const auto&... cells) {
    return fmt::format("{:>10} {:>9} {:>11} {:>9} {:>11} {:>11} {:>8}{} {:>7} {:>11}  {}\n", cells...);
  };
  if (target_)
    return line("time [s]", "range [m]", "bearing [°]", "elev. [°]", "speed [m/s]", "heading [°]", "σ [m]", predictions,
                "window", "update [ms]", "health");
  return line("time [s]", "x [m]", "y [m]", "z [m]", "speed [m/s]", "heading [°]", "σ [m]", predictions, "window",
              "update [ms]", "health");
}

std::string TrackLines::prediction_cells(const TrackRecord& r) const {
  std::string text;
  for (std::size_t i = 0; i < ahead_.size(); ++i) {
    const auto& there = r.ahead[i];
    std::string cell = there ? fmt::format("{:.2f}", there->position.norm()) : "–";
    if (there && there->covariance) cell += " ± " + deviation(*there->covariance);
    text += fmt::format(" {:>{}}", cell, kPredictionWidth);
  }
  return text;
}

std::string TrackLines::target_cells(const TrackRecord& r) const {
  if (!r.target)
    return absent(9) + " " + absent(11) + " " + absent(9) + " " + absent(11) + " " + absent(11) + " " + absent(8);
  const Vector<3> p = r.relative();
  const double speed = r.target_velocity.norm();
  const double level = std::hypot(p.x(), p.y());
  std::string text = shown(p.norm(), 9, 2) + " " + shown(-std::atan2(p.y(), p.x()) * kDegrees, 11, 1) + " ";
  text += (planar_ ? absent(9) : shown(std::atan2(p.z(), level) * kDegrees, 9, 1)) + " " + shown(speed, 11, 2) + " ";
  const auto heading = target_heading(r);
  text += heading ? shown(*heading * kDegrees, 11, 1) : absent(11);
  return text + " " + (r.covariance ? fmt::format("{:>8}", deviation(*r.covariance)) : absent(8));
}

std::string TrackLines::health(const TrackRecord& r) {
  const std::size_t before = std::exchange(rejected_, r.health.rejected());
  const auto outputs_in = [&](OutputState state) {
    std::string text;
    for (const auto& [what, output] : {std::pair{"target", r.health.target}, {"chaser", r.health.chaser}})
      if (output.state == state)
        text += fmt::format("{}{} {}, no fix for {:.0f} s{}", text.empty() ? "" : "; ", what, name(state), output.age,
                            r.health.converged ? "" : ", unconverged");
    return text;
  };
  if (const std::string invalid = outputs_in(OutputState::invalid); !invalid.empty()) return invalid;
  if (!r.health.converged) return "unconverged";
  if (rejected_ > before) return fmt::format("{} rejected", rejected_ - before);
  const std::string lost = outputs_in(OutputState::lost);
  if (!lost.empty()) return lost;
  for (const auto& [what, output] : {std::pair{"target", r.health.target}, {"chaser", r.health.chaser}})
    if (output.state == OutputState::unconfirmed) return fmt::format("{} {}", what, name(output.state));
  return "ok";
}

std::string TrackLines::chaser_cells(const TrackRecord& r) const {
  const Vector<3> p = frame_.world(r.chaser).translation();
  return shown(p.x(), 9, 2) + " " + shown(p.y(), 11, 2) + " " + shown(p.z(), 9, 2) + " " +
         shown(r.chaser_velocity.norm(), 11, 2) + " " + shown(compass(forward(r.chaser.rotation())), 11, 1) + " " +
         (r.chaser_sigma ? fmt::format("{:>8}", deviation(*r.chaser_sigma)) : absent(8));
}

std::string TrackLines::operator()(const TrackRecord& record) {
  longest_ = std::max(longest_, record.seconds);
  if (record.t < second_) second_ = -HUGE_VAL;  // the time was reset
  if (!record.new_keyframe || !(std::floor(record.t) > second_)) return "";
  second_ = std::floor(record.t);
  std::string text = lines_++ % kLinesPerHeader == 0 ? header() : "";
  text += fmt::format("{:>10.2f} {}{} {:>7} {:>11.2f}  {}\n", record.t,
                      target_ ? target_cells(record) : chaser_cells(record), target_ ? prediction_cells(record) : "",
                      record.keyframes, 1e3 * longest_, health(record));
  longest_ = 0;
  return text;
}

}  // namespace tandem
