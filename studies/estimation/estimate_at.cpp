#include <cmath>

#include <tandem/problem/tracking/tracking_trajectory.hpp>
#include <tandem/solvers/heading_search/range_observability.hpp>
#include <tandem/studies/estimation/estimate_at.hpp>
#include <tandem/studies/estimation/uncertainty.hpp>
#include <tandem/studies/navigation/ego_covariance.hpp>

namespace tandem {
namespace {

/// Gives infinite variances to what is unknown if only the directions of the target are known: the components of its
/// position along `sight` (in the world), and its velocity.
void add_unknown_range(const Vector<3>& sight, MotionInstant& target) {
  const Eigen::Index n = target.twist.size(), axes = target.rotation ? (n == 6 ? 3 : 2) : n;
  const Vector<3> in_axes = target.rotation ? target.rotation->inverse().act(sight) : sight;
  tandem::add_unknown_range(in_axes, target.covariance.topLeftCorner(n, n));
  target.covariance.diagonal().segment(n, axes).setConstant(HUGE_VAL);
}

}  // namespace

void add_pairs_at(const std::vector<double>& times, const TrackingProblem& tracking, const TrackingData& data,
                  const TrackingOptions& options, std::vector<Marginals::Pair>& pairs) {
  const TrackingTrajectory trajectory(tracking, data, options);
  const auto record = [&](const Eigen::MatrixXd& J, const std::vector<int>& ids, const std::vector<int>&) {
    for (auto b = ids.begin(); b != ids.end(); ++b)
      for (auto a = ids.begin(); a != b; ++a) pairs.emplace_back(*a, *b);
    return Eigen::MatrixXd(Eigen::MatrixXd::Zero(J.rows(), J.rows()));
  };
  for (const double t : times)
    if (why_outside(t, tracking.keyframes.front().t, tracking.keyframes.back().t).empty()) trajectory.at(t, record);
}

std::vector<StateAt> states_at(const std::vector<double>& times, const TrackingProblem& tracking,
                               const TrackingData& data, const TrackingOptions& options, const Marginals* marginals,
                               const Stop& stop) {
  std::vector<StateAt> states;
  if (times.empty()) return states;
  const TrackingTrajectory trajectory(tracking, data, options);
  const PropagateCovariance propagate = propagate_by(marginals);
  const bool has_range = !marginals || range_is_observable(tracking, *marginals);
  for (const double t : times) {
    stop.check("states at the times of --at");
    StateAt& state = states.emplace_back(StateAt{.t = t});
    state.note = why_outside(t, trajectory.first(), trajectory.last());
    if (!state.note.empty()) continue;
    TrackedInstant instant = trajectory.at(t, propagate);
    if (!has_range) {
      const SE3 chaser(instant.chaser.rotation.value(), instant.chaser.position);
      const TargetSensor& sensor = data.sensors[tracking.assumed_range->sensor];
      add_unknown_range(instant.target.position - chaser.act(sensor.mount.translation()), instant.target);
    }
    state.chaser = std::move(instant.chaser);
    state.target = std::move(instant.target);
  }
  return states;
}

}  // namespace tandem
