#include <string_view>

#include <fmt/format.h>

#include <tandem/studies/calibration/singularity_messages.hpp>

namespace tandem {
namespace {

/// Extracts the unobservable states from an error of Marginals or observability; empty for other errors.
std::string unobservable_states(const std::string& error) {
  for (const std::string_view before : {"numerically singular at ", "rank deficient; unobservable: "}) {
    const std::size_t at = error.rfind(before);
    if (at == std::string::npos) continue;
    const std::size_t first = at + before.size(), end = error.find(" (add a residual", first);
    return error.substr(first, end == std::string::npos ? end : end - first);
  }
  return "";
}

}  // namespace

std::string explain_singularity(const std::string& error) {
  const std::string states = unobservable_states(error);
  return states.empty() ? error : "the measurements do not determine " + states;
}

std::string with_remedies(const std::string& error, const std::string& scenarios) {
  if (unobservable_states(error).empty()) return error;
  return fmt::format(
      "{}: {} with the given noise or close to it; bound outliers (--robust), constrain the motion (--model, --mode "
      "A), or use more keyframes",
      scenarios, explain_singularity(error));
}

}  // namespace tandem
