#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking_build.hpp>
#include <tandem/residuals/boundary.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/mixed_constant_velocity.hpp>
#include <tandem/residuals/white_noise_acceleration.hpp>

namespace tandem::detail {
namespace {

/// Variance per second of a triple against that of neighbours (1, 1), when what disturbs the motion is independent from
/// one keyframe to the next: the disturbances in between add up. With several horizons, which see the same disturbances
/// again, each counts for its share, so that together they say no more than one would.
double variance_ratio(const Horizon& h) {
  const double m = h.back, n = h.ahead;
  return ((n + 1) * (2 * n + 1) + n * (m - 1) * (2 * m - 1) / m) / 6;
}

/// Constant twist over three poses, constant velocity over any other triple, at each of the horizons.
template <LieGroup G>
void add_triples(TrackingBuild<G>& build) {
  using Build = TrackingBuild<G>;
  using Point = typename Build::Point;
  using PoseOrPoint = std::variant<Variable<G>, Variable<Point>>;
  const auto& noise = build.data.noise;
  const bool any_point = std::any_of(build.target.begin(), build.target.end(), [](const typename Build::State& x) {
    return std::holds_alternative<Variable<Point>>(x);
  });
  const bool any_pose = build.options.model != MotionModel::constant_velocity;
  std::optional<Gaussian> twist, velocity;
  if (any_pose) twist = noise_of("constant_twist", noise.constant_twist, G::dof);
  if (any_point) velocity = noise_of("constant_velocity", noise.constant_velocity, G::point_dim);

  const auto pose_or_point = [&](std::size_t k) -> PoseOrPoint {
    if (build.twin[k]) return *build.twin[k];
    if (build.pose(k)) return *build.pose(k);
    return std::get<Variable<Point>>(build.target[k]);
  };
  for (const Horizon& h : build.options.horizons) {
    const auto back = std::size_t(h.back), ahead = std::size_t(h.ahead);
    const double spread = variance_ratio(h) * double(build.options.horizons.size());
    for (std::size_t k = back; k + ahead < build.size(); ++k) {
      const std::size_t first = k - back, last = k + ahead;
      const double dt1 = build.dt(first, k), dt2 = build.dt(k, last), scale = std::sqrt(spread * dt2);
      const auto *x0 = build.pose(first), *x1 = build.pose(k), *x2 = build.pose(last);
      if (x0 && x1 && x2) {
        build.out.problem.minimize(ConstantTwist<G>{dt1, dt2}, twist->scaled(scale), {*x0, *x1, *x2});
        continue;
      }
      std::visit(
          [&]<LieGroup A, LieGroup B, LieGroup C>(const Variable<A>& a, const Variable<B>& b, const Variable<C>& c) {
            build.out.problem.minimize(MixedConstantVelocity<A, B, C>{dt1, dt2}, velocity->scaled(scale), {a, b, c});
          },
          pose_or_point(first), pose_or_point(k), pose_or_point(last));
    }
  }
  if (std::none_of(build.twin.begin(), build.twin.end(), [](const auto& x) { return x.has_value(); })) return;
  const Gaussian boundary = noise_of("boundary", noise.boundary, G::point_dim);
  for (std::size_t k = 0; k < build.size(); ++k)
    if (build.twin[k]) build.out.problem.minimize(Boundary<G>{}, boundary, {*build.pose(k), *build.twin[k]});
}

template <LieGroup G>
void add_white_noise_acceleration(TrackingBuild<G>& build) {
  const auto& noise = build.data.noise;
  const Eigen::VectorXd& sigma = noise.acceleration.isZero(0) ? noise.constant_twist : noise.acceleration;
  noise_of("acceleration (or constant_twist)", sigma, G::dof);
  const Vector<G::dof> densities = sigma.cwiseAbs2();
  for (std::size_t k = 1; k < build.size(); ++k) {
    const double dt = build.dt(k - 1, k);
    const Gaussian spread = Gaussian::covariance(WhiteNoiseAcceleration<G>::covariance(densities, dt));
    build.out.problem.minimize(WhiteNoiseAcceleration<G>{dt}, spread,
                               {*build.pose(k - 1), build.twist[k - 1], *build.pose(k), build.twist[k]});
  }
}

}  // namespace

template <LieGroup G>
void TrackingBuild<G>::add_motion() {
  switch (options.model) {
    case MotionModel::constant_twist:
    case MotionModel::constant_velocity:
      return add_triples(*this);
    case MotionModel::white_noise_acceleration:
      return add_white_noise_acceleration(*this);
    case MotionModel::steady_course:
      return;  // the course is in what every measurement reads
  }
}

template void TrackingBuild<SE3>::add_motion();
template void TrackingBuild<SE2>::add_motion();

}  // namespace tandem::detail
