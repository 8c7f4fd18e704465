#pragma once

#include <span>
#include <vector>

#include <tandem/solvers/calibration/calibrate.hpp>

namespace tandem::detail {

/// Multiplies the noise of the problems by the calibrated factors of their groups.
inline void scale_noise(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                        const Calibration& found) {
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const NoiseRows& rows : groups[g].rows) {
      Problem& problem = *problems[std::size_t(rows.problem)];
      const Gaussian noise = problem.noise(rows.block);
      Eigen::VectorXd factor = Eigen::VectorXd::Ones(noise.dim());
      factor.segment(rows.first, rows.count < 0 ? noise.dim() - rows.first : rows.count)
          .setConstant(found.noise[g].factor);
      problem.set_noise(rows.block, noise.scaled(factor));
    }
}

}  // namespace tandem::detail
