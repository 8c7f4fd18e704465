#include <algorithm>
#include <cmath>
#include <numeric>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/tracking_motion.hpp>
#include <tandem/problem/tracking/tracking_trajectory.hpp>
#include <tandem/residuals/motion_interpolation.hpp>

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
  Eigen::MatrixXd covariance(const InterpolatedMotion<G>& motion, const TrackingTrajectory::Covariance& of) const {
    if (!of) return {};
    Eigen::MatrixXd J(2 * G::dof, std::accumulate(dofs.begin(), dofs.end(), 0));
    for (std::size_t s = 0, from = 0, to = 0; s < ids.size(); ++s) {
      const Eigen::MatrixXd& by = by_state[s];
      J.middleCols(Eigen::Index(to), by.cols()) = motion.jacobian.middleCols(Eigen::Index(from), by.rows()) * by;
      from += std::size_t(by.rows());
      to += std::size_t(by.cols());
    }
    return J * of(ids, dofs) * J.transpose() + motion.bridge;
  }
};

template <LieGroup G>
const Variable<G>* pose_of(const TargetVariable& x) {
  return std::get_if<Variable<G>>(&x);
}

template <LieGroup G>
bool is_on_course(const TargetVariable& x) {
  return std::holds_alternative<CourseVariable<G>>(x);
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

/// Interpolates by `damped` the up to four states around keyframe k for which `usable(k)` holds. `add(k)` returns a
/// state and appends its arguments.
template <LieGroup X, class Usable, class Add>
InterpolatedMotion<X> damped(const std::vector<Keyframe>& keyframes, std::size_t k, const Vector<X::dof>& sigma,
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

std::vector<TrackedInstant> TrackingTrajectory::at(std::span<const double> times, const Covariance& covariance) const {
  const std::vector<Keyframe>& keyframes = tracking_.keyframes;
  if (keyframes.size() < 2) throw BadInputError("a trajectory needs two keyframes or more");
  std::vector<TrackedInstant> result;
  for (const double t : times) {
    if (!(t >= first() && t <= last()))
      throw BadInputError("the time " + std::to_string(t) + " s is outside of the trajectory, " +
                          std::to_string(first()) + " to " + std::to_string(last()) + " s");
    const auto after = std::upper_bound(keyframes.begin(), keyframes.end(), t,
                                        [](double time, const Keyframe& keyframe) { return time < keyframe.t; });
    const auto k = std::min(std::size_t(after - keyframes.begin()), keyframes.size() - 1) - 1;
    result.push_back(std::holds_alternative<Variable<SE2>>(tracking_.chaser[k]) ? at<SE2>(t, k, covariance)
                                                                                : at<SE3>(t, k, covariance));
  }
  return result;
}

template <LieGroup G>
TrackedInstant TrackingTrajectory::at(double t, std::size_t k, const Covariance& covariance) const {
  constexpr int n = G::dof, P = G::point_dim;
  const Problem& problem = tracking_.problem;
  const std::vector<TargetVariable>& target = tracking_.target;
  const double dt = tracking_.keyframes[k + 1].t - tracking_.keyframes[k].t, after = t - tracking_.keyframes[k].t;
  TrackedInstant instant{t, {}, {}, TargetState(Vector<3>(Vector<3>::Zero())), {}, {}, {}};

  Arguments chaser;
  const auto add_pose = [&](const Variable<G>& x, Arguments& arguments) {
    arguments.add(problem.id(x), Eigen::MatrixXd::Identity(n, n));
    return problem.value(x);
  };
  const G c0 = add_pose(std::get<Variable<G>>(tracking_.chaser[k]), chaser);
  const G c1 = add_pose(std::get<Variable<G>>(tracking_.chaser[k + 1]), chaser);
  const InterpolatedMotion<G> of_chaser = interpolate_constant_twist(c0, c1, dt, after);
  instant.chaser = in_space(of_chaser.pose);
  instant.chaser_twist = of_chaser.twist;
  instant.chaser_covariance = chaser.covariance(of_chaser, covariance);

  Arguments arguments;
  const auto set_target = [&](const auto& motion) {
    instant.target = TargetState(in_space(motion.pose));
    instant.target_twist = motion.twist;
    instant.target_covariance = arguments.covariance(motion, covariance);
  };
  if (is_on_course<G>(target[k])) {
    const auto pose = [&](std::size_t i) {
      const TargetState state = tracking_.target_state(i);
      return in_group<G>(SE3(state.rotation.value(), state.position));
    };
    const auto motion = interpolate_constant_twist<G>(pose(k), pose(k + 1), dt, after);
    instant.target = TargetState(in_space(motion.pose));
    instant.target_twist = motion.twist;
    return instant;
  }
  const auto is_pose = [&](std::size_t i) { return pose_of<G>(target[i]) != nullptr; };
  const auto add_target_pose = [&](std::size_t i) { return add_pose(*pose_of<G>(target[i]), arguments); };
  if (is_pose(k) && is_pose(k + 1)) {
    if (options_.model == MotionModel::white_noise_acceleration) {
      const auto add_twist = [&](std::size_t i) {
        const auto& w = std::get<Variable<Rn<n>>>(tracking_.twist[i]);
        arguments.add(problem.id(w), Eigen::MatrixXd::Identity(n, n));
        return problem.value(w);
      };
      const G x0 = add_target_pose(k);
      const Rn<n> w0 = add_twist(k);
      const G x1 = add_target_pose(k + 1);
      const Rn<n> w1 = add_twist(k + 1);
      const Vector<n> sigma = detail::acceleration_of(noise_, n).sigma;
      set_target(interpolate_white_noise<G>(x0, w0, x1, w1, sigma.cwiseAbs2(), dt, after));
    } else if (options_.model == MotionModel::damped_twist) {
      set_target(damped<G>(tracking_.keyframes, k, detail::acceleration_of(noise_, n).sigma, noise_.twist_time, t,
                           is_pose, add_target_pose));
    } else {
      const G x0 = add_target_pose(k), x1 = add_target_pose(k + 1);
      set_target(interpolate_constant_twist(x0, x1, dt, after));
    }
    return instant;
  }
  const auto add_target_point = [&](std::size_t i) { return add_point<G>(problem, target[i], arguments); };
  if (detail::is_damped(options_.model)) {
    set_target(damped<Rn<P>>(
        tracking_.keyframes, k, noise_.constant_velocity, noise_.velocity_time, t, [](std::size_t) { return true; },
        add_target_point));
  } else {
    const Rn<P> x0 = add_target_point(k), x1 = add_target_point(k + 1);
    set_target(interpolate_constant_twist<Rn<P>>(x0, x1, dt, after));
  }
  return instant;
}

}  // namespace tandem
