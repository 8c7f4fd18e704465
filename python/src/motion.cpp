#include <tandem/residuals/coasting.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/damped_twist.hpp>
#include <tandem/residuals/gauss_markov.hpp>
#include <tandem/residuals/mixed_velocity.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/white_noise_acceleration.hpp>

#include "residual_family.hpp"

namespace tandem::python {
namespace {

constexpr const char* kAxes[] = {"surge", "sway", "heave", "roll_rate", "pitch_rate", "yaw_rate"};

template <TwistAxes axes, bool planar>
void declare_axes(py::module_& m, py::dict& functions) {
  std::string name = "TwistComponents_";
  py::list key;
  for (int k = 0; k < 6; ++k)
    if (static_cast<unsigned>(axes) >> k & 1u) {
      key.append(kAxes[k]);
      name += (py::len(key) > 1 ? "_" : "") + std::string(kAxes[k]);
    }
  const char* const doc = "Components of the twist between two poses.";
  if constexpr (planar)
    declare<TwistComponents<SE3, axes>, TwistComponents<SE2, axes>>(m, name, {"dt"}, 1, doc);
  else
    declare<TwistComponents<SE3, axes>>(m, name, {"dt"}, 1, doc);
  functions[py::tuple(key)] = m.attr(name.c_str());
}

}  // namespace

void bind_motion(py::module_& m) {
  declare<ConstantTwist<SE3>, ConstantTwist<SE2>, ConstantTwist<Rn<1>>, ConstantTwist<R2>, ConstantTwist<R3>>(
      m, "ConstantTwist", {"dt1", "dt2"}, 2,
      "ConstantTwist(dt1, dt2)\n\nConstant body twist over three states; the noise is proportional to dt2. States: "
      "three states of one group.");
  declare<DampedTwist<SE3>, DampedTwist<SE2>>(m, "DampedTwist", {"dt1", "dt2", "decay", "mean"}, 4,
                                              "DampedTwist(dt1, dt2, decay, mean)\n\nBody twist that decays to its "
                                              "mean over three states. States: three poses.");
  declare<WhiteNoiseAcceleration<SE3>, WhiteNoiseAcceleration<SE2>, WhiteNoiseAcceleration<R3>>(
      m, "WhiteNoiseAcceleration", {"dt"}, 1,
      "WhiteNoiseAcceleration(dt)\n\nConstant twist disturbed by white noise. States: pose, twist, pose, twist.");
  declare<MixedVelocity<SE3, SE3, R3>, MixedVelocity<SE3, R3, R3>, MixedVelocity<SE3, R3, SE3>,
          MixedVelocity<R3, R3, R3>, MixedVelocity<R3, R3, SE3>, MixedVelocity<R3, SE3, SE3>,
          MixedVelocity<R3, SE3, R3>>(
      m, "MixedVelocity", {"gain"}, 1,
      "MixedVelocity(gain)\n\nVelocity of the positions of three poses or points; gain is dt2/dt1 for a constant one "
      "[m]. States: three poses or points.");
  declare<GaussMarkov<1>, GaussMarkov<3>, GaussMarkov<6>>(
      m, "GaussMarkov", {"decay"}, 1,
      "GaussMarkov(decay)\n\nFirst-order Gauss-Markov process of a systematic error: b1 - decay b0. States: b0, b1.");
  declare<Coasting>(m, "Coasting", {"dt"}, 1,
                    "Coasting(dt)\n\nConstant velocity and orientation. States: pose, velocity, pose, velocity.");
  py::dict axes;
  declare_axes<surge, true>(m, axes);
  declare_axes<sway, true>(m, axes);
  declare_axes<heave, false>(m, axes);
  declare_axes<roll_rate, false>(m, axes);
  declare_axes<pitch_rate, false>(m, axes);
  declare_axes<yaw_rate, true>(m, axes);
  declare_axes<pitch_rate | yaw_rate, false>(m, axes);
  declare_axes<sway | heave, false>(m, axes);
  declare_axes<roll_rate | pitch_rate, false>(m, axes);
  declare_axes<surge | sway | heave, false>(m, axes);
  declare_axes<roll_rate | pitch_rate | yaw_rate, false>(m, axes);
  declare_axes<surge | sway | yaw_rate, true>(m, axes);
  m.attr("_twist_components") = axes;
}

}  // namespace tandem::python
