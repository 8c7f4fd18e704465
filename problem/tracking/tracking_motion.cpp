#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/residuals/white_noise_acceleration.hpp>

namespace tandem::detail {
namespace {

template <LieGroup G>
void add_white_noise_acceleration(TrackingBuild<G>& build, std::size_t k) {
  if (k == 0) return;
  const auto& noise = build.data.noise;
  const bool by_twist = noise.acceleration.isZero(0);
  const Eigen::VectorXd& sigma = by_twist ? noise.constant_twist : noise.acceleration;
  noise_of("acceleration (or constant_twist)", sigma, G::dof);
  const Vector<G::dof> densities = sigma.cwiseAbs2();
  const double dt = build.dt(k - 1, k);
  const Gaussian spread = Gaussian::covariance(WhiteNoiseAcceleration<G>::covariance(densities, dt));
  build.minimize(WhiteNoiseAcceleration<G>{dt}, by_twist ? "constant_twist" : "acceleration", spread,
                 {*build.pose(k - 1), build.twist[k - 1], *build.pose(k), build.twist[k]});
}

}  // namespace

template <LieGroup G>
void TrackingBuild<G>::add_motion(std::size_t k) {
  switch (options.model) {
    case MotionModel::constant_twist:
    case MotionModel::constant_velocity:
    case MotionModel::damped_twist:
    case MotionModel::damped_velocity:
      return add_triples(k);
    case MotionModel::white_noise_acceleration:
      return add_white_noise_acceleration(*this, k);
    case MotionModel::steady_course:
      return;  // the course is in what every measurement reads
    case MotionModel::none:
      return;
  }
}

template void TrackingBuild<SE3>::add_motion(std::size_t);
template void TrackingBuild<SE2>::add_motion(std::size_t);

}  // namespace tandem::detail
