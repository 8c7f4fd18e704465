#include <algorithm>

#include <fmt/format.h>

#include <tandem/studies/estimation/unobservable_text.hpp>

namespace tandem {

std::string unobservable_text(const Estimate& estimate) {
  const std::vector<UnobservableState>& states = estimate.summary.unobservable;
  if (states.empty()) return "";
  const bool rotations = std::all_of(states.begin(), states.end(), [](const UnobservableState& state) {
    return state.variable.empty() ||
           std::all_of(state.directions.begin(), state.directions.end(),
                       [](const std::string& direction) { return direction.starts_with("rotation"); });
  });
  std::string remedy = "a motion model (--model), a constraint (--non-holonomic soft) or another sensor observes them";
  if (rotations && estimate.options.mode == Mode::A && !is_point_model(estimate.options.model))
    remedy = estimate.options.non_holonomic == Role::off
                 ? "--non-holonomic soft ties the orientation to the motion, --model constant-velocity estimates "
                   "positions only"
                 : "--model constant-velocity estimates positions only";
  return fmt::format("The measurements do not determine {}, so the standard deviations are infinite there; {}",
                     state_names(states), remedy);
}

}  // namespace tandem
