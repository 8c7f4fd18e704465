#pragma once

#include <span>
#include <vector>

#include <tandem/problem/problem.hpp>

namespace tandem {

/// A subproblem: the chosen variables of a problem, all blocks that read one of them, and the other variables that
/// these blocks read, fixed at their values. A solve costs as much as the part, not as the whole problem. If it
/// decreases the cost of the part, write_back() decreases the cost of the whole problem by the same amount. Parts of
/// one problem may be solved concurrently, but not constructed, updated or written back.
class Subproblem {
 public:
  /// Copies the part of `whole`, which must outlive this object. Variables that are fixed in the whole problem stay
  /// fixed. Throws StaleHandleError if a variable does not exist, BadInputError if the marginal prior reads one.
  Subproblem(Problem& whole, std::span<const int> variable_ids);

  Problem& problem() { return part_; }

  /// Copies from the whole problem the values of all variables, and the residuals, noises, losses, bounds and
  /// multipliers of all blocks. Throws StaleHandleError if the structure of the whole problem has changed.
  void update_from_whole();
  /// Copies the values of the free variables to the whole problem, not the multipliers. Throws StaleHandleError if
  /// the structure of the whole problem has changed.
  void write_back();

 private:
  struct Copied {
    int whole_id, id;
  };
  struct CopiedBlocks {         // all blocks of the pool with the same index in the part
    std::vector<int> in_whole;  // index of each block in the whole problem
    std::vector<int> slots;     // slots of the states of each block in the part
  };
  void check_unchanged() const;
  void copy_blocks();

  Problem& whole_;
  Problem part_;
  std::vector<Copied> copied_;
  std::vector<CopiedBlocks> blocks_;  // by pool
  std::uint64_t serial_;              // serial number of the whole problem
  long long revision_;
};

}  // namespace tandem
