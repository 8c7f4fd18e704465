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

 private:
  double after_;
  std::size_t used_ = 0, rejected_ = 0;  // at the last update
  bool rejecting_ = false;               // nothing has been used since something was rejected
  std::optional<Spell> now_, longest_;
};

}  // namespace tandem
