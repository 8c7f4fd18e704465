#include "wrapped_residuals.hpp"

#include <pybind11/stl.h>

#include <tandem/residuals/bearing.hpp>
#include <tandem/residuals/depth.hpp>
#include <tandem/residuals/dvl_velocity.hpp>
#include <tandem/residuals/gps.hpp>
#include <tandem/residuals/heading.hpp>
#include <tandem/residuals/interpolated.hpp>
#include <tandem/residuals/miscalibrated.hpp>
#include <tandem/residuals/miscalibrated_ego.hpp>
#include <tandem/residuals/propagated.hpp>
#include <tandem/residuals/range.hpp>
#include <tandem/residuals/range_bearing.hpp>
#include <tandem/residuals/soft_bound.hpp>
#include <tandem/residuals/steady_course.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/residuals/usbl_spherical.hpp>
#include <tandem/residuals/with_bias.hpp>

#include "noise.hpp"

// Residuals that take another residual. The functions below list the combinations of wrapper, residual and groups.
namespace tandem::python {
namespace {

template <template <class> class W>
void declare_sightings(const std::string& wrapper, const std::vector<std::string>& extras) {
  declare_wrapped<W, UsblPosition<SE3, SE3>, UsblPosition<SE3, R3>>(wrapper, "UsblPosition", extras);
  declare_wrapped<W, UsblSpherical<SE3, SE3>, UsblSpherical<SE3, R3>>(wrapper, "UsblSpherical", extras);
  declare_wrapped<W, Range<SE3, SE3>, Range<SE3, R3>>(wrapper, "Range", extras);
  declare_wrapped<W, Bearing<SE3, SE3>, Bearing<SE3, R3>>(wrapper, "Bearing", extras);
  declare_wrapped<W, RangeBearing<SE3, SE3>, RangeBearing<SE3, R3>>(wrapper, "RangeBearing", extras);
}

/// Returns the family of a wrapper around the family of a residual.
const Family& wrapped(const std::string& wrapper, const FamilyResidual& inner) {
  const auto at = families().find(wrapper + "." + inner.family->name);
  if (at != families().end()) return at->second;
  std::string known;
  for (const auto& [name, family] : families())
    if (name.starts_with(wrapper + ".")) known += (known.empty() ? "" : ", ") + name.substr(wrapper.size() + 1);
  throw BadInputError(wrapper + ": is not available for " + inner.family->name + "; it takes " + known);
}

template <template <class> class W>
void declare_own_sensors(const std::string& wrapper, const std::vector<std::string>& extras) {
  declare_wrapped<W, Depth>(wrapper, "Depth", extras);
  declare_wrapped<W, Gps>(wrapper, "Gps", extras);
  declare_wrapped<W, Heading>(wrapper, "Heading", extras);
  declare_wrapped<W, DvlVelocity>(wrapper, "DvlVelocity", extras);
}

/// Returns the names of the members of a PreintegratedImu, which are those of an ImuDelta and of the Earth.
std::vector<std::string> imu_members() {
  std::vector<std::string> names = families().at("PreintegratedImu").members;
  for (std::string& name : names) name = "imu_" + name;
  return names;
}

/// Returns the values of these members. Null means that nothing was integrated.
std::vector<py::object> imu_values(const std::string& wrapper, const FamilyResidual* imu) {
  if (!imu) return std::vector<py::object>(imu_members().size());
  if (imu->family->name != "PreintegratedImu")
    throw BadInputError(wrapper + ": imu is a residual " + imu->family->name +
                        "; give the PreintegratedImu that preintegrate_imu() returns");
  return imu->values;
}

FamilyResidual with(const std::string& wrapper, const FamilyResidual& inner, const std::vector<py::object>& extras) {
  FamilyResidual residual{&wrapped(wrapper, inner), inner.values};
  residual.values.insert(residual.values.end(), extras.begin(), extras.end());
  return residual;
}

/// Returns null, for the default of a member, instead of None.
py::object given(const py::object& x) { return x.is_none() ? py::object() : x; }

/// Returns the bounds on one side as an array of shape (dim,), or (n, dim) for n blocks.
py::object rows_of(const RowBounds& side, int dim) {
  Numbers array = new_array(side.count(), side.single, {dim});
  double* to = array.mutable_data();
  for (std::size_t i = 0; i < side.count(); ++i) {
    const std::vector<double> rows = PyBounds::rows(side, i, dim);
    to = std::copy(rows.begin(), rows.end(), to);
  }
  return array;
}

}  // namespace

void bind_wrapped_residuals(py::module_& m) {
  declare_sightings<Interpolated>("Interpolated", {"s"});
  m.def(
      "Interpolated",
      [](const FamilyResidual& residual, const py::object& s) { return with("Interpolated", residual, {s}); },
      py::arg("residual"), py::arg("s"),
      "Interpolated(residual, s)\n\nA residual of chaser and target between two keyframes, at the fraction s of their "
      "interval. States: chaser at both keyframes, target at both keyframes.");
  declare_wrapped<SteadyCourse, UsblPosition<SE3, SE3>>("SteadyCourse", "UsblPosition", {"t"});
  declare_wrapped<SteadyCourse, Range<SE3, SE3>>("SteadyCourse", "Range", {"t"});
  declare_wrapped<SteadyCourse, Bearing<SE3, SE3>>("SteadyCourse", "Bearing", {"t"});
  declare_wrapped<SteadyCourse, RangeBearing<SE3, SE3>>("SteadyCourse", "RangeBearing", {"t"});
  m.def(
      "SteadyCourse",
      [](const FamilyResidual& residual, const py::object& t) { return with("SteadyCourse", residual, {t}); },
      py::arg("residual"), py::arg("t"),
      "SteadyCourse(residual, t)\n\nA residual of a target with constant heading and speed, t [s] after its first "
      "pose. "
      "States: chaser pose, first target pose, speed (R1) [m/s].");
  declare_sightings<WithBias>("WithBias", {});
  declare_wrapped<WithBias, Depth>("WithBias", "Depth", {});
  declare_wrapped<WithBias, Gps>("WithBias", "Gps", {});
  declare_wrapped<WithBias, DvlVelocity>("WithBias", "DvlVelocity", {});
  m.def(
      "WithBias", [](const FamilyResidual& residual) { return with("WithBias", residual, {}); }, py::arg("residual"),
      "WithBias(residual)\n\nA residual with the bias of its measurement as an additional state, whose dimension is "
      "the number of rows. States: those of the residual, bias.");
  declare_sightings<Miscalibrated>("Miscalibrated", {"mount", "point", "before", "after", "later"});
  m.def(
      "Miscalibrated",
      [](const FamilyResidual& residual, const py::object& mount, const py::object& point, const py::object& before,
         const py::object& after, const py::object& later) {
        return with("Miscalibrated", residual, {given(mount), given(point), before, after, given(later)});
      },
      py::arg("residual"), py::kw_only(), py::arg("mount") = py::none(), py::arg("point") = py::none(),
      py::arg("before"), py::arg("after"), py::arg("later") = py::none(),
      "Miscalibrated(residual, *, mount=identity, point=0, before, after, later=0)\n\nA sensor with systematic errors: "
      "bias, scale factor, misalignment and delay. `mount` and `point` are B and beacon of the residual; `before` and "
      "`after` the times to the neighbouring states [s]; `later` the time from the states to the measurement [s]. "
      "States: chaser, chaser before, chaser after, target, target before, target after, bias, scale (R1), "
      "misalignment (SO3), delay (R1) [s].");
  declare_own_sensors<Propagated>("Propagated", imu_members());
  m.def(
      "Propagated",
      [](const FamilyResidual& residual, const FamilyResidual& imu) {
        return with("Propagated", residual, imu_values("Propagated", &imu));
      },
      py::arg("residual"), py::arg("imu"),
      "Propagated(residual, imu)\n\nA residual of one of the chaser's own sensors at an instant after a keyframe, to "
      "which inertial measurements predict the state; `imu` is a PreintegratedImu from the keyframe to the instant. "
      "States: pose, velocity (R3) [m/s] and biases (R6) at the keyframe.");
  std::vector<std::string> calibrated = imu_members();
  calibrated.insert(calibrated.begin(), "mount");
  calibrated.insert(calibrated.end(), {"rate", "force"});
  declare_own_sensors<MiscalibratedEgo>("MiscalibratedEgo", calibrated);
  m.def(
      "MiscalibratedEgo",
      [](const FamilyResidual& residual, const py::object& mount, const FamilyResidual* imu, const py::object& rate,
         const py::object& force) {
        std::vector<py::object> extras = imu_values("MiscalibratedEgo", imu);
        extras.insert(extras.begin(), given(mount));
        extras.insert(extras.end(), {given(rate), given(force)});
        return with("MiscalibratedEgo", residual, extras);
      },
      py::arg("residual"), py::kw_only(), py::arg("mount") = py::none(), py::arg("imu") = py::none(),
      py::arg("rate") = py::none(), py::arg("force") = py::none(),
      "MiscalibratedEgo(residual, *, mount=identity, imu=None, rate=0, force=0)\n\nA residual of one of the chaser's "
      "own sensors with bias, scale factor, misalignment on its mount (SO3) and delay. `imu` is a PreintegratedImu "
      "from "
      "the keyframe to the measurement, `rate` [rad/s] and `force` [m/s^2] are the body's motion there. States: pose, "
      "velocity (R3), inertial biases (R6), bias, scale (R1), misalignment (SO3), delay (R1) [s].");
  declare_wrapped<SoftBound, TwistComponents<SE3, surge>>("SoftBound", "TwistComponents_surge", {"lower", "upper"});
  declare_wrapped<SoftBound, TwistComponents<SE3, yaw_rate>>("SoftBound", "TwistComponents_yaw_rate",
                                                             {"lower", "upper"});
  declare_wrapped<SoftBound, Range<SE3, SE3>, Range<SE3, R3>>("SoftBound", "Range", {"lower", "upper"});
  declare_wrapped<SoftBound, Depth>("SoftBound", "Depth", {"lower", "upper"});
  declare_wrapped<SoftBound, Gps>("SoftBound", "Gps", {"lower", "upper"});
  m.def(
      "SoftBound",
      [](const FamilyResidual& residual, py::handle bounds) {
        const int dim = wrapped("SoftBound", residual).instances.front().soft->functions.dim;
        const PyBounds b = bounds_of(bounds, "SoftBound");
        b.check(dim, b.count(), "SoftBound");
        return with("SoftBound", residual, {rows_of(b.lower, dim), rows_of(b.upper, dim)});
      },
      py::arg("residual"), py::arg("bounds"),
      "SoftBound(residual, bounds)\n\nThe amount by which a residual exceeds its bounds, for Problem.minimize. States: "
      "those of the residual.");
}

}  // namespace tandem::python
