#include <algorithm>
#include <cmath>
#include <numeric>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/tracking_motion.hpp>
#include <tandem/problem/tracking/tracking_trajectory.hpp>
#include <tandem/residuals/steady_course.hpp>

namespace tandem {
namespace {

/// States that an interpolation depends on, and the derivatives of its arguments with respect to them.
struct Arguments {
  std::vector<int> ids, dofs;
  std::vector<Eigen::MatrixXd> by_state;

  void add(int id, Eigen::MatrixXd by) {
    ids.push_back(id);
    dofs.push_back(int(by.cols()));
    by_state.push_back(std::move(by));
  }
  /// Returns the covariance of an interpolated motion.
  template <LieGroup G>
  Eigen::MatrixXd covariance(const InterpolatedMotion<G>& motion, const PropagateCovariance& propagate) const {
    if (!propagate) return {};
    Eigen::MatrixXd J(2 * G::dof, std::accumulate(dofs.begin(), dofs.end(), 0));
    for (std::size_t s = 0, from = 0, to = 0; s < ids.size(); ++s) {
      const Eigen::MatrixXd& by = by_state[s];
      J.middleCols(Eigen::Index(to), by.cols()) = motion.jacobian.middleCols(Eigen::Index(from), by.rows()) * by;
      from += std::size_t(by.rows());
      to += std::size_t(by.cols());
    }
    return propagate(J, ids, dofs) + motion.bridge;
  }
};

template <LieGroup G>
const Variable<G>* pose_of(const TargetVariable& x) {
  return std::get_if<Variable<G>>(&x);
}

/// Returns the motion `since` seconds after the first pose of a steady course.
template <LieGroup G>
InterpolatedMotion<G> on_course(const Problem& problem, const CourseVariable<G>& course, double since,
                                Arguments& arguments) {
  constexpr int n = G::dof;
  arguments.add(problem.id(course.first), G::Jacobian::Identity());
  arguments.add(problem.id(course.speed), Eigen::MatrixXd::Identity(1, 1));
  const double speed = problem.value(course.speed).vector()[0];
  const G way = steady_course_motion<G>(since, speed);
  const typename G::Tangent ahead = G::Tangent::Unit(0);
  InterpolatedMotion<G> motion{problem.value(course.first) * way, speed * ahead, Eigen::MatrixXd::Zero(2 * n, n + 1)};
  motion.jacobian.topLeftCorner(n, n) = way.inverse().Ad();
  motion.jacobian.col(n) << since * ahead, ahead;
  return motion;
}

/// Appends the position of a pose or a point.
template <LieGroup G>
Rn<G::point_dim> add_point(const Problem& problem, const TargetVariable& x, Arguments& arguments) {
  using Point = Rn<G::point_dim>;
  const Vector<G::point_dim> origin = Vector<G::point_dim>::Zero();
  if (const auto* pose = pose_of<G>(x)) {
    const G& value = problem.value(*pose);
    arguments.add(problem.id(*pose), value.act_jacobian(origin));
    return Point(value.act(origin));
  }
  const auto& point = std::get<Variable<Point>>(x);
  arguments.add(problem.id(point), Eigen::MatrixXd::Identity(Point::dof, Point::dof));
  return problem.value(point);
}

template <LieGroup G>
MotionInstant instant_of(const InterpolatedMotion<G>& motion, Eigen::MatrixXd covariance) {
  if constexpr (requires { motion.pose.vector(); }) {
    return {in_space(motion.pose), {}, motion.twist, std::move(covariance)};
  } else {
    const SE3 pose = in_space(motion.pose);
    return {pose.translation(), pose.rotation(), motion.twist, std::move(covariance)};
  }
}

/// Interpolates by `damped` the up to four states around keyframe k for which `usable(k)` holds. `add(k)` returns a
/// state and appends its arguments.
template <LieGroup X, class Usable, class Add>
InterpolatedMotion<X> damped(std::span<const Keyframe> keyframes, std::size_t k, const Vector<X::dof>& sigma,
                             const Vector<X::dof>& time, double t, Usable usable, Add add) {
  std::size_t begin = k, end = k + 2;
  if (k > 0 && usable(k - 1)) --begin;
  if (end < keyframes.size() && usable(end)) ++end;
  std::vector<X> states;
  std::vector<double> times;
  for (std::size_t i = begin; i < end; ++i) {
    states.push_back(add(i));
    times.push_back(keyframes[i].t);
  }
  return interpolate_damped<X>(states, times, k - begin, sigma, time, t);
}

}  // namespace

TrackingTrajectory::TrackingTrajectory(const TrackingProblem& tracking, const TrackingData& data,
                                       const TrackingOptions& options)
    : TrackingTrajectory({tracking.problem, tracking.keyframes, tracking.chaser, tracking.target, tracking.twist},
                         data.noise, data.odometry, options) {
  if (!data.ego) return;
  const NavigationData& own = data.ego->data;
  if (own.imu) imu_ = record_of(*own.imu);
  ego_.emplace(tracking.problem, tracking.ego, imu_ ? &*imu_ : nullptr, own.earth, data.ego->options);
}

TrackedInstant TrackingTrajectory::at(double t, const PropagateCovariance& propagate) const {
  return {t, chaser_at(t, propagate), target_at(t, propagate)};
}

MotionInstant TrackingTrajectory::chaser_at(double t, const PropagateCovariance& propagate) const {
  if (ego_) return ego_->at(t, propagate);
  const bool planar = !states_.chaser.empty() && std::holds_alternative<Variable<SE2>>(states_.chaser[0]);
  return planar ? chaser<SE2>(t, propagate) : chaser<SE3>(t, propagate);
}

MotionInstant TrackingTrajectory::target_at(double t, const PropagateCovariance& propagate) const {
  const bool planar = !states_.chaser.empty() && std::holds_alternative<Variable<SE2>>(states_.chaser[0]);
  return planar ? target<SE2>(t, propagate) : target<SE3>(t, propagate);
}

template <LieGroup G>
std::optional<OdometryAt<G>> TrackingTrajectory::odometry_at(double from, double t, double to) const {
  const auto begin = pose_at(odometry_, from), instant = pose_at(odometry_, t), end = pose_at(odometry_, to);
  if (!begin || !instant || !end || odometry_.size() < 2) return {};
  auto next = std::upper_bound(odometry_.begin(), odometry_.end(), t,
                               [](double time, const Stamped<SE3>& pose) { return time < pose.t; });
  if (next == odometry_.end()) --next;
  if (next == odometry_.begin()) ++next;
  const Stamped<SE3>& before = *(next - 1);
  return OdometryAt<G>{in_group<G>(*begin), in_group<G>(*instant), in_group<G>(*end),
                       minus(in_group<G>(next->value), in_group<G>(before.value)) / (next->t - before.t)};
}

template <LieGroup G>
MotionInstant TrackingTrajectory::chaser(double t, const PropagateCovariance& propagate) const {
  const std::size_t k = interval_at(states_.keyframes, t);
  const double from = states_.keyframes[k].t, to = states_.keyframes[k + 1].t;
  Arguments arguments;
  const auto add_pose = [&](std::size_t i) {
    const auto& x = std::get<Variable<G>>(states_.chaser[i]);
    arguments.add(states_.problem.id(x), G::Jacobian::Identity());
    return states_.problem.value(x);
  };
  const G x0 = add_pose(k), x1 = add_pose(k + 1);
  const auto odometry = odometry_at<G>(from, t, to);
  const InterpolatedMotion<G> motion =
      odometry ? interpolate_along_odometry<G>(x0, x1, *odometry, noise_.odometry, to - from, t - from)
               : interpolate_constant_twist(x0, x1, to - from, t - from);
  return instant_of(motion, arguments.covariance(motion, propagate));
}

template <LieGroup G>
MotionInstant TrackingTrajectory::target(double t, const PropagateCovariance& propagate) const {
  constexpr int n = G::dof, P = G::point_dim;
  const Problem& problem = states_.problem;
  const std::span<const TargetVariable> target = states_.target;
  const std::size_t k = interval_at(states_.keyframes, t);
  const double dt = states_.keyframes[k + 1].t - states_.keyframes[k].t, after = t - states_.keyframes[k].t;
  Arguments arguments;
  const auto result = [&](const auto& motion) { return instant_of(motion, arguments.covariance(motion, propagate)); };
  if (const auto* course = std::get_if<CourseVariable<G>>(&target[k]))
    return result(on_course(problem, *course, course->t + after, arguments));
  const auto is_pose = [&](std::size_t i) { return pose_of<G>(target[i]) != nullptr; };
  const auto add_pose = [&](std::size_t i) {
    const Variable<G>& x = *pose_of<G>(target[i]);
    arguments.add(problem.id(x), G::Jacobian::Identity());
    return problem.value(x);
  };
  if (is_pose(k) && is_pose(k + 1)) {
    if (options_.model == MotionModel::white_noise_acceleration) {
      const auto add_twist = [&](std::size_t i) {
        const auto& w = std::get<Variable<Rn<n>>>(states_.twist[i]);
        arguments.add(problem.id(w), Eigen::MatrixXd::Identity(n, n));
        return problem.value(w);
      };
      const G x0 = add_pose(k);
      const Rn<n> w0 = add_twist(k);
      const G x1 = add_pose(k + 1);
      const Rn<n> w1 = add_twist(k + 1);
      const Vector<n> sigma = detail::acceleration_of(noise_, n).sigma;
      return result(interpolate_white_noise<G>(x0, w0, x1, w1, sigma.cwiseAbs2(), dt, after));
    }
    if (options_.model == MotionModel::damped_twist)
      return result(damped<G>(states_.keyframes, k, detail::acceleration_of(noise_, n).sigma, noise_.twist_time, t,
                              is_pose, add_pose));
    const G x0 = add_pose(k), x1 = add_pose(k + 1);
    return result(interpolate_constant_twist(x0, x1, dt, after));
  }
  const auto add_target_point = [&](std::size_t i) { return add_point<G>(problem, target[i], arguments); };
  if (detail::is_damped(options_.model))
    return result(damped<Rn<P>>(
        states_.keyframes, k, noise_.constant_velocity, noise_.velocity_time, t, [](std::size_t) { return true; },
        add_target_point));
  const Rn<P> x0 = add_target_point(k), x1 = add_target_point(k + 1);
  return result(interpolate_constant_twist<Rn<P>>(x0, x1, dt, after));
}

}  // namespace tandem
