#pragma once

#include <map>
#include <string>
#include <variant>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/problem/tracking/tracking_start.hpp>
#include <tandem/residuals/outside.hpp>

namespace tandem::detail {

/// What the parts of the tracking builder share, over poses G (SE3 or SE2). Each adds what joins the problem with
/// keyframe k, and reads no later one: all keyframes of a recording one after the other, or each as it comes, in a window
/// whose first keyframes are dropped.
template <LieGroup G>
struct TrackingBuild {
  using Point = Rn<G::point_dim>;
  using State = std::variant<Variable<G>, Variable<Point>, CourseVariable<G>>;
  static constexpr bool planar = G::point_dim == 2;

  const TrackingData& data;
  const TrackingOptions& options;
  Problem& problem;
  TrackingProblem& out;
  std::vector<SE3> odometry;  ///< at the keyframes
  TargetStart start;
  std::vector<Variable<G>> chaser{};
  std::vector<State> target{};
  std::vector<std::optional<Variable<Point>>> twin{};  ///< Mode B: the point at a pose that is next to one
  std::vector<Variable<Rn<G::dof>>> twist{};           ///< white noise on acceleration
  /// The bias of a sensor's StayingError, of as many rows as its residual has.
  struct SensorBias {
    double t;  ///< s, when it was measured with
    std::variant<Variable<Rn<1>>, Variable<Rn<2>>, Variable<Rn<3>>, Variable<Rn<6>>> state;
  };
  std::map<std::size_t, SensorBias> biases{};  ///< the newest of each sensor that has one, by its place in the data
  SensorConstants constants{};
  /// In place of a sensor's delay as a state, in what is added now: fixed at what it is taken to be.
  std::optional<Variable<Rn<1>>> held_delay{};

  std::size_t size() const { return out.keyframes.size(); }
  double dt(std::size_t from, std::size_t to) const { return out.keyframes[to].t - out.keyframes[from].t; }
  const Variable<G>* pose(std::size_t k) const { return std::get_if<Variable<G>>(&target[k]); }
  /// What a velocity reads of the target at k: its point, where there is one.
  std::variant<Variable<G>, Variable<Point>> pose_or_point(std::size_t k) const {
    if (twin[k]) return *twin[k];
    if (pose(k)) return *pose(k);
    return std::get<Variable<Point>>(target[k]);
  }

  /// The chaser's variable, unless it has one already, and the target's.
  void add_variables(std::size_t k);
  void add_course_variables();
  void add_twin(std::size_t k);
  /// The prior on the first chaser pose, odometry to the later ones.
  void add_odometry(std::size_t k);
  /// Measurement `i` of a sensor, at keyframe k.
  void add_measurement(std::size_t sensor, std::size_t i, std::size_t k);
  /// The same, of an instant between k and the keyframe after it.
  void add_measurement_after(std::size_t sensor, std::size_t i, std::size_t k);
  /// The bias of a sensor at t, tied to the one before, unless that is of this instant or constant.
  const SensorBias& bias_at(std::size_t sensor, double t);
  /// The motion up to k.
  void add_motion(std::size_t k);
  /// Constant or damped twist over three poses, constant or damped velocity over any other triple, at each of the
  /// horizons that ends at `last`.
  void add_triples(std::size_t last);
  /// The constraints of the target's pose at k and of its twist up to there.
  void add_constraints(std::size_t k);

  /// Whether the target is, or is to be, a pose and not a point. What was measured at k later changes nothing.
  bool is_pose(std::size_t k) const {
    if (k < target.size()) return pose(k) != nullptr;
    return !without_orientation(options.model) &&
           (options.mode == Mode::A || out.keyframes[k].type == KeyframeType::optical);
  }

  template <int N>
  void add_bias(std::size_t sensor, double t);

  /// Adds a cost whose noise is that of an entry of TrackingNoise.
  template <Residual R>
  void minimize(const R& residual, std::string_view entry, const Gaussian& noise, const VariablesOf<R>& x) {
    out.noised.push_back({std::string(entry), problem.minimize(residual, noise, x)});
  }
  template <Residual R>
  void hold_zero(const R& residual, Role role, std::string_view entry, const Gaussian& noise, const VariablesOf<R>& x) {
    if (role == Role::hard) problem.subject_to(residual, equal_to(0), x);
    if (role == Role::soft) minimize(residual, entry, noise, x);
  }
  template <Residual R>
  void hold_between(const R& residual, Role role, const Bounds<R::dim>& bounds, std::string_view entry,
                    const Gaussian& noise, const VariablesOf<R>& x) {
    if (role == Role::hard) problem.subject_to(residual, bounds, x);
    if (role == Role::soft) minimize(Outside<R>(residual, bounds), entry, noise, x);
  }
};

/// How far to either side of a measurement motion is read for its sensor's delay to be a state [s]. Longer, turns between
/// keyframes are not seen; shorter, their noise stands for motion, and a delay that fixes do not tell seems told: two
/// deviations made a standard error of 0.08 s out of nothing (simulated dockings), where twelve make a true delay 3 % too
/// long (SensorConstants).
inline double delay_reach(const StayingError& error) {
  constexpr double kDelays = 6;  // standard deviations of the delay
  return kDelays * error.delay;
}

/// Standard deviations by name; throws Error when they are not `size` positive numbers.
Gaussian noise_of(std::string_view name, const Eigen::VectorXd& sigma, int size);

}  // namespace tandem::detail
