#pragma once

#include <cmath>
#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/residuals/bearing.hpp>
#include <tandem/residuals/interpolated.hpp>
#include <tandem/residuals/on_course.hpp>
#include <tandem/residuals/range.hpp>
#include <tandem/residuals/range_bearing.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/relative_rotation.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/residuals/usbl_spherical.hpp>

namespace tandem::detail {

/// Adds measurements of one sensor: at a keyframe, or, `between`, at an instant between one and the next, where it reads
/// both poses of chaser and target, interpolated.
template <LieGroup G, bool between>
class SensorBuild {
  using Build = TrackingBuild<G>;
  using Point = typename Build::Point;
  static constexpr int kPointDim = G::point_dim;

 public:
  SensorBuild(Build& build, std::size_t index)
      : build_(build),
        sensor_(build.data.sensors[index]),
        index_(index),
        noise_(checked_noise()),
        position_loss_(loss_of(sensor_, build.options)),
        orientation_loss_(orientation_loss_of(sensor_, build.options)) {}

  /// `fraction`: of the way to the next keyframe, when between them.
  void add(std::size_t i, std::size_t k, double fraction = 0) {
    fraction_ = fraction;
    PlacedMeasurement placed{index_, i, k, {}, {}, {}, {}};
    std::visit([&](const auto& target) { add(sensor_.measurements[i], target, placed); }, build_.target[k]);
    build_.out.measurements.push_back(placed);
  }

 private:
  Gaussian checked_noise() const {
    const int n = rows(sensor_.type, Build::planar);
    if (n == 0)
      throw Error(sensor_.name + ": a planar problem takes no sensor of type " + std::string(name(sensor_.type)));
    return noise_of(sensor_.name, sensor_.sigma, n);
  }
  G mount() const { return in_group<G>(sensor_.mount); }
  Vector<kPointDim> beacon() const { return in_group<G>(sensor_.marker.translation()); }

  /// As a residual of the problem, or, held out, as one that is only looked at.
  template <Residual R>
  std::optional<Block> place(const Measurement& m, const R& residual, const VariablesOf<R>& x, const Gaussian& noise,
                             const Loss& loss, PlacedMeasurement& placed) {
    if (!m.held_out) return build_.problem.minimize(residual, noise, x, loss);
    placed.innovation = [residual, x](const Problem& problem) {
      return std::apply([&](const auto&... v) { return innovation(residual, problem.value(v)...); }, x);
    };
    return {};
  }
  template <Residual R, LieGroup T>
  std::optional<Block> place(const Measurement& m, const R& residual, const Variable<T>& target, const Gaussian& noise,
                             const Loss& loss, PlacedMeasurement& placed) {
    const std::size_t k = placed.keyframe;
    if constexpr (between) {
      const auto* next = std::get_if<Variable<T>>(&build_.target[k + 1]);
      if (!next)
        throw Error(sensor_.name +
                    ": a measurement between a keyframe where the target is a pose and one where it is a " +
                    "point cannot be placed");
      return place<Interpolated<R>>(m, {residual, fraction_}, {build_.chaser[k], build_.chaser[k + 1], target, *next},
                                    noise, loss, placed);
    } else {
      return place<R>(m, residual, {build_.chaser[k], target}, noise, loss, placed);
    }
  }
  template <Residual R>
  std::optional<Block> place(const Measurement& m, const R& residual, const CourseVariable<G>& target,
                             const Gaussian& noise, const Loss& loss, PlacedMeasurement& placed) {
    if constexpr (between) throw Error(sensor_.name + ": on a steady course there is nothing between keyframes");
    return place<OnCourse<R>>(m, {residual, target.t}, {build_.chaser[placed.keyframe], target.first, target.speed},
                              noise, loss, placed);
  }

  template <Residual R, LieGroup... Xs>
  static Innovation innovation(const R& residual, const Xs&... x) {
    Vector<R::dim> r;
    std::tuple<Matrix<R::dim, Xs::dof>...> J;
    std::apply([&](auto&... j) { residual(x..., r, &j...); }, J);
    Innovation result{r, Eigen::MatrixXd(R::dim, (Xs::dof + ...))};
    Eigen::Index column = 0;
    std::apply([&](const auto&... j) { ((result.jacobian.middleCols(column, j.cols()) = j, column += j.cols()), ...); },
               J);
    return result;
  }

  template <class Target>
  void add(const Measurement& m, const Target& target, PlacedMeasurement& placed) {
    constexpr bool point = std::same_as<Target, Variable<Point>>;
    using T = std::conditional_t<point, Point, G>;
    if (sensor_.type == SensorType::pose) return add_pose(m, target, placed);
    if (point && !sensor_.marker.translation().isZero())
      throw Error(sensor_.name +
                  ": its place on the target (target_position) needs the target's orientation, which this mode or "
                  "model does not estimate where it measures");
    const auto put = [&](const auto& residual) {
      placed.block = place(m, residual, target, noise_, position_loss_, placed);
    };
    switch (sensor_.type) {
      case SensorType::position:
        return put(UsblPosition<G, T>{in_group<G>(m.position), mount(), beacon()});
      case SensorType::range_bearing:
        return put(RangeBearing<G, T>{m.range, bearing(m), mount(), beacon()});
      case SensorType::bearing:
        return put(Bearing<G, T>{bearing(m), mount(), beacon()});
      case SensorType::range:
        return put(Range<G, T>{m.range, mount(), beacon()});
      case SensorType::usbl_spherical:
        if constexpr (!Build::planar) put(UsblSpherical<G, T>{m.range, m.azimuth, m.elevation, mount(), beacon()});
        return;
      case SensorType::pose:
        return;
    }
  }

  Direction<kPointDim> bearing(const Measurement& m) const {
    if constexpr (Build::planar) {
      return Direction<2>(m.azimuth);
    } else {
      return Direction<3>(m.azimuth, m.elevation);
    }
  }

  template <class Target>
  void add_pose(const Measurement& m, const Target& target, PlacedMeasurement& placed) {
    const SE3 measured(m.rotation, m.position);
    const Gaussian position(Eigen::VectorXd(sensor_.sigma.head(kPointDim)));
    const auto put = [&](const auto& residual, const Gaussian& noise) {
      placed.block = place(m, residual, target, noise, position_loss_, placed);
    };
    if constexpr (std::same_as<Target, Variable<Point>>) {  // the marker's lever arm turns with the measured pose
      const SE3 body = measured * sensor_.marker.inverse();
      put(UsblPosition<G, Point>{in_group<G>(body.translation()), mount()}, position);
    } else if (!orientation_loss_ || m.held_out) {
      const double share = m.held_out ? 0.0 : build_.options.position_share;
      Eigen::VectorXd sigma = sensor_.sigma;
      sigma.head(kPointDim) /= std::sqrt(1 - share);
      put(RelativePose<G>{in_group<G>(measured), mount(), in_group<G>(sensor_.marker)}, Gaussian(sigma));
      if (share > 0)
        placed.position = place(m, UsblPosition<G>{in_group<G>(m.position), mount(), beacon()}, target,
                                position.scaled(1 / std::sqrt(share)), position_loss_, placed);
    } else {
      put(UsblPosition<G>{in_group<G>(m.position), mount(), beacon()}, position);
      const RelativeRotation<G> rotation{in_group<G>(m.rotation), in_group<G>(sensor_.mount.rotation()),
                                         in_group<G>(sensor_.marker.rotation())};
      const Gaussian noise(Eigen::VectorXd(sensor_.sigma.tail(G::dof - kPointDim)));
      placed.orientation = place(m, rotation, target, noise, *orientation_loss_, placed);
    }
  }

  Build& build_;
  const TargetSensor& sensor_;
  std::size_t index_;
  double fraction_ = 0;
  Gaussian noise_;
  Loss position_loss_;
  std::optional<Loss> orientation_loss_;
};

}  // namespace tandem::detail
