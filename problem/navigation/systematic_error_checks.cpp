#include <cmath>
#include <utility>

#include <tandem/problem/navigation/systematic_error_checks.hpp>

namespace tandem {

std::string why_invalid(const SystematicError& error) {
  for (const double sigma : error.bias_sigma)
    if (!(sigma > 0 && std::isfinite(sigma)))
      return "the standard deviations of the bias must be positive and finite, not " + std::to_string(sigma);
  if (!(error.correlation_time > 0))
    return "the correlation time must be positive, not " + std::to_string(error.correlation_time);
  for (const auto& [what, sigma] : {std::pair{"scale", error.scale_sigma},
                                    {"misalignment", error.misalignment_sigma},
                                    {"delay", error.delay_sigma}})
    if (!(sigma >= 0 && std::isfinite(sigma)))
      return std::string("the standard deviation of the ") + what + " must be zero or positive, and finite, not " +
             std::to_string(sigma);
  constexpr double kMaxDelaySigma = 60;  // s; the motion is evaluated within six times this of a measurement
  if (error.delay_sigma > kMaxDelaySigma)
    return "the standard deviation of the delay must be 60 s at most, not " + std::to_string(error.delay_sigma);
  return "";
}

}  // namespace tandem
