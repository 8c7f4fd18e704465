#pragma once

#include <array>
#include <string>
#include <string_view>

namespace tandem {

/// Method that computes the chaser's commands.
enum class RendezvousMethod {
  decoupled,    ///< Plans against a fixed prediction of the target.
  information,  ///< As decoupled, with a cost on missed information about the target.
  coupled,      ///< One nonlinear program of recent measurements, future target poses and the plan.
  pursuit,      ///< Pure pursuit of the goal at the estimated target; the baseline.
};
inline constexpr std::array rendezvous_methods = {RendezvousMethod::decoupled, RendezvousMethod::information,
                                                  RendezvousMethod::coupled, RendezvousMethod::pursuit};
std::string_view name(RendezvousMethod method);

/// Throws Error that names the option and the nearest method if `text` is no method.
RendezvousMethod parse_rendezvous_method(const std::string& option, const std::string& text);

/// Searching: no target estimate yet. Retreat: docking was aborted and the chaser leaves the keep-out distance.
enum class RendezvousPhase { searching, approach, docking, retreat };
std::string_view name(RendezvousPhase phase);

enum class RendezvousOutcome { docked, failed, timed_out, interrupted };
std::string_view name(RendezvousOutcome outcome);

}  // namespace tandem
