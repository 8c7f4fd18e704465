#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/problem/tracking/tracking_constraints.hpp>

namespace tandem::detail {

template <LieGroup G>
void TrackingBuild<G>::add_constraints(std::size_t k) {
  const auto hold_of = [&](const Variable<G>& x) {
    each_attitude_constraint<G>(
        options, data.noise, [&](const auto& residual, Role role, auto entry, const auto& sigma) {
          constrain_to_zero(residual, role, entry, noise_of(entry, sigma, int(sigma.size())), {x});
        });
  };
  if (const auto* course = std::get_if<CourseVariable<G>>(&target[k]); course && k == 0) hold_of(course->first);
  if (pose(k)) hold_of(*pose(k));
  if (k == 0 || !pose(k - 1) || !pose(k)) return;
  const VariablesOf<TwistComponents<G, surge>> pair{*pose(k - 1), *pose(k)};
  each_twist_constraint<G>(
      options, data.noise, dt(k - 1, k),
      [&](const auto& residual, Role role, auto entry, const auto& sigma) {
        constrain_to_zero(residual, role, entry, Gaussian(sigma), pair);
      },
      [&](const auto& residual, Role role, const auto& bounds, auto entry, const auto& sigma) {
        constrain_to_bounds(residual, role, bounds, entry, Gaussian(sigma), pair);
      });
}

template void TrackingBuild<SE3>::add_constraints(std::size_t);
template void TrackingBuild<SE2>::add_constraints(std::size_t);

}  // namespace tandem::detail
