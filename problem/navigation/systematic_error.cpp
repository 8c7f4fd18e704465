#include <tandem/problem/navigation/systematic_error.hpp>

namespace tandem {

std::string why_unsupported(const SystematicError& error, const std::string& kind, bool measures_length,
                            bool depends_on_orientation) {
  if (error.scale_sigma > 0 && !measures_length) return kind + " has no scale factor; remove `scale`";
  if (error.misalignment_sigma > 0 && !depends_on_orientation)
    return kind + " does not depend on the sensor's orientation; remove `misalignment`";
  return "";
}

}  // namespace tandem
