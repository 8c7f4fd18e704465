#include <algorithm>

#include <tandem/problem/navigation/dvl_factors.hpp>
#include <tandem/residuals/preintegrated_dvl.hpp>

namespace tandem {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

}  // namespace

void DvlFactors::add(const Reading& reading, const Context& context) {
  const auto after = std::upper_bound(readings_.begin(), readings_.end(), reading.t,
                                      [](double t, const Reading& r) { return t < r.t; });
  const auto at = static_cast<std::size_t>(after - readings_.begin());
  readings_.insert(after, reading);
  if (factors_.empty() || reading.t >= factors_.back().to.t) return;
  rebuild_between(at > 0 ? readings_[at - 1].t : reading.t, end_of(at), context);
}

void DvlFactors::connect(const DvlKeyframe& from, const DvlKeyframe& to, const Context& context) {
  factors_.push_back({from, to});
  const std::size_t first = reading_at(from.t);
  rebuild_between(first == kNone ? from.t : readings_[first].t, to.t, context);
}

void DvlFactors::drop_before(double t) {
  while (!factors_.empty() && factors_.front().from.t < t) factors_.pop_front();
  while (readings_.size() > 1 && readings_[1].t <= t) readings_.pop_front();
}

/// Returns the index of the last reading at or before t, or kNone.
std::size_t DvlFactors::reading_at(double t) const {
  const auto after =
      std::upper_bound(readings_.begin(), readings_.end(), t, [](double x, const Reading& r) { return x < r.t; });
  return after == readings_.begin() ? kNone : static_cast<std::size_t>(after - readings_.begin()) - 1;
}

/// Returns the time until which a reading holds [s], at most the time of the last keyframe.
double DvlFactors::end_of(std::size_t reading) const {
  const double next = reading + 1 < readings_.size() ? readings_[reading + 1].t : factors_.back().to.t;
  return std::min(next, readings_[reading].t + max_age_);
}

DvlReading DvlFactors::preintegrator_input(std::size_t reading, const Context& context) const {
  const Reading& r = readings_[reading];
  return {r.velocity, context.sensors[r.sensor].sigma, end_of(reading) - r.t};
}

/// Returns whether readings hold without a gap between two times.
bool DvlFactors::covers(double from, double to) const {
  for (std::size_t i = reading_at(from); i < readings_.size(); ++i) {
    if (end_of(i) >= to) return true;
    if (i + 1 == readings_.size() || end_of(i) < readings_[i + 1].t) return false;
  }
  return false;
}

/// Rebuilds the factors that overlap an interval of time.
void DvlFactors::rebuild_between(double from, double to, const Context& context) {
  for (auto factor = factors_.rbegin(); factor != factors_.rend() && factor->to.t > from; ++factor)
    if (factor->from.t < to) rebuild(*factor, context);
}

void DvlFactors::rebuild(Factor& factor, const Context& context) const {
  const auto& from = factor.from;
  const auto& to = factor.to;
  if (factor.block) context.problem.remove(*factor.block);
  factor.block.reset();
  if (!covers(from.t, to.t)) return;
  std::size_t next = reading_at(from.t);
  const EgoSensor& sensor = context.sensors[readings_[next].sensor];
  DvlPreintegrator sum(preintegrator_input(next++, context), context.imu.noise().gyroscope);
  context.imu.each_interval(from.t, to.t, [&](const ImuSample& a, const ImuSample& b) {
    const Vector<3> rate = 0.5 * (a.angular_rate + b.angular_rate) - from.gyroscope_bias;
    const Vector<3> in_body = context.imu.mount().rotation().act(rate);
    double t = a.t;
    for (; next < readings_.size() && readings_[next].t < b.t; ++next) {
      sum.advance(in_body, readings_[next].t - t);
      t = readings_[next].t;
      sum.measure(preintegrator_input(next, context));
    }
    sum.advance(in_body, b.t - t);
  });
  factor.block = context.problem.minimize(PreintegratedDvl{sum.displacement()}, Gaussian::covariance(sum.covariance()),
                                          {from.pose, to.pose}, sensor.loss.value_or(loss_));
}

}  // namespace tandem
