#pragma once

#include <array>
#include <string>
#include <string_view>

namespace tandem {

/// How the chaser's commands come about.
enum class RendezvousMethod {
  decoupled,    ///< plans against the target's prediction, which is given
  information,  ///< as decoupled, with seeing the target as a goal
  coupled,      ///< what was measured in the last seconds, the target's future and the plan are one program
  pursuit,      ///< pure pursuit of where the target's estimate puts the goal: the baseline
};
inline constexpr std::array rendezvous_methods = {RendezvousMethod::decoupled, RendezvousMethod::information,
                                                  RendezvousMethod::coupled, RendezvousMethod::pursuit};
std::string_view name(RendezvousMethod method);

/// Throws Error, naming the option and the nearest.
RendezvousMethod parse_rendezvous_method(const std::string& option, const std::string& text);

/// Searching: nothing is known yet. Retreat: docking was given up, and the chaser leaves the keep-out distance.
enum class RendezvousPhase { searching, approach, docking, retreat };
std::string_view name(RendezvousPhase phase);

enum class RendezvousOutcome { docked, failed, timed_out, interrupted };
std::string_view name(RendezvousOutcome outcome);

}  // namespace tandem
