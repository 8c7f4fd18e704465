#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/motion_neighbours.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/residuals/direction.hpp>
#include <tandem/residuals/interpolated.hpp>
#include <tandem/residuals/miscalibrated.hpp>
#include <tandem/residuals/steady_course.hpp>

namespace tandem::detail {

/// Returns PlacedMeasurement::innovation for a residual that reads the variables with these IDs. Copies the residual.
std::function<Problem::Linearization(const Problem&)> innovation_of(const ResidualFunctions& functions,
                                                                    const void* residual,
                                                                    std::vector<int> variable_ids);

/// Adds a measurement of one sensor to a problem, at a keyframe or between two keyframes. If `between` is true, the
/// residual reads the interpolated poses of chaser and target (Interpolated). A placement P creates the residual; it is
/// a struct with the function
///
///     template <LieGroup G, LieGroup T>  // chaser: SE3 or SE2; target: a pose, or a point of the same dimension
///     static MyResidual<G, T> residual(const Measurement& m, const G& mount, const Vector<G::point_dim>& beacon);
///
/// `mount` is the sensor in the chaser's body, `beacon` the observed point in the target's body. Example:
/// place_range.cpp.
template <LieGroup G, bool between>
class SensorBuild {
 public:
  using Build = TrackingBuild<G>;
  using Point = typename Build::Point;

  SensorBuild(Build& build, const Placing& at)
      : build_(build),
        sensor_(build.data.sensors[at.sensor]),
        measurement_(sensor_.measurements[at.index]),
        fraction_(at.fraction.value_or(0)),
        noise_(noise_of(sensor_.name, sensor_.sigma, rows(sensor_.type, Build::planar))),
        position_loss_(loss_of(sensor_, build.options)),
        placed_{at.sensor, at.index, at.keyframe, {}, {}, {}, {}} {}

  template <class P>
  void add() {
    add_with([&](const auto& target) { add_placement<P>(target); });
  }

 protected:
  /// Calls add(target variable) for the keyframe. Between a pose and a point, uses points if both keyframes have one.
  template <class F>
  void add_with(F add) {
    const std::size_t k = placed_.keyframe;
    const bool types_differ = fraction_ > 0 && build_.target[k].index() != build_.target[k + 1].index();
    if (types_differ && target_at<Point>(k) && target_at<Point>(k + 1)) {
      add(*target_at<Point>(k));
    } else {
      std::visit(add, build_.target[k]);
    }
    build_.out.measurements.push_back(placed_);
  }
  template <LieGroup T>
  const Variable<T>* target_at(std::size_t k) const {
    return build_.template target_at<T>(k);
  }
  G mount() const { return in_group<G>(sensor_.mount); }
  Vector<G::point_dim> beacon() const { return in_group<G>(sensor_.marker.translation()); }

  /// Adds a residual to the problem. For a held-out measurement, it only sets PlacedMeasurement::innovation.
  template <Residual R>
  std::optional<Block> add_residual(const R& residual, const VariablesOf<R>& x, const Gaussian& noise,
                                    const Loss& loss) {
    if (!measurement_.held_out) return build_.problem.minimize(residual, noise, x, loss);
    placed_.innovation = std::apply(
        [&](const auto&... v) { return innovation_of(kResidualFunctions<R>, &residual, {build_.problem.id(v)...}); },
        x);
    return {};
  }
  template <Residual R, LieGroup T>
  std::optional<Block> add_residual(const R& residual, const Variable<T>& target, const Gaussian& noise,
                                    const Loss& loss) {
    const std::size_t k = placed_.keyframe;
    if constexpr (between) {
      const auto* next = target_at<T>(k + 1);
      if (!next) throw_types_differ();
      return add_residual<Interpolated<R>>({residual, fraction_},
                                           {build_.chaser[k], build_.chaser[k + 1], target, *next}, noise, loss);
    } else {
      return add_residual<R>(residual, {build_.chaser[k], target}, noise, loss);
    }
  }
  template <Residual R>
  std::optional<Block> add_residual(const R& residual, const CourseVariable<G>& target, const Gaussian& noise,
                                    const Loss& loss) {
    if constexpr (between) {
      throw BadInputError(sensor_.name + ": the steady-course model does not support measurements between keyframes");
    } else {
      return add_residual<SteadyCourse<R>>({residual, target.t},
                                           {build_.chaser[placed_.keyframe], target.first, target.speed}, noise, loss);
    }
  }

  /// Adds a residual of the point `beacon` on the target, with the systematic errors of the sensor, if there are any.
  template <Residual R, class Target>
  std::optional<Block> add_with_errors(const R& residual, const Vector<G::point_dim>& beacon, const Target& target,
                                       const Gaussian& noise, const Loss& loss) {
    if (between || !sensor_.error) return add_residual(residual, target, noise, loss);
    if constexpr (std::same_as<Target, CourseVariable<G>>) {
      throw BadInputError(sensor_.name + ": the steady-course model does not support systematic errors; remove them");
    } else if constexpr (!between) {  // see interpolates()
      return add_miscalibrated(residual, beacon, target, noise, loss);
    }
  }
  template <Residual R, LieGroup T>
  std::optional<Block> add_miscalibrated(const R& residual, const Vector<G::point_dim>& beacon,
                                         const Variable<T>& target, const Gaussian& noise, const Loss& loss) {
    using Whole = Miscalibrated<R>;
    const SystematicError& error = *sensor_.error;
    if (const std::string why = why_unsupported(sensor_); !why.empty())
      throw BadInputError(error_name(sensor_.name) + ": " + why);
    const std::size_t k = placed_.keyframe;
    const std::size_t until = fraction_ > 0 ? k + 1 : k;
    if (!target_at<T>(until)) throw_types_differ();
    const auto [before, after] =
        error.delay_sigma > 0 ? neighbours_of<T>(k, motion_half_window(error)) : std::pair(k, until);
    const double later = fraction_ * build_.dt(k, until);
    SensorConstants& constants = build_.constants;
    Problem& problem = build_.problem;
    // Unused states are fixed variables, to keep the Hessian sparse.
    const auto chaser_variable = [&](std::size_t i) {
      return i == k ? constants.fixed_identity<G>(problem) : build_.chaser[i];
    };
    const auto target_variable = [&](std::size_t i) {
      return i == k ? constants.fixed_identity<T>(problem) : *target_at<T>(i);
    };
    using Bias = Rn<R::dim>;
    const auto bias =
        error.has_bias()
            ? std::get<Variable<Bias>>(build_.bias_at(placed_.sensor, sensor_.valid_at(measurement_)).state)
            : constants.fixed_identity<Bias>(problem);
    return add_residual<Whole>(
        {residual, mount(), beacon, {build_.dt(before, k), build_.dt(k, after)}, later},
        {build_.chaser[k], chaser_variable(before), chaser_variable(after), target, target_variable(before),
         target_variable(after), bias, constants.get_or_add<Rn<1>>(problem, sensor_.name, "scale", error.scale_sigma),
         constants.get_or_add<typename Whole::Turn>(problem, sensor_.name, "misalignment", error.misalignment_sigma),
         build_.fixed_delay ? *build_.fixed_delay
                            : constants.get_or_add<Rn<1>>(problem, sensor_.name, "delay", error.delay_sigma)},
        noise, loss);
  }
  /// Returns the keyframes that give the motion at k. The target has the same type there, a pose or a point.
  template <LieGroup T>
  std::pair<std::size_t, std::size_t> neighbours_of(std::size_t k, double half_window) const {
    const auto is_usable = [&](std::size_t i) { return target_at<T>(i) != nullptr; };
    const MotionNeighbours found = motion_neighbours(build_, k, half_window, is_usable);
    if (found.before == found.after && !build_.fixed_delay)
      throw BadInputError(
          sensor_.name +
          ": estimating the delay needs a second keyframe at which the target has the same type, a pose or a "
          "point; remove `delay`");
    return {found.before, found.after};
  }

  [[noreturn]] void throw_types_differ() const {
    throw BadInputError(sensor_.name +
                        ": a measurement between two keyframes is not supported if the target is a pose at one " +
                        "and a point at the other");
  }

  template <class P, class Target>
  void add_placement(const Target& target) {
    constexpr bool point = std::same_as<Target, Variable<Point>>;
    if (point && !sensor_.marker.translation().isZero())
      throw BadInputError(
          sensor_.name +
          ": a lever arm on the target (target_position) needs the target's orientation, which this mode or "
          "model does not estimate at the measurement; use mode A and a model of poses");
    using T = std::conditional_t<point, Point, G>;
    placed_.block = add_with_errors(P::template residual<G, T>(measurement_, mount(), beacon()), beacon(), target,
                                    noise_, position_loss_);
  }

  Build& build_;
  const TargetSensor& sensor_;
  const Measurement& measurement_;
  double fraction_;
  Gaussian noise_;
  Loss position_loss_;
  PlacedMeasurement placed_;
};

/// Returns whether a residual reads interpolated poses between two keyframes. A sensor with systematic errors does not:
/// Miscalibrated evaluates the motion itself.
template <LieGroup G>
bool interpolates(const TrackingBuild<G>& build, const Placing& at) {
  return at.fraction && !build.data.sensors[at.sensor].error;
}

template <class P, LieGroup G>
void place(TrackingBuild<G>& build, const Placing& at) {
  if (interpolates(build, at)) {
    SensorBuild<G, true>(build, at).template add<P>();
  } else {
    SensorBuild<G, false>(build, at).template add<P>();
  }
}

/// Returns the direction of azimuth and elevation, or of the azimuth in the plane.
template <LieGroup G>
Direction<G::point_dim> direction_of(const Measurement& m) {
  if constexpr (G::point_dim == 2) {
    return Direction<2>(m.azimuth);
  } else {
    return Direction<3>(m.azimuth, m.elevation);
  }
}

}  // namespace tandem::detail
