#include <tandem/problem/navigation/staying_error.hpp>

namespace tandem {

std::string why_not(const StayingError& error, const std::string& kind, bool tells_length, bool tells_turn) {
  if (error.scale > 0 && !tells_length) return kind + " has no scale; leave it out";
  if (error.misalignment > 0 && !tells_turn)
    return kind + " does not tell how it is turned; leave its misalignment out";
  return "";
}

}  // namespace tandem
