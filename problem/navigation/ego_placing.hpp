#pragma once

#include <tandem/problem/navigation/ego_chain.hpp>
#include <tandem/residuals/biased.hpp>
#include <tandem/residuals/propagated.hpp>

namespace tandem::detail {

/// Where a measurement of the chaser's own sensors joins the problem: at the keyframe before it, the state there carried
/// on to its instant by `ahead`; at the keyframe itself where that is null.
struct EgoPlacing {
  Problem& problem;
  const EgoKeyframe& keyframe;
  const ImuDelta* ahead;
  const Earth& earth;
  const std::optional<Variable<Rn<1>>>& dvl_scale;
  const EgoSensor& sensor;
  const Loss& loss;
  const EgoError* error;  ///< the sensor's own, or null
};

/// As a residual, or, where its sensor has an error that stays, as one that reads that too.
template <class R, class... Xs>
Block place_whole(const EgoPlacing& at, const R& residual, const std::tuple<Xs...>& x) {
  const Gaussian noise(at.sensor.sigma);
  if (!at.error) return at.problem.minimize(residual, noise, x, at.loss);
  const auto& error = std::get<Variable<Rn<R::dim>>>(at.error->state);
  return at.problem.minimize(Biased<R>{residual}, noise, std::tuple_cat(x, std::tuple(error)), at.loss);
}

/// Adds a residual that reads the chaser's pose (SE3), pose and velocity (SE3, R3), or these and the DVL's scale factor
/// (SE3, R3, Rn<1>).
template <class R>
Block place(const EgoPlacing& at, const R& residual) {
  const EgoKeyframe& k = at.keyframe;
  constexpr std::size_t states = std::tuple_size_v<typename R::States>;
  const auto extra = [&] {
    if constexpr (states == 3) {
      return std::tuple(*at.dvl_scale);
    } else {
      return std::tuple<>();
    }
  }();
  if (at.ahead)
    return place_whole(at, Propagated<R>{residual, *at.ahead, at.earth},
                       std::tuple_cat(std::tuple(k.pose, k.velocity, *k.bias), extra));
  if constexpr (states == 1) {
    return place_whole(at, residual, std::tuple(k.pose));
  } else {
    return place_whole(at, residual, std::tuple_cat(std::tuple(k.pose, k.velocity), extra));
  }
}

// One a kind, in a file of its own: place_dvl.cpp, …
Block place_dvl(const EgoPlacing& at, const EgoMeasurement& m);
Block place_depth(const EgoPlacing& at, const EgoMeasurement& m);
Block place_gps(const EgoPlacing& at, const EgoMeasurement& m);
Block place_heading(const EgoPlacing& at, const EgoMeasurement& m);

}  // namespace tandem::detail
