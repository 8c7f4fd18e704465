#include <algorithm>

#include <tandem/problem/navigation/dvl_factors.hpp>
#include <tandem/residuals/preintegrated_dvl.hpp>

namespace tandem {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

}  // namespace

void DvlFactors::add(const Reading& reading, const Into& into) {
  const auto after = std::upper_bound(readings_.begin(), readings_.end(), reading.t,
                                      [](double t, const Reading& r) { return t < r.t; });
  const auto at = static_cast<std::size_t>(after - readings_.begin());
  readings_.insert(after, reading);
  if (factors_.empty() || reading.t >= factors_.back().to.t) return;
  make_between(at > 0 ? readings_[at - 1].t : reading.t, end_of(at), into);
}

void DvlFactors::tie(const DvlKeyframe& from, const DvlKeyframe& to, const Into& into) {
  factors_.push_back({from, to});
  const std::size_t first = holding_at(from.t);
  make_between(first == kNone ? from.t : readings_[first].t, to.t, into);
}

void DvlFactors::drop_before(double t) {
  while (!factors_.empty() && factors_.front().from.t < t) factors_.pop_front();
  while (readings_.size() > 1 && readings_[1].t <= t) readings_.pop_front();
}

/// The last reading up to t.
std::size_t DvlFactors::holding_at(double t) const {
  const auto after =
      std::upper_bound(readings_.begin(), readings_.end(), t, [](double x, const Reading& r) { return x < r.t; });
  return after == readings_.begin() ? kNone : static_cast<std::size_t>(after - readings_.begin()) - 1;
}

/// Until when a reading holds, as far as keyframes go.
double DvlFactors::end_of(std::size_t reading) const {
  const double next = reading + 1 < readings_.size() ? readings_[reading + 1].t : factors_.back().to.t;
  return std::min(next, readings_[reading].t + greatest_age_);
}

DvlReading DvlFactors::as_held(std::size_t reading, const Into& into) const {
  const Reading& r = readings_[reading];
  return {r.velocity, into.sensors[r.sensor].sigma, end_of(reading) - r.t};
}

bool DvlFactors::covered(double from, double to) const {
  for (std::size_t i = holding_at(from); i < readings_.size(); ++i) {
    if (end_of(i) >= to) return true;
    if (i + 1 == readings_.size() || end_of(i) < readings_[i + 1].t) return false;
  }
  return false;
}

/// Makes the factors anew that reach into a span of time.
void DvlFactors::make_between(double from, double to, const Into& into) {
  for (auto factor = factors_.rbegin(); factor != factors_.rend() && factor->to.t > from; ++factor)
    if (factor->from.t < to) make(*factor, into);
}

void DvlFactors::make(Factor& factor, const Into& into) const {
  const auto& from = factor.from;
  const auto& to = factor.to;
  if (factor.block) into.problem.remove(*factor.block);
  factor.block.reset();
  if (!covered(from.t, to.t)) return;
  std::size_t next = holding_at(from.t);
  const EgoSensor& sensor = into.sensors[readings_[next].sensor];
  DvlPreintegrator sum(as_held(next++, into), into.imu.noise().gyroscope);
  into.imu.each_interval(from.t, to.t, [&](const ImuSample& a, const ImuSample& b) {
    const Vector<3> rate = 0.5 * (a.angular_rate + b.angular_rate) - from.gyroscope_bias;
    const Vector<3> in_body = into.imu.mount().rotation().act(rate);
    double t = a.t;
    for (; next < readings_.size() && readings_[next].t < b.t; ++next) {
      sum.advance(in_body, readings_[next].t - t);
      t = readings_[next].t;
      sum.measure(as_held(next, into));
    }
    sum.advance(in_body, b.t - t);
  });
  factor.block = into.problem.minimize(PreintegratedDvl{sum.displacement()}, Gaussian::covariance(sum.covariance()),
                                       {from.pose, to.pose}, sensor.loss.value_or(loss_));
}

}  // namespace tandem
