#pragma once

#include <variant>
#include <vector>

#include <tandem/problem/tracking.hpp>
#include <tandem/problem/tracking_start.hpp>
#include <tandem/residuals/outside.hpp>

namespace tandem::detail {

/// What the parts of the tracking builder share, over poses G (SE3 or SE2). Each part adds the residuals of one kind
/// after the other, so that each pool is filled in time order.
template <LieGroup G>
struct TrackingBuild {
  using Point = Rn<G::point_dim>;
  using State = std::variant<Variable<G>, Variable<Point>, CourseVariable<G>>;
  static constexpr bool planar = G::point_dim == 2;

  const TrackingData& data;
  const TrackingOptions& options;
  TrackingProblem& out;
  std::vector<SE3> odometry;  ///< at the keyframes
  TargetStart start;
  std::vector<Variable<G>> chaser{};
  std::vector<State> target{};
  std::vector<std::optional<Variable<Point>>> twin{};  ///< Mode B: the point at a pose that is next to one
  std::vector<Variable<Rn<G::dof>>> twist{};           ///< white noise on acceleration

  std::size_t size() const { return out.keyframes.size(); }
  double dt(std::size_t from, std::size_t to) const { return out.keyframes[to].t - out.keyframes[from].t; }
  const Variable<G>* pose(std::size_t k) const { return std::get_if<Variable<G>>(&target[k]); }

  void add_variables();
  void add_course_variables();
  void add_chaser();
  void add_measurements();
  void add_motion();
  void add_constraints();

  template <Residual R>
  void hold_zero(const R& residual, Role role, const Gaussian& noise, const VariablesOf<R>& x) {
    if (role == Role::hard) out.problem.subject_to(residual, equal_to(0), x);
    if (role == Role::soft) out.problem.minimize(residual, noise, x);
  }
  template <Residual R>
  void hold_between(const R& residual, Role role, const Bounds<R::dim>& bounds, const Gaussian& noise,
                    const VariablesOf<R>& x) {
    if (role == Role::hard) out.problem.subject_to(residual, bounds, x);
    if (role == Role::soft) out.problem.minimize(Outside<R>(residual, bounds), noise, x);
  }
};

/// Standard deviations by name; throws Error when they are not `size` positive numbers.
Gaussian noise_of(std::string_view name, const Eigen::VectorXd& sigma, int size);

}  // namespace tandem::detail
