#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/twist_components.hpp>

namespace tandem::detail {

template <LieGroup G>
void TrackingBuild<G>::add_constraints(std::size_t k) {
  using Surge = TwistComponents<G, surge>;
  using YawRate = TwistComponents<G, yaw_rate>;
  if constexpr (!planar) {  // a planar target is level
    const Gaussian noise = noise_of("roll_pitch", this->data.noise.roll_pitch, 2);
    if (const auto* course = std::get_if<CourseVariable<G>>(&target[k]); course && k == 0)
      hold_zero(RollPitch<G>{}, options.roll_pitch, "roll_pitch", noise, {course->first});
    if (pose(k)) hold_zero(RollPitch<G>{}, options.roll_pitch, "roll_pitch", noise, {*pose(k)});
  }
  if (k == 0 || !pose(k - 1) || !pose(k)) return;
  constexpr TwistAxes sideways_axes = planar ? sway : sway | heave;
  using NonHolonomic = TwistComponents<G, sideways_axes>;
  const Gaussian sideways(Eigen::VectorXd(data.noise.non_holonomic.head(NonHolonomic::dim)));
  const Gaussian along{data.noise.surge}, turning{data.noise.yaw_rate};
  const double step = dt(k - 1, k);
  const VariablesOf<Surge> pair{*pose(k - 1), *pose(k)};
  hold_zero(NonHolonomic{step}, options.non_holonomic, "non_holonomic", sideways, pair);
  if (options.surge) hold_between(Surge{step}, options.limits, *options.surge, "surge", along, pair);
  if (options.max_yaw_rate)
    hold_between(YawRate{step}, options.limits, between(-*options.max_yaw_rate, *options.max_yaw_rate), "yaw_rate",
                 turning, pair);
}

template void TrackingBuild<SE3>::add_constraints(std::size_t);
template void TrackingBuild<SE2>::add_constraints(std::size_t);

}  // namespace tandem::detail
