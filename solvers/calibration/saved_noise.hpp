#pragma once

#include <set>
#include <span>
#include <tuple>
#include <vector>

#include <tandem/solvers/calibration/noise_group.hpp>

namespace tandem::detail {

/// A copy of the noise of blocks, which restore() writes back.
class SavedNoise {
 public:
  /// Saves all blocks of the groups. The problems must outlive this object.
  SavedNoise(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups) : problems_(problems) {
    for (const NoiseGroup& group : groups)
      for (const NoiseRows& rows : group.rows) save(rows.problem, rows.block);
  }
  /// Saves one more block, unless it is saved already.
  void save(int problem, const Block& block) {
    if (seen_.insert({problem, block.pool, block.id}).second)
      saved_.emplace_back(problem, block, problem_at(problems_, problem).noise(block));
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
