#include <algorithm>
#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/studies/rendezvous/coupled_window.hpp>

namespace tandem {
namespace {

constexpr double kSameKeyframe = 1e-3;  // s
constexpr double kTwistInterval = 1.0;  // s: time between the two keyframes that define the target's current motion

}  // namespace

CoupledWindow::CoupledWindow(const TrackingData& sensors, const TrackingOptions& options, double seconds)
    : data_(sensors), options_(options), seconds_(seconds) {
  data_.odometry.clear();
  for (TargetSensor& sensor : data_.sensors) sensor.measurements.clear();
}

void CoupledWindow::drop_old_data() {
  if (data_.odometry.empty()) return;
  const double begin = data_.odometry.back().t - seconds_ - kSameKeyframe;
  std::erase_if(data_.odometry, [&](const Stamped<SE3>& pose) { return pose.t < begin; });
  for (TargetSensor& sensor : data_.sensors)
    std::erase_if(sensor.measurements, [&](const Measurement& m) { return m.t < begin; });
}

/// Sets the initial guess from the previous solution. New keyframes extrapolate the target with its last twist and the
/// chaser with odometry.
void CoupledWindow::warm_start() {
  if (previous_.size() < 2) return;
  const PreviousState &before = *(previous_.end() - 2), &newest = previous_.back();
  const Vector<6> twist = (before.target.inverse() * newest.target).Log() / (newest.t - before.t);
  std::optional<SE3> anchor;
  for (std::size_t k = 0; k < tracking_->keyframes.size(); ++k) {
    const double t = tracking_->keyframes[k].t;
    const auto chaser = std::get<Variable<SE3>>(tracking_->chaser[k]);
    const auto target = std::get<Variable<SE3>>(tracking_->target[k]);
    const auto at = std::find_if(previous_.begin(), previous_.end(),
                                 [&](const PreviousState& known) { return std::abs(known.t - t) < kSameKeyframe; });
    const SE3 odometry = tracking_->problem.value(chaser);
    if (at != previous_.end()) {
      anchor = at->chaser * odometry.inverse();
      tracking_->problem.set_value(target, at->target);
    } else if (t > newest.t) {
      tracking_->problem.set_value(target, newest.target * SE3::Exp((t - newest.t) * twist));
    }
    if (anchor) tracking_->problem.set_value(chaser, *anchor * odometry);
  }
}

std::optional<CoupledEstimate> CoupledWindow::estimate() {
  drop_old_data();
  tracking_.reset();
  try {
    tracking_.emplace(make_tracking_problem(data_, options_));
  } catch (const Error&) {  // too little data for a problem
    return {};
  }
  warm_start();
  const std::size_t now = tracking_->keyframes.size() - 1;
  if (now == 0 || !solve(tracking_->problem, GaussNewtonOptions{}).converged()) return {};
  previous_.clear();
  for (std::size_t k = 0; k <= now; ++k)
    previous_.push_back({tracking_->keyframes[k].t, tracking_->chaser_pose(k),
                         tracking_->problem.value(std::get<Variable<SE3>>(tracking_->target[k]))});
  std::size_t before = now - 1;
  while (before > 0 && tracking_->keyframes[now].t - tracking_->keyframes[before].t < kTwistInterval - kSameKeyframe)
    --before;
  return CoupledEstimate{tracking_->problem,
                         std::get<Variable<SE3>>(tracking_->chaser[now]),
                         std::get<Variable<SE3>>(tracking_->target[before]),
                         std::get<Variable<SE3>>(tracking_->target[now]),
                         tracking_->keyframes[now].t - tracking_->keyframes[before].t,
                         data_.noise.constant_twist};
}

}  // namespace tandem
