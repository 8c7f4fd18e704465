#pragma once

#include <cmath>

#include <tandem/problem/tracking/sensor_build.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/relative_rotation.hpp>
#include <tandem/residuals/usbl_position.hpp>

namespace tandem {

struct PlacePose;

namespace detail {

/// Adds a pose measurement, as one residual or as separate residuals of position and orientation.
template <LieGroup G, bool between>
class PoseBuild : private SensorBuild<G, between> {
  using Base = SensorBuild<G, between>;
  using Base::add_with, Base::beacon, Base::mount, Base::add_residual, Base::add_with_errors;
  using Base::build_, Base::sensor_, Base::measurement_, Base::placed_, Base::position_loss_;
  using typename Base::Point;

 public:
  using Base::Base;

  void add() {
    add_with([&](const auto& target) { add_pose(target); });
  }

 private:
  template <class Target>
  void add_pose(const Target& target) {
    const Measurement& m = measurement_;
    const SE3 measured(m.rotation, m.position);
    const std::optional<Loss> orientation_loss = orientation_loss_of(sensor_, build_.options);
    constexpr bool point = std::same_as<Target, Variable<Point>>;
    if (sensor_.error && (orientation_loss || build_.options.position_share > 0))
      throw BadInputError(
          sensor_.name +
          ": systematic errors of a pose sensor do not support an orientation loss or a position share; " +
          "remove these options (or --robust) or the errors");
    if (point && sensor_.error && sensor_.error->has_bias())
      throw BadInputError(sensor_.name +
                          ": the bias of a pose cannot be estimated at a point of mode B; remove `sigma`");
    const Gaussian position(Eigen::VectorXd(sensor_.sigma.head(G::point_dim)));
    // For a point, the measured orientation rotates the marker's lever arm. A scale factor applies to the distance of
    // the body, not of the marker.
    if constexpr (point) {
      const SE3 body = measured * sensor_.marker.inverse();
      placed_.block = add_with_errors(UsblPosition<G, Point>{in_group<G>(body.translation()), mount()},
                                      Vector<G::point_dim>::Zero(), target, position, position_loss_);
    } else if (!orientation_loss || m.held_out) {
      const double share = m.held_out ? 0.0 : build_.options.position_share;
      Eigen::VectorXd sigma = sensor_.sigma;
      sigma.head(G::point_dim) /= std::sqrt(1 - share);
      placed_.block = add_with_errors(RelativePose<G>{in_group<G>(measured), mount(), in_group<G>(sensor_.marker)},
                                      beacon(), target, Gaussian(sigma), position_loss_);
      if (share > 0)
        placed_.position = add_residual(UsblPosition<G>{in_group<G>(m.position), mount(), beacon()}, target,
                                        position.scaled(1 / std::sqrt(share)), position_loss_);
    } else {
      placed_.block =
          add_residual(UsblPosition<G>{in_group<G>(m.position), mount(), beacon()}, target, position, position_loss_);
      const RelativeRotation<G> rotation{in_group<G>(m.rotation), in_group<G>(sensor_.mount.rotation()),
                                         in_group<G>(sensor_.marker.rotation())};
      const Gaussian noise(Eigen::VectorXd(sensor_.sigma.tail(G::dof - G::point_dim)));
      placed_.orientation = add_residual(rotation, target, noise, *orientation_loss);
    }
  }
};

template <LieGroup G>
void place_pose(TrackingBuild<G>& build, const Placing& at) {
  if (interpolates(build, at)) {
    PoseBuild<G, true>(build, at).add();
  } else {
    PoseBuild<G, false>(build, at).add();
  }
}

}  // namespace detail
}  // namespace tandem
