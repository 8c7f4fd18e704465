#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/solvers/online/heading_alignment.hpp>
#include <tandem/studies/study/nees.hpp>
#include <tandem/studies/support/mahalanobis.hpp>
#include <tandem/studies/support/statistics.hpp>

namespace tandem {
namespace {

template <class T>
const T& at(const std::vector<Stamped<T>>& truth, double t) {
  for (const Stamped<T>& x : truth)
    if (std::abs(x.t - t) < kSameInstant) return x.value;
  throw Error(fmt::format("there is no truth at {:g} s", t));
}

}  // namespace

EgoNees nees(const SE23& truth, const Vector<6>& true_bias, const EgoState& state, const EgoCovariance& covariance) {
  const SE3 pose(truth.rotation(), truth.translation());
  return {squared_distance(minus(pose, state.pose), covariance.pose),
          squared_distance(truth.velocity() - state.velocity, covariance.velocity),
          squared_distance(true_bias - state.bias, covariance.bias)};
}

std::vector<EgoNees> nees_of_fixed_lag(const SimulatedDive& dive, const std::vector<double>& instants, double window) {
  OnlineOptions options;
  options.lag.window = window;
  OnlineEstimator estimator(TrackingData(), dive.data, options);
  std::vector<EgoNees> result;
  estimator.on_update = [&](const OnlineUpdate& update) {
    if (result.size() == instants.size() || !update.new_keyframe) return;
    const double t = instants[result.size()];
    if (std::abs(update.t - t) > kSameInstant) return;
    result.push_back(nees(at(dive.truth, t), at(dive.biases, t), estimator.chaser(), ego_covariance(estimator)));
  };
  replay(dive.data, HUGE_VAL, estimator);
  if (result.size() < instants.size())
    throw Error(fmt::format("there is no keyframe at {:g} s", instants[result.size()]));
  return result;
}

std::pair<double, double> chi_squared_band(int degrees, int n) {
  const double all = double(degrees) * n;
  return {chi_squared_quantile(all, 0.025) / n, chi_squared_quantile(all, 0.975) / n};
}

}  // namespace tandem
