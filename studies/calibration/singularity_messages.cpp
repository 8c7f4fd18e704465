#include <fmt/format.h>

#include <tandem/studies/calibration/singularity_messages.hpp>

namespace tandem {

std::string undetermined(const std::string& states) { return "the measurements do not determine " + states; }

std::string explain_singularity(const Error& error) {
  const auto* singular = dynamic_cast<const NotObservableError*>(&error);
  return singular ? undetermined(singular->states()) : error.what();
}

std::string with_remedies(const NotObservableError& error, const std::string& scenarios) {
  const bool rotation = error.states().find("rotation") != std::string::npos;
  return fmt::format(
      "{}: {} with the given noise or close to it; {}bound outliers (--robust), constrain the motion (--model, --mode "
      "A), or use more keyframes",
      scenarios, undetermined(error.states()),
      rotation ? "tie the orientation to the motion (--non-holonomic soft), estimate positions only (--model "
                 "constant-velocity), "
               : "");
}

}  // namespace tandem
