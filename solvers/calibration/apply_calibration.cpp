#include <tandem/lie/error.hpp>
#include <tandem/problem/all_blocks.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>
#include <tandem/solvers/calibration/saved_values.hpp>

namespace tandem {

void apply(const Calibration& found, std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups) {
  if (problems.size() != found.problems.size())
    throw BadInputError("apply: the calibration has " + std::to_string(found.problems.size()) + " problems, not " +
                        std::to_string(problems.size()));
  for (const NoiseGroup& group : groups)
    for (const NoiseRows& rows : group.rows) {
      Problem& to = detail::problem_at(problems, rows.problem);
      const Problem& solved = *found.problems[std::size_t(rows.problem)];
      to.set_noise(rows.block, solved.noise(solved.counterpart(rows.block)));
    }
  for (std::size_t p = 0; p < problems.size(); ++p) {
    const Problem& solved = *found.problems[p];
    detail::copy_values(solved, *problems[p]);
    for (const Block& block : detail::hard_blocks(*problems[p]))
      problems[p]->set_multipliers(block, solved.multipliers(solved.counterpart(block)));
  }
}

}  // namespace tandem
