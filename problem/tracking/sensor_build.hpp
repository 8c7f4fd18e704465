#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/residuals/direction.hpp>
#include <tandem/residuals/interpolated.hpp>
#include <tandem/residuals/miscalibrated.hpp>
#include <tandem/residuals/on_course.hpp>

namespace tandem::detail {

/// Adds a measurement of one sensor: at a keyframe, or, `between`, at an instant between one and the next, where it reads
/// both poses of chaser and target, interpolated. What it becomes is said by a placement P: a struct with
///
///     template <LieGroup G, LieGroup T>  // the chaser's pose (SE3, SE2); the target's pose, or a point of its dimension
///     static MyResidual<G, T> residual(const Measurement& m, const G& mount, const Vector<G::point_dim>& beacon);
///
/// with the sensor in the chaser's body and what it sees in the target's. See place_range.cpp.
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
    add_with([&](const auto& target) { add_by<P>(target); });
  }

 protected:
  /// add(target): of whichever kind the target is at the keyframe; a point between a pose and a point, where both have one.
  template <class F>
  void add_with(F add) {
    const std::size_t k = placed_.keyframe;
    const bool between_kinds = fraction_ > 0 && build_.target[k].index() != build_.target[k + 1].index();
    if (between_kinds && seen_at<Point>(k) && seen_at<Point>(k + 1)) {
      add(*seen_at<Point>(k));
    } else {
      std::visit(add, build_.target[k]);
    }
    build_.out.measurements.push_back(placed_);
  }
  /// The target at a keyframe as a pose or as a point; a pose next to a point has both. Nothing where it is not.
  template <LieGroup T>
  const Variable<T>* seen_at(std::size_t k) const {
    if constexpr (std::same_as<T, Point>)
      if (build_.twin[k]) return &*build_.twin[k];
    return std::get_if<Variable<T>>(&build_.target[k]);
  }
  G mount() const { return in_group<G>(sensor_.mount); }
  Vector<G::point_dim> beacon() const { return in_group<G>(sensor_.marker.translation()); }

  /// As a residual of the problem, or, held out, as one that is only looked at.
  template <Residual R>
  std::optional<Block> put(const R& residual, const VariablesOf<R>& x, const Gaussian& noise, const Loss& loss) {
    if (!measurement_.held_out) return build_.problem.minimize(residual, noise, x, loss);
    placed_.innovation = [residual, x](const Problem& problem) {
      return std::apply([&](const auto&... v) { return innovation(residual, {problem.id(v)...}, problem.value(v)...); },
                        x);
    };
    return {};
  }
  template <Residual R, LieGroup T>
  std::optional<Block> put(const R& residual, const Variable<T>& target, const Gaussian& noise, const Loss& loss) {
    const std::size_t k = placed_.keyframe;
    if constexpr (between) {
      const auto* next = seen_at<T>(k + 1);
      if (!next) throw_between_kinds();
      return put<Interpolated<R>>({residual, fraction_}, {build_.chaser[k], build_.chaser[k + 1], target, *next}, noise,
                                  loss);
    } else {
      return put<R>(residual, {build_.chaser[k], target}, noise, loss);
    }
  }
  template <Residual R>
  std::optional<Block> put(const R& residual, const CourseVariable<G>& target, const Gaussian& noise,
                           const Loss& loss) {
    if constexpr (between) {
      throw Error(sensor_.name + ": on a steady course there is nothing between keyframes");
    } else {
      return put<OnCourse<R>>({residual, target.t}, {build_.chaser[placed_.keyframe], target.first, target.speed},
                              noise, loss);
    }
  }

  /// All of a measurement: with the sensor's errors that stay, where it has some; what is seen at `beacon` on the target.
  template <Residual R, class Target>
  std::optional<Block> put_whole(const R& residual, const Vector<G::point_dim>& beacon, const Target& target,
                                 const Gaussian& noise, const Loss& loss) {
    if (between || !sensor_.error) return put(residual, target, noise, loss);
    if constexpr (std::same_as<Target, CourseVariable<G>>) {
      throw Error(sensor_.name + ": errors that stay are not estimated on a steady course");
    } else if constexpr (!between) {  // see interpolates()
      return put_miscalibrated(residual, beacon, target, noise, loss);
    }
  }
  template <Residual R, LieGroup T>
  std::optional<Block> put_miscalibrated(const R& residual, const Vector<G::point_dim>& beacon,
                                         const Variable<T>& target, const Gaussian& noise, const Loss& loss) {
    using Whole = Miscalibrated<R>;
    const StayingError& error = *sensor_.error;
    if (const std::string why = why_not(sensor_); !why.empty()) throw Error(error_name(sensor_.name) + ": " + why);
    const std::size_t k = placed_.keyframe;
    const std::size_t until = fraction_ > 0 ? k + 1 : k;
    if (!seen_at<T>(until)) throw_between_kinds();
    const auto [before, after] = error.delay > 0 ? neighbours_of<T>(k, delay_reach(error)) : std::pair(k, until);
    const double later = fraction_ * build_.dt(k, until);
    SensorConstants& constants = build_.constants;
    Problem& problem = build_.problem;
    // What it does not read is a constant, so that blocks of the problem's matrix are not filled with zeros.
    const auto chaser_at = [&](std::size_t i) { return i == k ? constants.none<G>(problem) : build_.chaser[i]; };
    const auto target_at = [&](std::size_t i) { return i == k ? constants.none<T>(problem) : *seen_at<T>(i); };
    using Bias = Rn<R::dim>;
    const auto bias =
        error.has_bias()
            ? std::get<Variable<Bias>>(build_.bias_at(placed_.sensor, sensor_.valid_at(measurement_)).state)
            : constants.none<Bias>(problem);
    return put<Whole>(
        {residual, mount(), beacon, {build_.dt(before, k), build_.dt(k, after)}, later},
        {build_.chaser[k], chaser_at(before), chaser_at(after), target, target_at(before), target_at(after), bias,
         constants.get<Rn<1>>(problem, sensor_.name, "scale", error.scale),
         constants.get<typename Whole::Turn>(problem, sensor_.name, "misalignment", error.misalignment),
         build_.held_delay ? *build_.held_delay : constants.get<Rn<1>>(problem, sensor_.name, "delay", error.delay)},
        noise, loss);
  }
  /// The keyframes before and after k that tell how chaser and target move about it: the nearest that are so many seconds
  /// away and where the target is of the same kind, or else the farthest; k itself where there is none.
  template <LieGroup T>
  std::pair<std::size_t, std::size_t> neighbours_of(std::size_t k, double seconds) const {
    std::size_t before = k, after = k;
    for (std::size_t i = k; i-- > 0 && build_.dt(before, k) < seconds;)
      if (seen_at<T>(i)) before = i;
    for (std::size_t i = k + 1; i < build_.target.size() && build_.dt(k, after) < seconds; ++i)
      if (seen_at<T>(i)) after = i;
    if (before == after && !build_.held_delay)
      throw Error(sensor_.name +
                  ": its delay needs a second keyframe where the target is of the same kind, a pose or a "
                  "point; leave it out");
    return {before, after};
  }

  [[noreturn]] void throw_between_kinds() const {
    throw Error(sensor_.name + ": a measurement between a keyframe where the target is a pose and one where it is a " +
                "point cannot be placed");
  }

  template <Residual R, LieGroup... Xs>
  static Innovation innovation(const R& residual, std::vector<int> variables, const Xs&... x) {
    Vector<R::dim> r;
    std::tuple<Matrix<R::dim, Xs::dof>...> J;
    std::apply([&](auto&... j) { residual(x..., r, &j...); }, J);
    Innovation result{r, Eigen::MatrixXd(R::dim, (Xs::dof + ...)), std::move(variables), {Xs::dof...}};
    double* column = result.jacobian.data();
    std::apply([&](const auto&... j) { ((column = std::copy_n(j.data(), j.size(), column)), ...); }, J);
    return result;
  }

  template <class P, class Target>
  void add_by(const Target& target) {
    constexpr bool point = std::same_as<Target, Variable<Point>>;
    if (point && !sensor_.marker.translation().isZero())
      throw Error(sensor_.name +
                  ": its place on the target (target_position) needs the target's orientation, which this mode or "
                  "model does not estimate where it measures");
    using T = std::conditional_t<point, Point, G>;
    placed_.block = put_whole(P::template residual<G, T>(measurement_, mount(), beacon()), beacon(), target, noise_,
                              position_loss_);
  }

  Build& build_;
  const TargetSensor& sensor_;
  const Measurement& measurement_;
  double fraction_;
  Gaussian noise_;
  Loss position_loss_;
  PlacedMeasurement placed_;
};

/// Whether a measurement reads poses between keyframes, interpolated; one of a sensor with errors that stay is read so much later
/// than the first of them (Miscalibrated).
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

/// The direction that azimuth and elevation, or the bearing in the plane, say.
template <LieGroup G>
Direction<G::point_dim> direction_of(const Measurement& m) {
  if constexpr (G::point_dim == 2) {
    return Direction<2>(m.azimuth);
  } else {
    return Direction<3>(m.azimuth, m.elevation);
  }
}

}  // namespace tandem::detail
