#include <tandem/studies/live/bad_spell.hpp>

namespace tandem {

void BadSpell::updated(double t, const RecordHealth& health) {
  std::size_t used = 0;
  for (const SensorRecord& sensor : health.sensors) used += sensor.used;
  const std::size_t rejected = health.rejected();
  rejecting_ = used == used_ && (rejected > rejected_ || rejecting_);
  used_ = used;
  rejected_ = rejected;
  if (health.converged && !rejecting_) {
    now_.reset();
    return;
  }
  if (!now_) now_ = Spell{t, t, true};
  now_->until = t;
  if (!longest_ || now_->until - now_->since > longest_->until - longest_->since || longest_->since == now_->since)
    longest_ = now_;
}

std::optional<BadSpell::Spell> BadSpell::longest() const {
  if (!longest_ || longest_->until - longest_->since < after_) return {};
  Spell spell = *longest_;
  spell.lasts = now_ && now_->since == spell.since;
  return spell;
}

}  // namespace tandem
