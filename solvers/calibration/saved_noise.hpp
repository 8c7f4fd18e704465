#pragma once

#include <set>
#include <span>
#include <tuple>
#include <vector>

#include <tandem/solvers/calibration/noise_group.hpp>

namespace tandem::detail {

/// The noise of blocks as it is now, to be put back.
class SavedNoise {
 public:
  /// Of all blocks that groups name. The problems must outlive it.
  SavedNoise(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups) : problems_(problems) {
    for (const NoiseGroup& group : groups)
      for (const NoiseRows& rows : group.rows) keep(rows.problem, rows.block);
  }
  /// Of another one, too, unless it is kept already.
  void keep(int problem, const Block& block) {
    if (seen_.insert({problem, block.pool, block.id}).second)
      saved_.emplace_back(problem, block, problems_[std::size_t(problem)]->noise(block));
  }
  void restore() const {
    for (const auto& [p, block, noise] : saved_) problems_[std::size_t(p)]->set_noise(block, noise);
  }

 private:
  std::span<Problem* const> problems_;
  std::set<std::tuple<int, int, int>> seen_;
  std::vector<std::tuple<int, Block, Gaussian>> saved_;
};

}  // namespace tandem::detail
