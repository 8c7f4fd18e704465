#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>
#include <tandem/solvers/calibration/saved_values.hpp>

namespace tandem {

void apply(const Calibration& found, std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups) {
  if (problems.size() != found.problems.size())
    throw BadInputError("apply: the calibration has " + std::to_string(found.problems.size()) + " problems, not " +
                        std::to_string(problems.size()));
  for (const NoiseGroup& group : groups)
    for (const NoiseRows& rows : group.rows) {
      const Problem& solved = *found.problems[std::size_t(rows.problem)];
      detail::problem_at(problems, rows.problem).set_noise(rows.block, solved.noise(solved.counterpart(rows.block)));
    }
  for (std::size_t p = 0; p < problems.size(); ++p) detail::copy_values(*found.problems[p], *problems[p]);
}

}  // namespace tandem
