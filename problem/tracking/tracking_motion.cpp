#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/problem/tracking/tracking_motion.hpp>

namespace tandem::detail {
namespace {

template <LieGroup G>
void add_white_noise_acceleration(TrackingBuild<G>& build, std::size_t k) {
  if (k == 0) return;
  with_rate_motion<G>(build.data.noise, build.dt(k - 1, k),
                      [&](const auto& motion, const NoiseEntry& entry, const auto& covariance) {
                        build.minimize(motion, entry.name, Gaussian::covariance(covariance),
                                       {*build.pose(k - 1), build.twist[k - 1], *build.pose(k), build.twist[k]});
                      });
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
      return;  // each measurement reads the course
    case MotionModel::none:
      return;
  }
}

template void TrackingBuild<SE3>::add_motion(std::size_t);
template void TrackingBuild<SE2>::add_motion(std::size_t);

}  // namespace tandem::detail
