#include <cmath>
#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/problem/tracking/tracking_build.hpp>
#include <tandem/problem/tracking/tracking_motion.hpp>

namespace tandem::detail {

void check_noise(std::string_view name, const Eigen::VectorXd& sigma, int size) {
  const auto subject = [&] { return "the noise " + std::string(name); };
  if (sigma.size() != size)
    throw BadInputError(subject() + " needs " + std::to_string(size) + " standard deviations, not " +
                        std::to_string(sigma.size()));
  for (const double s : sigma)
    if (!(s > 0 && std::isfinite(s)))
      throw BadInputError(subject() + " is required; give positive standard deviations (found " + std::to_string(s) +
                          ")");
}

Gaussian noise_of(std::string_view name, const Eigen::VectorXd& sigma, int size) {
  check_noise(name, sigma, size);
  return Gaussian(sigma);
}

}  // namespace tandem::detail
