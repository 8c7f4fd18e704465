#pragma once

#include <optional>

#include <tandem/studies/live/track_records.hpp>

namespace tandem {

/// Spells in which a track is not to be relied on: no update converges, or of what comes all is rejected.
class BadSpell {
 public:
  /// Shorter ones than `after` [s] are none.
  explicit BadSpell(double after) : after_(after) {}

  struct Spell {
    double since, until;  ///< s
    bool lasts;           ///< to the end
  };

  void updated(double t, const RecordHealth& health);
  std::optional<Spell> longest() const;

  /// What it has seen, for another to go on from.
  struct Memory {
    std::size_t used = 0, rejected = 0;  ///< at the last update
    bool rejecting = false;              ///< nothing has been used since something was rejected
    std::optional<Spell> now{}, longest{};
  };
  const Memory& memory() const { return memory_; }
  void go_on_from(const Memory& memory) { memory_ = memory; }

 private:
  double after_;
  Memory memory_;
};

}  // namespace tandem
