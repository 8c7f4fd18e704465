#pragma once

#include <concepts>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include <tandem/problem/tracking/tracking_initial_guess.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/residuals/soft_bound.hpp>

namespace tandem::detail {

/// State that the parts of the tracking builder share, for poses G (SE3 or SE2). The functions for keyframe k read no
/// later keyframes. Therefore they serve a whole recording as well as a sliding window that drops its first keyframes.
template <LieGroup G>
struct TrackingBuild {
  using Point = Rn<G::point_dim>;
  using State = std::variant<Variable<G>, Variable<Point>, CourseVariable<G>>;
  static constexpr bool planar = G::point_dim == 2;

  const TrackingData& data;
  const TrackingOptions& options;
  Problem& problem;
  TrackingProblem& out;
  std::vector<SE3> odometry;  ///< odometry at the keyframes
  TargetGuess guess;
  std::vector<Variable<G>> chaser{};
  std::vector<State> target{};
  std::vector<std::optional<Variable<Point>>>
      boundary_point{};                       ///< Mode B: point at the position of a pose whose neighbour is a point
  std::vector<Variable<Rn<G::dof>>> twist{};  ///< only for white noise on acceleration
  /// State of a sensor's bias (SystematicError).
  struct SensorBias {
    double t;  ///< time of the first measurement that reads it [s]
    std::variant<Variable<Rn<1>>, Variable<Rn<2>>, Variable<Rn<3>>, Variable<Rn<6>>> state;
  };
  std::map<std::size_t, SensorBias> biases{};  ///< newest bias state, by index in TrackingData::sensors
  SensorConstants constants{};
  /// If set, a fixed variable that new measurements read instead of the estimated delay of their sensor.
  std::optional<Variable<Rn<1>>> fixed_delay{};

  std::size_t size() const { return out.keyframes.size(); }
  double dt(std::size_t from, std::size_t to) const { return out.keyframes[to].t - out.keyframes[from].t; }
  const Variable<G>* pose(std::size_t k) const { return std::get_if<Variable<G>>(&target[k]); }
  /// Returns the target at k as a pose or as a point, or null. A pose next to a point has both.
  template <LieGroup T>
  const Variable<T>* target_at(std::size_t k) const {
    if constexpr (std::same_as<T, Point>)
      if (boundary_point[k]) return &*boundary_point[k];
    return std::get_if<Variable<T>>(&target[k]);
  }
  /// Returns the variable that a velocity reads at k: the point, if there is one, or else the pose.
  std::variant<Variable<G>, Variable<Point>> pose_or_point(std::size_t k) const {
    if (const Variable<Point>* point = target_at<Point>(k)) return *point;
    return std::get<Variable<G>>(target[k]);
  }

  /// Adds the target's variables at k, and the chaser's unless it exists.
  void add_variables(std::size_t k);
  /// Adds the variables of a target on a steady course, and the chaser's at all keyframes.
  void add_course_variables();
  void add_boundary_point(std::size_t k);
  /// Adds the prior on the chaser's first pose, or the odometry from k − 1 to k.
  void add_odometry(std::size_t k);
  /// Adds measurement `i` of a sensor at keyframe k.
  void add_measurement(std::size_t sensor, std::size_t i, std::size_t k);
  /// Adds AssumedRange if only bearings have been added.
  void assume_range();
  /// Adds measurement `i` of a sensor at its time of validity, between keyframes k and k + 1.
  void add_measurement_after(std::size_t sensor, std::size_t i, std::size_t k);
  /// Returns the bias state of a sensor at t. Adds it, unless the bias is constant or the newest state is at t already.
  const SensorBias& bias_at(std::size_t sensor, double t);
  /// Adds the motion model of the target up to k.
  void add_motion(std::size_t k);
  /// Adds the triple of each horizon that ends at `last`. Constant or damped twist applies to three poses; constant or
  /// damped velocity applies to all other triples.
  void add_triples(std::size_t last);
  /// Adds the constraints on the target's pose at k and on its twist from k − 1 to k.
  void add_constraints(std::size_t k);

  /// Returns whether the target at k is a pose, not a point. This does not change once its variable exists.
  bool is_pose(std::size_t k) const {
    if (k < target.size()) return pose(k) != nullptr;
    return !is_point_model(options.model) && (options.mode == Mode::A || out.keyframes[k].type == KeyframeType::pose);
  }

  template <int N>
  void add_bias(std::size_t sensor, double t);

  /// Adds a cost and records the entry of TrackingNoise that gives its noise.
  template <Residual R>
  void minimize(const R& residual, std::string_view entry, const Gaussian& noise, const VariablesOf<R>& x) {
    out.noise_blocks.push_back({std::string(entry), problem.minimize(residual, noise, x)});
  }
  template <Residual R>
  void constrain_to_zero(const R& residual, Role role, std::string_view entry, const Gaussian& noise,
                         const VariablesOf<R>& x) {
    if (role == Role::hard) problem.subject_to(residual, equal_to(0), x);
    if (role == Role::soft) minimize(residual, entry, noise, x);
  }
  template <Residual R>
  void constrain_to_bounds(const R& residual, Role role, const Bounds<R::dim>& bounds, std::string_view entry,
                           const Gaussian& noise, const VariablesOf<R>& x) {
    if (role == Role::hard) problem.subject_to(residual, bounds, x);
    if (role == Role::soft) minimize(SoftBound<R>(residual, bounds), entry, noise, x);
  }
};

/// Returns Gaussian noise. Throws Error, which mentions `name`, if `sigma` is not `size` positive finite numbers.
Gaussian noise_of(std::string_view name, const Eigen::VectorXd& sigma, int size);

}  // namespace tandem::detail
