#include <tandem/studies/live/bad_spell.hpp>

namespace tandem {

void BadSpell::updated(double t, const RecordHealth& health) {
  std::size_t used = 0;
  for (const SensorRecord& sensor : health.sensors) used += sensor.used;
  const std::size_t rejected = health.rejected();
  auto& [used_before, rejected_before, rejecting, now, longest] = memory_;
  rejecting = used == used_before && (rejected > rejected_before || rejecting);
  used_before = used;
  rejected_before = rejected;
  if (health.converged && !rejecting) {
    now.reset();
    return;
  }
  if (!now) now = Spell{t, t, true};
  now->until = t;
  if (!longest || now->until - now->since > longest->until - longest->since || longest->since == now->since)
    longest = now;
}

std::optional<BadSpell::Spell> BadSpell::longest() const {
  const std::optional<Spell>& longest = memory_.longest;
  if (!longest || longest->until - longest->since < after_) return {};
  Spell spell = *longest;
  spell.lasts = memory_.now && memory_.now->since == spell.since;
  return spell;
}

}  // namespace tandem
