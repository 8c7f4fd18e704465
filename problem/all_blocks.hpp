#pragma once

#include <numeric>
#include <vector>

#include <tandem/problem/problem.hpp>

namespace tandem::detail {

inline std::vector<int> all_ids(const Problem& problem) {
  std::vector<int> ids(std::size_t(problem.id_bound()));
  std::iota(ids.begin(), ids.end(), 0);
  return ids;
}

/// Return all soft or hard blocks, except marginal priors and constraints.
inline std::vector<Block> soft_blocks(const Problem& problem) { return problem.soft_blocks_reading(all_ids(problem)); }
inline std::vector<Block> hard_blocks(const Problem& problem) { return problem.hard_blocks_reading(all_ids(problem)); }

}  // namespace tandem::detail
