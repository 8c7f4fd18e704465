#pragma once

#include <span>
#include <vector>

#include <tandem/problem/problem.hpp>

namespace tandem {

/// Some variables of a problem, all blocks that read one of them, and the other variables that these blocks read, which
/// are fixed at their values: a problem of its own, of the part's size. What its cost falls by is what the whole's
/// falls by when the values are given back.
class ProblemPart {
 public:
  /// Of `whole`, which must outlive it. Variables that are fixed there are fixed here. Throws Error when a variable is
  /// not there (any more), and when one is in a marginal prior.
  ProblemPart(Problem& whole, std::span<const int> variable_ids);

  Problem& problem() { return part_; }

  /// All variables, fixed ones too, take the values that they have in the whole, and blocks their measurements, noise,
  /// losses, bounds and multipliers.
  void take_values();
  /// The variables that are free here give their values to the whole; multipliers stay here. Both throw Error when
  /// variables or blocks have joined or left the whole or were fixed since the part was made.
  void give_values();

 private:
  struct Copied {
    int whole_id, id;
  };
  struct CopiedBlocks {         // of a pool, which are all of the part's pool of the same index
    std::vector<int> in_whole;  // indices
    std::vector<int> slots;     // of the variables that each reads
  };
  void check_unchanged() const;
  void copy_blocks();

  Problem& whole_;
  Problem part_;
  std::vector<Copied> copied_;
  std::vector<CopiedBlocks> blocks_;  // by pool
  long long revision_;                // of the whole
};

}  // namespace tandem
