#include <string_view>

#include <fmt/format.h>

#include <tandem/studies/calibration/undetermined.hpp>

namespace tandem {
namespace {

std::string undetermined(const std::string& error) {
  for (const std::string_view before : {"singular to rounding, found at ", "the problem leaves free: "}) {
    const std::size_t at = error.rfind(before);
    if (at == std::string::npos) continue;
    const std::size_t first = at + before.size(), end = error.find(" (add a residual", first);
    return error.substr(first, end == std::string::npos ? end : end - first);
  }
  return "";
}

}  // namespace

std::string told_of_states(const std::string& error) {
  const std::string free = undetermined(error);
  return free.empty() ? error : "the measurements do not determine " + free;
}

std::string told_to_users(const std::string& error, const std::string& scenarios) {
  if (undetermined(error).empty()) return error;
  return fmt::format(
      "{}: {}, by the noise as given or near it: bound outliers (--robust), tie the motion more (--model, --mode A), "
      "or give more keyframes",
      scenarios, told_of_states(error));
}

}  // namespace tandem
