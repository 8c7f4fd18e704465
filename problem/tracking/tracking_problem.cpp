#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/lie/operations.hpp>
#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/residuals/boundary.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/steady_course.hpp>

namespace tandem {
namespace detail {

template <LieGroup G>
void TrackingBuild<G>::add_variables(std::size_t k) {
  const bool junction = k > 0 && is_pose(k) != is_pose(k - 1) && options.junction == Junction::boundary;
  if (junction && is_pose(k - 1) && !boundary_point[k - 1]) add_boundary_point(k - 1);
  const std::string number = std::to_string(k);
  if (chaser.size() <= k) chaser.push_back(problem.add(in_group<G>(odometry[k]), "chaser " + number));
  boundary_point.emplace_back();
  if (is_pose(k)) {
    target.push_back(problem.add(in_group<G>(guess.pose[k]), "target " + number));
    if (junction) add_boundary_point(k);
  } else {
    target.push_back(problem.add(Point(in_group<G>(guess.pose[k].translation())), "target " + number));
  }
  if (options.model == MotionModel::white_noise_acceleration) {
    Rn<G::dof> w;
    if (size() > 1) {
      const std::size_t from = std::min(k, size() - 2);
      w = Rn<G::dof>(minus(in_group<G>(guess.pose[from + 1]), in_group<G>(guess.pose[from])) / dt(from, from + 1));
    }
    twist.push_back(problem.add(w, "target twist " + number));
  }
}

template <LieGroup G>
void TrackingBuild<G>::add_boundary_point(std::size_t k) {
  const Point point(in_group<G>(guess.pose[k].translation()));
  boundary_point[k] = problem.add(point, "target point " + std::to_string(k));
  const Gaussian noise = noise_of("boundary", data.noise.boundary, G::point_dim);
  minimize(Boundary<G>{}, "boundary", noise, {*pose(k), *boundary_point[k]});
}

template <LieGroup G>
void TrackingBuild<G>::add_course_variables() {
  for (std::size_t k = chaser.size(); k < size(); ++k)
    chaser.push_back(problem.add(in_group<G>(odometry[k]), "chaser " + std::to_string(k)));
  // All measurements read these variables. Adding them last keeps the rest of the Hessian narrow-banded.
  const auto first = problem.add(in_group<G>(guess.pose[0]), "target's first pose");
  const auto speed = problem.add(Rn<1>(Vector<1>(guess.velocity[0].norm())), "target's speed");
  for (std::size_t k = 0; k < size(); ++k) target.push_back(CourseVariable<G>{first, speed, dt(0, k)});
  boundary_point.resize(size());
}

template <LieGroup G>
void TrackingBuild<G>::add_odometry(std::size_t k) {
  const auto pose = [&](std::size_t i) { return in_group<G>(odometry[i]); };
  if (k == 0) {
    problem.minimize(Prior<G>{pose(0)}, noise_of("prior", data.noise.prior, G::dof), {chaser[0]});
  } else {
    const Gaussian noise = noise_of("odometry", data.noise.odometry, G::dof).scaled(std::sqrt(dt(k - 1, k)));
    minimize(RelativePose<G>{pose(k - 1).inverse() * pose(k)}, "odometry", noise, {chaser[k - 1], chaser[k]});
  }
}

template void TrackingBuild<SE3>::add_variables(std::size_t);
template void TrackingBuild<SE2>::add_variables(std::size_t);
template void TrackingBuild<SE3>::add_odometry(std::size_t);
template void TrackingBuild<SE2>::add_odometry(std::size_t);

}  // namespace detail

namespace {

constexpr std::string_view kBuilding = "building the problem";

}  // namespace

void check(const TrackingOptions& options) {
  const bool points_only = is_point_model(options.model);
  if (options.mode == Mode::B && !supports_points(options.model))
    throw BadInputError("mode B requires the constant-twist or the damped-twist model");
  if (options.surge && !(options.surge->lower[0] <= options.surge->upper[0]))
    throw BadInputError("the lower bound of surge " + std::to_string(options.surge->lower[0]) +
                        " is above its upper bound " + std::to_string(options.surge->upper[0]));
  if (options.max_yaw_rate && !(*options.max_yaw_rate >= 0))
    throw BadInputError("the limit of the yaw rate must be zero or positive, not " +
                        std::to_string(*options.max_yaw_rate));
  const bool course = options.model == MotionModel::steady_course;
  if (course && (options.non_holonomic != Role::off || options.surge || options.max_yaw_rate))
    throw BadInputError("the steady-course model has constant heading and speed; remove the constraints on the twist");
  if (points_only && (options.non_holonomic != Role::off || options.surge || options.max_yaw_rate))
    throw BadInputError("the " + std::string(name(options.model)) +
                        " model has no orientation; remove the non-holonomic, surge and yaw-rate constraints");
  if (!(options.position_share >= 0 && options.position_share < 1))
    throw BadInputError("position_share must be in [0, 1), not " + std::to_string(options.position_share));
  if (options.horizons.empty()) throw BadInputError("horizons: at least one is required, e.g. 1 back and 1 ahead");
  for (const Horizon& h : options.horizons)
    if (h.back < 1 || h.ahead < 1)
      throw BadInputError("horizons: the numbers of keyframes back and ahead must be at least 1, not " +
                          std::to_string(h.back) + " and " + std::to_string(h.ahead));
  const bool neighbours =
      options.horizons.size() == 1 && options.horizons[0].back == 1 && options.horizons[0].ahead == 1;
  if (!uses_triples(options.model) && !neighbours)
    throw BadInputError("the " + std::string(name(options.model)) +
                        " model does not use horizons; remove them, or use a constant or damped model");
}

namespace {

/// Returns flags by [sensor][index] of the gross outliers, which get no residual. Under a robust loss they would
/// contribute only rounding errors, and they would disturb a graduated loss. Pose sensors are exempt in Mode B, where
/// they determine the type of a keyframe.
template <LieGroup G>
std::vector<std::vector<bool>> gross_outliers(const detail::TrackingBuild<G>& build) {
  std::vector<std::vector<bool>> gross = outlier_mask(build.data, build.out.outliers, true);
  for (std::size_t s = 0; s < gross.size(); ++s)
    if (build.options.mode == Mode::B && build.data.sensors[s].type->has(measured::rotation))
      gross[s].assign(gross[s].size(), false);
  return gross;
}

template <LieGroup G>
void add_measurements(detail::TrackingBuild<G>& build, const Stop& stop) {
  const std::vector<Keyframe>& keyframes = build.out.keyframes;
  const std::vector<std::vector<bool>> gross = gross_outliers(build);
  for (std::size_t s = 0; s < build.data.sensors.size(); ++s) {
    const TargetSensor& sensor = build.data.sensors[s];
    std::size_t num_discarded = 0;
    for (std::size_t i = 0; i < sensor.measurements.size(); ++i) {
      stop.check(kBuilding);
      const double t = sensor.valid_at(sensor.measurements[i]);
      if (const auto k = keyframe_at(keyframes, t)) {
        if (gross[s][i])
          build.out.measurements.push_back({s, i, *k, {}, {}, {}, {}});
        else
          build.add_measurement(s, i, *k);
      } else if (t < keyframes.front().t || (build.data.ego && t > build.data.odometry.back().t + kSameInstant)) {
        ++num_discarded;
      }
    }
    build.out.num_discarded.push_back(num_discarded);
  }
}

template <LieGroup G>
void build(const TrackingData& data, const TrackingOptions& options, const Stop& stop, TrackingProblem& out) {
  std::vector<SE3> odometry = odometry_at(data.odometry, out.keyframes);
  for (SE3& pose : odometry) pose = in_space(in_group<G>(pose));
  TargetGuess guess = initial_target_guess(data, out.keyframes, odometry, options, stop);
  out.outliers = guess.outliers;
  if (options.model == MotionModel::steady_course) guess = straight_line_guess(guess, out.keyframes);
  detail::TrackingBuild<G> build{data, options, out.problem, out, std::move(odometry), std::move(guess)};
  const std::size_t n = out.keyframes.size();
  std::optional<detail::EgoTrackBuild> ego;
  if (data.ego) ego.emplace(*data.ego, out);
  const bool course = options.model == MotionModel::steady_course;
  for (std::size_t k = 0; k < n; ++k) {  // alternates chaser and target to keep the Hessian narrow-banded
    stop.check(kBuilding);
    if constexpr (std::same_as<G, SE3>)
      if (ego) build.chaser.push_back(ego->add(k));
    if (!course) build.add_variables(k);
  }
  if (course) build.add_course_variables();
  out.chaser.assign(build.chaser.begin(), build.chaser.end());
  out.twist.assign(build.twist.begin(), build.twist.end());
  for (const auto& x : build.target) std::visit([&](const auto& v) { out.target.emplace_back(v); }, x);
  if (!ego)
    for (std::size_t k = 0; k < n; ++k) build.add_odometry(k);
  add_measurements(build, stop);
  build.assume_range();
  out.constants.insert(out.constants.end(), build.constants.all().begin(), build.constants.all().end());
  for (std::size_t k = 0; k < n; ++k) {
    stop.check(kBuilding);
    build.add_motion(k);
  }
  for (std::size_t k = 0; k < n; ++k) build.add_constraints(k);
}

}  // namespace

Loss loss_of(const TargetSensor& sensor, const TrackingOptions& options) { return sensor.loss.value_or(options.loss); }

std::optional<Loss> orientation_loss_of(const TargetSensor& sensor, const TrackingOptions& options) {
  return sensor.orientation_loss ? sensor.orientation_loss : options.orientation_loss;
}

void make_robust(TrackingOptions& options) {
  options.loss = Cauchy(2.0);
  options.position_share = 1.0 / 9.0;
  options.robust_initial_guess = true;
}

std::string_view name(MotionModel model) {
  constexpr std::string_view names[] = {"constant-twist",  "constant-velocity",        "damped-twist",
                                        "damped-velocity", "white-noise-acceleration", "steady-course",
                                        "no-motion"};
  return names[int(model)];
}

bool uses_triples(MotionModel model) {
  return model != MotionModel::white_noise_acceleration && model != MotionModel::steady_course &&
         model != MotionModel::none;
}
bool is_point_model(MotionModel model) {
  return model == MotionModel::constant_velocity || model == MotionModel::damped_velocity;
}
bool supports_points(MotionModel model) {
  return model == MotionModel::constant_twist || model == MotionModel::damped_twist;
}

TrackingProblem make_tracking_problem(const TrackingData& data, const TrackingOptions& options, const Stop& stop) {
  check(options);
  if (data.ego && data.planar)
    throw BadInputError(
        "a planar problem requires odometry; the chaser's own sensors are supported only in space (group SE3)");
  TrackingProblem out;
  out.keyframes = make_keyframes(data, options.max_keyframes);
  data.planar ? build<SE2>(data, options, stop, out) : build<SE3>(data, options, stop, out);
  return out;
}

SE3 TrackingProblem::chaser_pose(std::size_t k) const {
  return std::visit([&](const auto& x) { return SE3(in_space(problem.value(x))); }, chaser[k]);
}

TargetState TrackingProblem::target_state(std::size_t k) const {
  const auto on_course = [&]<LieGroup G>(const CourseVariable<G>& x) {
    return problem.value(x.first) * steady_course_motion<G>(x.t, problem.value(x.speed).vector()[0]);
  };
  return std::visit(
      [&]<class X>(const X& x) {
        if constexpr (requires { x.first; }) {
          return TargetState(in_space(on_course(x)));
        } else {
          return TargetState(in_space(problem.value(x)));
        }
      },
      target[k]);
}

}  // namespace tandem
