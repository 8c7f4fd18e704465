#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/rendezvous/rendezvous_names.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {

std::string_view name(RendezvousMethod method) {
  constexpr std::string_view names[] = {"decoupled", "information", "coupled", "pursuit"};
  return names[int(method)];
}

RendezvousMethod parse_rendezvous_method(const std::string& option, const std::string& text) {
  std::vector<std::string> names;
  for (const RendezvousMethod method : rendezvous_methods) {
    if (name(method) == text) return method;
    names.emplace_back(name(method));
  }
  throw Error(
      fmt::format("{} takes {}, not {}{}", option, listed(names, "or"), quote(text), did_you_mean(text, names)));
}

std::string_view name(RendezvousPhase phase) {
  constexpr std::string_view names[] = {"searching", "approach", "docking", "retreat"};
  return names[int(phase)];
}

std::string_view name(RendezvousOutcome outcome) {
  constexpr std::string_view names[] = {"docked", "failed", "timed-out", "interrupted"};
  return names[int(outcome)];
}

}  // namespace tandem
