#include <cmath>
#include <utility>

#include <tandem/problem/navigation/staying_error_checks.hpp>

namespace tandem {

std::string why_invalid(const StayingError& error) {
  for (const double sigma : error.sigma)
    if (!(sigma > 0 && std::isfinite(sigma)))
      return "standard deviations must be finite and above zero, not " + std::to_string(sigma);
  if (!(error.time > 0)) return "its time must be above zero, not " + std::to_string(error.time);
  for (const auto& [what, sigma] :
       {std::pair{"scale", error.scale}, {"misalignment", error.misalignment}, {"delay", error.delay}})
    if (!(sigma >= 0 && std::isfinite(sigma)))
      return std::string("the standard deviation of its ") + what + " must be finite and zero or more, not " +
             std::to_string(sigma);
  constexpr double kMostDelay = 60;  // s: motion is read over six of them to either side of a measurement
  if (error.delay > kMostDelay)
    return "the standard deviation of its delay must be 60 s at most, not " + std::to_string(error.delay);
  return "";
}

}  // namespace tandem
