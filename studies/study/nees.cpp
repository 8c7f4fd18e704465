#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/solvers/online/heading_alignment.hpp>
#include <tandem/studies/study/nees.hpp>
#include <tandem/studies/support/squared_distance.hpp>

namespace tandem {
namespace {

template <class T>
const T& at(const std::vector<Stamped<T>>& truth, double t) {
  for (const Stamped<T>& x : truth)
    if (std::abs(x.t - t) < kSameInstant) return x.value;
  throw Error(fmt::format("there is no truth at {:g} s", t));
}

/// By Wilson & Hilferty 1931, to 1e-4 of it from 30 degrees of freedom on.
double chi_squared_quantile(double degrees, double normal_quantile) {
  const double s = 2 / (9 * degrees);
  return degrees * std::pow(1 - s + normal_quantile * std::sqrt(s), 3);
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
  constexpr double z = 1.959964;
  const double all = double(degrees) * n;
  return {chi_squared_quantile(all, -z) / n, chi_squared_quantile(all, z) / n};
}

}  // namespace tandem
