#include <algorithm>
#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/problem/tracking/motion_neighbours.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/target_window.hpp>

namespace tandem::detail {
namespace {

constexpr double kTwistInterval = 1.0;  // s; twists and velocities are averages over this time

TrackingData without_measurements(TrackingData data) {
  for (TargetSensor& sensor : data.sensors) sensor.measurements.clear();
  data.odometry.clear();
  data.ego.reset();
  return data;
}

template <class T>
void drop_front(std::vector<T>& v, std::size_t n) {
  v.erase(v.begin(), v.begin() + std::ptrdiff_t(std::min(n, v.size())));
}

}  // namespace

template <LieGroup G>
TargetWindow<G>::TargetWindow(Problem& problem, const TrackingData& settings, const TrackingOptions& options)
    : problem_(problem), data_(without_measurements(settings)), options_(options), build_{data_, options_, problem_,
                                                                                          out_,  {},       {}} {}

template <LieGroup G>
void TargetWindow<G>::add_keyframe(double t, const SE3& dead_reckoned, const Variable<G>* chaser, std::size_t sensor,
                                   const Measurement* first) {
  Keyframe keyframe{t, KeyframeType::none, {}, {}};
  if (first) update_type(keyframe, data_.sensors[sensor], *first);
  const std::size_t k = size();
  const SE3 odometry = in_space(in_group<G>(dead_reckoned));
  SE3 chaser_pose = odometry;
  if (chaser) {
    chaser_given_ = true;
    chaser_pose = in_space(problem_.value(*chaser));
  } else if (k > 0) {
    chaser_pose = this->chaser(k - 1) * (build_.odometry.back().inverse() * odometry);
  }
  SE3 target;
  if (k > 0) {
    const TargetState state = predicted(t);
    target = SE3(state.rotation.value_or(keyframe.measured_rotation
                                             ? chaser_pose.rotation() * *keyframe.measured_rotation
                                             : SO3::Exp({0, 0, heading(build_.guess.pose.back().rotation())})),
                 state.position);
  } else {
    if (!keyframe.measured_position) throw BadInputError("the first keyframe of a target needs a measured position");
    target = SE3(keyframe.measured_rotation ? chaser_pose.rotation() * *keyframe.measured_rotation : SO3(),
                 chaser_pose.act(*keyframe.measured_position));
  }
  out_.keyframes.push_back(keyframe);
  build_.odometry.push_back(odometry);
  build_.guess.pose.push_back(in_space(in_group<G>(target)));
  build_.guess.velocity.push_back(Vector<3>::Zero());
  if (chaser) build_.chaser.push_back(*chaser);
  const bool twin_before = k > 0 && build_.boundary_point[k - 1].has_value();
  build_.add_variables(k);
  new_boundary_point_ = k > 0 && !twin_before && build_.boundary_point[k - 1].has_value();
  if (!chaser) {
    problem_.set_value(build_.chaser[k], in_group<G>(chaser_pose));
    build_.add_odometry(k);
  }
  build_.add_motion(k);
  build_.add_constraints(k);
}

template <LieGroup G>
bool TargetWindow<G>::prepare_bias(std::size_t sensor, const Measurement& m) {
  const TargetSensor& by = data_.sensors[sensor];
  const double t = by.valid_at(m);
  if (!by.error || !by.error->has_bias() || !keyframe_at_or_before(out_.keyframes, t)) return false;
  const auto known = build_.biases.find(sensor);
  if (known == build_.biases.end()) {
    build_.bias_at(sensor, t);
    return true;
  }
  auto before = known->second;
  if (build_.bias_at(sensor, t).t == before.t) return false;
  if (const auto k = keyframe_at_or_before(out_.keyframes, before.t)) before.t = out_.keyframes[*k].t;
  superseded_biases_.push_back(before);
  return true;
}

template <LieGroup G>
std::optional<std::string> TargetWindow<G>::add_measurement(std::size_t sensor, const Measurement& m) {
  TargetSensor& by = data_.sensors[sensor];
  const double t = by.valid_at(m);
  const auto k = keyframe_at_or_before(out_.keyframes, t);
  if (!k)
    return by.name + ": the measurement valid at " + std::to_string(t) + " s is outside the window, " +
           std::to_string(out_.keyframes.front().t) + " to " + std::to_string(out_.keyframes.back().t) + " s";
  const bool delayed = by.error && by.error->delay_sigma > 0;
  auto fixed = fixed_delays_.find(sensor);
  if (delayed && fixed == fixed_delays_.end()) {
    const Variable<Rn<1>> value = problem_.add(Rn<1>(), by.name + ".delay (fixed)");
    problem_.fix(value);
    fixed = fixed_delays_.emplace(sensor, FixedDelay{value, by.error->delay_sigma}).first;
  }
  if (delayed) build_.fixed_delay = fixed->second.value;
  by.measurements.push_back(m);
  try {
    place_newest(sensor, *k);
  } catch (const BadInputError& error) {
    build_.fixed_delay.reset();
    by.measurements.pop_back();
    return error.what();
  }
  build_.fixed_delay.reset();
  if (delayed) {
    add_delay_noise(fixed->second, last_block());
    const auto bias = build_.biases.find(sensor);
    fixed_delay_measurements_.push_back({sensor, m, last_block(), {}});
    if (bias != build_.biases.end()) fixed_delay_measurements_.back().bias = bias->second;
  }
  if (const auto at = keyframe_at(out_.keyframes, t)) update_type(out_.keyframes[*at], by, m);
  return std::nullopt;
}

/// Adds the uncertainty of a fixed delay to the noise of a block.
template <LieGroup G>
void TargetWindow<G>::add_delay_noise(const FixedDelay& delay, const Block& block) {
  const Problem::Linearization at = problem_.linearization(block);
  for (std::size_t v = 0, column = 0; v < at.dofs.size(); column += std::size_t(at.dofs[v++])) {
    if (at.variable_ids[v] != problem_.id(delay.value)) continue;
    const Eigen::VectorXd noise = delay.sigma * at.jacobian.col(Eigen::Index(column));
    if (!(noise.norm() > 0)) return;  // no motion yet
    problem_.set_noise(block,
                       Gaussian::covariance(problem_.noise(block).covariance_matrix() + noise * noise.transpose()));
  }
}

/// Adds the newest measurement of a sensor to the problem, at keyframe k or between k and k + 1.
template <LieGroup G>
void TargetWindow<G>::place_newest(std::size_t sensor, std::size_t k) {
  const TargetSensor& by = data_.sensors[sensor];
  const std::size_t i = by.measurements.size() - 1;
  if (std::abs(by.valid_at(by.measurements[i]) - out_.keyframes[k].t) <= kSameInstant) {
    build_.add_measurement(sensor, i, k);
  } else {
    build_.add_measurement_after(sensor, i, k);
  }
}

template <LieGroup G>
void TargetWindow<G>::remove_last_measurement() {
  const PlacedMeasurement placed = out_.measurements.back();
  if (const auto& error = data_.sensors[placed.sensor].error; error && error->delay_sigma > 0)
    fixed_delay_measurements_.pop_back();
  for (const auto& block : {placed.block, placed.orientation, placed.position})
    if (block) problem_.remove(*block);
  out_.measurements.pop_back();
  data_.sensors[placed.sensor].measurements.pop_back();
  Keyframe& keyframe = out_.keyframes[placed.keyframe];
  keyframe = {keyframe.t, KeyframeType::none, {}, {}};
  for (const TargetSensor& sensor : data_.sensors)
    for (const Measurement& m : sensor.measurements)
      if (std::abs(sensor.valid_at(m) - keyframe.t) <= kSameInstant) update_type(keyframe, sensor, m);
}

template <LieGroup G>
void TargetWindow<G>::free_delays(double reach) {
  for (auto& [sensor, fixed] : fixed_delays_)
    for (const SensorConstant& c : build_.constants.all()) {
      if (c.name != data_.sensors[sensor].name + ".delay") continue;
      problem_.set_value(fixed.value, problem_.value(std::get<Variable<Rn<1>>>(c.state)));
      fixed.sigma = 0;
    }
  std::erase_if(fixed_delay_measurements_, [&](const FixedDelayMeasurement& m) {
    const TargetSensor& by = data_.sensors[m.sensor];
    const auto k = keyframe_at_or_before(out_.keyframes, by.valid_at(m.measurement));
    if (!k || !problem_.has(m.block)) return true;  // a keyframe that it reads was dropped
    const auto same_type = [&](std::size_t i) {
      using Point = typename TrackingBuild<G>::Point;
      return build_.pose(*k) ? build_.pose(i) != nullptr : build_.template target_at<Point>(i) != nullptr;
    };
    const bool enough = build_.dt(*k, size() - 1) >= reach ||
                        motion_neighbours(build_, *k, motion_half_window(*by.error), same_type).is_final;
    return enough && free_delay(m, *k);
  });
}

/// Replaces the block of a measurement by one that reads the estimated delay. Returns false if there is no second
/// keyframe at which the target has the same type, a pose or a point.
template <LieGroup G>
bool TargetWindow<G>::free_delay(const FixedDelayMeasurement& m, std::size_t k) {
  TargetSensor& by = data_.sensors[m.sensor];
  by.measurements.push_back(m.measurement);
  std::optional<typename TrackingBuild<G>::SensorBias> newest;  // restored below
  if (m.bias) newest = std::exchange(build_.biases.at(m.sensor), *m.bias);
  bool done = true;
  try {
    place_newest(m.sensor, k);
    out_.measurements.pop_back();
    problem_.remove(m.block);
    std::erase_if(out_.measurements,
                  [&](const PlacedMeasurement& placed) { return placed.block && !problem_.has(*placed.block); });
  } catch (const BadInputError&) {
    done = false;
  }
  if (newest) build_.biases.at(m.sensor) = *newest;
  by.measurements.pop_back();
  return done;
}

template <LieGroup G>
void TargetWindow<G>::drop_before(double t) {
  std::size_t n = 0;
  while (n + 1 < size() && out_.keyframes[n].t < t) ++n;
  if (n == 0) return;
  drop_front(out_.keyframes, n);
  drop_front(build_.odometry, n);
  drop_front(build_.guess.pose, n);
  drop_front(build_.guess.velocity, n);
  drop_front(build_.chaser, n);
  drop_front(build_.target, n);
  drop_front(build_.boundary_point, n);
  drop_front(build_.twist, n);
  out_.measurements.clear();
  out_.noise_blocks.clear();
  for (TargetSensor& sensor : data_.sensors)
    std::erase_if(sensor.measurements,
                  [&](const Measurement& m) { return sensor.valid_at(m) < out_.keyframes.front().t - kSameInstant; });
}

template <LieGroup G>
TargetState TargetWindow<G>::target(std::size_t k) const {
  return std::visit(
      [&]<class X>(const X& x) -> TargetState {
        if constexpr (requires { x.first; }) {
          throw BadInputError("the steady-course model does not support sliding windows");
        } else {
          return TargetState(in_space(problem_.value(x)));
        }
      },
      build_.target[k]);
}

/// Returns the latest keyframe that is a second or more before the last one.
template <LieGroup G>
std::size_t TargetWindow<G>::reference() const {
  std::size_t k = size() - 1;
  const double last = out_.keyframes[k].t;
  while (k > 0 && last - out_.keyframes[k].t < kTwistInterval - kSameInstant) --k;
  return k;
}

template <LieGroup G>
TargetState TargetWindow<G>::predicted(double t) const {
  const std::size_t last = size() - 1, from = reference();
  const TargetState now = target(last), then = target(from);
  const double dt = build_.dt(from, last);
  if (!(dt > 0)) return now;
  const double ahead = (t - out_.keyframes[last].t) / dt;
  if (now.rotation && then.rotation)
    return in_space(
        in_group<G>(interpolate(SE3(*then.rotation, then.position), SE3(*now.rotation, now.position), 1 + ahead)));
  TargetState result = now;
  result.position += ahead * (now.position - then.position);
  return result;
}

template <LieGroup G>
std::optional<TargetForecast<G>> TargetWindow<G>::forecast(double h, const JointCovariance& covariance) const {
  const std::size_t last = size() - 1;
  if (last == 0) return {};
  const double interval = data_.keyframe_interval;
  const auto joint = [&](const auto& x, const auto& y) {
    return covariance({problem_.id(build_.chaser[last]), problem_.id(x), problem_.id(y)}, {G::dof, G::dof, G::dof});
  };
  if (options_.model == MotionModel::white_noise_acceleration) {
    const Variable<G>& pose = *build_.pose(last);
    const auto& twist = build_.twist[last];
    const TwistForecastStart<G> start{problem_.value(pose), problem_.value(twist), joint(pose, twist)};
    return detail::forecast(start, options_, data_.noise, interval, h);
  }
  if (options_.mode == Mode::B || is_point_model(options_.model)) {
    auto ahead = detail::forecast(point_forecast_start(covariance), options_, data_.noise, interval, h);
    if (ahead) ahead->state.rotation = predicted(out_.keyframes[last].t + h).rotation;
    return ahead;
  }
  const auto &before = *build_.pose(last - 1), &now = *build_.pose(last);
  const PoseForecastStart<G> start{problem_.value(before), problem_.value(now), build_.dt(last - 1, last),
                                   joint(before, now)};
  return detail::forecast(start, options_, data_.noise, interval, h);
}

/// Returns the initial state of a forecast with points. If the last keyframe is a pose without a boundary point, adds
/// the noise of the Boundary residual that a next point would need.
template <LieGroup G>
PointForecastStart<G> TargetWindow<G>::point_forecast_start(const JointCovariance& covariance) const {
  using Point = typename TrackingBuild<G>::Point;
  constexpr int P = G::point_dim;
  const std::size_t last = size() - 1;
  PointForecastStart<G> start;
  start.dt = build_.dt(last - 1, last);
  std::visit(
      [&]<LieGroup A, LieGroup B>(const Variable<A>& before, const Variable<B>& now) {
        const Vector<P> origin = Vector<P>::Zero();
        const A& from = problem_.value(before);
        const B& to = problem_.value(now);
        start.before = Point(from.act(origin));
        start.now = Point(to.act(origin));
        Matrix<G::dof + 2 * P, G::dof + A::dof + B::dof> J;
        J.setZero();
        J.template topLeftCorner<G::dof, G::dof>().setIdentity();
        J.template block<P, A::dof>(G::dof, G::dof) = from.act_jacobian(origin);
        J.template bottomRightCorner<P, B::dof>() = to.act_jacobian(origin);
        start.covariance = J *
                           covariance({problem_.id(build_.chaser[last]), problem_.id(before), problem_.id(now)},
                                      {G::dof, A::dof, B::dof}) *
                           J.transpose();
        if (std::same_as<B, G> && options_.junction == Junction::boundary)
          start.covariance.diagonal().template tail<P>() += data_.noise.boundary.cwiseAbs2();
      },
      build_.pose_or_point(last - 1), build_.pose_or_point(last));
  return start;
}

template <LieGroup G>
SE3 TargetWindow<G>::predicted_chaser(double t) const {
  const std::size_t last = size() - 1, from = reference();
  const double dt = build_.dt(from, last);
  return dt > 0 ? interpolate(chaser(from), chaser(last), 1 + (t - out_.keyframes[last].t) / dt) : chaser(last);
}

template <LieGroup G>
Vector<3> TargetWindow<G>::velocity() const {
  const std::size_t last = size() - 1, from = reference();
  const double dt = build_.dt(from, last);
  return dt > 0 ? Vector<3>((target(last).position - target(from).position) / dt) : Vector<3>::Zero();
}

template <LieGroup G>
std::vector<TargetState> TargetWindow<G>::values() const {
  std::vector<TargetState> values;
  for (std::size_t k = 0; k < size(); ++k) values.push_back(target(k));
  return values;
}

template <LieGroup G>
void TargetWindow<G>::set_values(const std::vector<TargetState>& values) {
  using Point = typename TrackingBuild<G>::Point;
  for (std::size_t k = 0; k < size(); ++k) {
    const TargetState& value = values[k];
    const Point point(in_group<G>(value.position));
    if (const auto* pose = build_.pose(k)) {
      problem_.set_value(*pose, in_group<G>(SE3(value.rotation.value_or(SO3()), value.position)));
    } else {
      problem_.set_value(std::get<Variable<Point>>(build_.target[k]), point);
    }
    if (build_.boundary_point[k]) problem_.set_value(*build_.boundary_point[k], point);
  }
  for (std::size_t k = 0; k + 1 < size() && k < build_.twist.size(); ++k) {
    const auto twist = [&](std::size_t from) {
      const auto pose = [&](std::size_t i) {
        return in_group<G>(SE3(values[i].rotation.value_or(SO3()), values[i].position));
      };
      return Rn<G::dof>(minus(pose(from + 1), pose(from)) / build_.dt(from, from + 1));
    };
    problem_.set_value(build_.twist[k], twist(k));
    if (k + 2 == size()) problem_.set_value(build_.twist[k + 1], twist(k));
  }
}

template <LieGroup G>
std::vector<TargetState> TargetWindow<G>::initial_guess() const {
  std::vector<SE3> chaser;
  for (std::size_t k = 0; k < size(); ++k) chaser.push_back(this->chaser(k));
  const TargetGuess guess = initial_target_guess(data_, out_.keyframes, chaser, options_);
  std::vector<TargetState> values;
  for (const SE3& pose : guess.pose) values.emplace_back(pose);
  return values;
}

template <LieGroup G>
double TargetWindow<G>::orientation_innovation() const {
  const std::size_t k = size() - 1;
  const auto& measured = out_.keyframes[k].measured_rotation;
  const TargetState estimated = target(k);
  if (!measured || !estimated.rotation) return 0;
  return (estimated.rotation->inverse() * chaser(k).rotation() * *measured).Log().norm();
}

template class TargetWindow<SE3>;
template class TargetWindow<SE2>;

}  // namespace tandem::detail
