#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/tracking_build.hpp>
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

/// Constant twist over three poses, constant velocity over any other triple, at each of the horizons that ends at `last`.
template <LieGroup G>
void add_triples(TrackingBuild<G>& build, std::size_t last) {
  using Point = typename TrackingBuild<G>::Point;
  using PoseOrPoint = std::variant<Variable<G>, Variable<Point>>;
  const auto& noise = build.data.noise;
  const auto pose_or_point = [&](std::size_t k) -> PoseOrPoint {
    if (build.twin[k]) return *build.twin[k];
    if (build.pose(k)) return *build.pose(k);
    return std::get<Variable<Point>>(build.target[k]);
  };
  for (const Horizon& h : build.options.horizons) {
    const auto back = std::size_t(h.back), ahead = std::size_t(h.ahead);
    if (last < back + ahead) continue;
    const std::size_t k = last - ahead, first = k - back;
    const double dt1 = build.dt(first, k), dt2 = build.dt(k, last);
    const double scale = std::sqrt(variance_ratio(h) * double(build.options.horizons.size()) * dt2);
    const auto *x0 = build.pose(first), *x1 = build.pose(k), *x2 = build.pose(last);
    if (x0 && x1 && x2) {
      const Gaussian twist = noise_of("constant_twist", noise.constant_twist, G::dof);
      build.problem.minimize(ConstantTwist<G>{dt1, dt2}, twist.scaled(scale), {*x0, *x1, *x2});
      continue;
    }
    const Gaussian velocity = noise_of("constant_velocity", noise.constant_velocity, G::point_dim);
    std::visit(
        [&]<LieGroup A, LieGroup B, LieGroup C>(const Variable<A>& a, const Variable<B>& b, const Variable<C>& c) {
          build.problem.minimize(MixedConstantVelocity<A, B, C>{dt1, dt2}, velocity.scaled(scale), {a, b, c});
        },
        pose_or_point(first), pose_or_point(k), pose_or_point(last));
  }
}

template <LieGroup G>
void add_white_noise_acceleration(TrackingBuild<G>& build, std::size_t k) {
  if (k == 0) return;
  const auto& noise = build.data.noise;
  const Eigen::VectorXd& sigma = noise.acceleration.isZero(0) ? noise.constant_twist : noise.acceleration;
  noise_of("acceleration (or constant_twist)", sigma, G::dof);
  const Vector<G::dof> densities = sigma.cwiseAbs2();
  const double dt = build.dt(k - 1, k);
  const Gaussian spread = Gaussian::covariance(WhiteNoiseAcceleration<G>::covariance(densities, dt));
  build.problem.minimize(WhiteNoiseAcceleration<G>{dt}, spread,
                         {*build.pose(k - 1), build.twist[k - 1], *build.pose(k), build.twist[k]});
}

}  // namespace

template <LieGroup G>
void TrackingBuild<G>::add_motion(std::size_t k) {
  switch (options.model) {
    case MotionModel::constant_twist:
    case MotionModel::constant_velocity:
      return add_triples(*this, k);
    case MotionModel::white_noise_acceleration:
      return add_white_noise_acceleration(*this, k);
    case MotionModel::steady_course:
      return;  // the course is in what every measurement reads
  }
}

template void TrackingBuild<SE3>::add_motion(std::size_t);
template void TrackingBuild<SE2>::add_motion(std::size_t);

}  // namespace tandem::detail
