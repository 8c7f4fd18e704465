#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <tandem/problem/navigation/motion_instant.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// The answer to a time of --at, in ENU-FLU.
struct StateAt {
  double t;  ///< s
  std::optional<MotionInstant> chaser{}, target{};
  std::string note{};  ///< the reason if there is no state, else empty
};

/// Returns why there is no state at t between the keyframes at `first` and `last` [s], or an empty string.
std::string why_outside(double t, double first, double last);

/// Writes chaser_at.csv and, with `target`, target_at.csv to a folder, in the axes of `frame`.
void write_states_at(const std::vector<StateAt>& states, const Frame& frame, bool target,
                     const std::filesystem::path& folder);

/// Returns a sentence about the times without a state, or an empty string if all have one.
std::string states_at_text(const std::vector<StateAt>& states);

/// Returns the columns of the files, for documentation: of both, or of chaser_at.csv only.
FileDescription states_at_columns(bool target);

}  // namespace tandem
