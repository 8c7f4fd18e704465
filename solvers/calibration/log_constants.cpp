#include <cmath>
#include <numbers>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>

namespace tandem {
namespace {

const double kLogTwoPi = std::log(2 * std::numbers::pi);

double block_log_constant(const Problem& problem, const Block& block) {
  const Gaussian noise = problem.noise(block);
  return noise.log_determinant() + log_constant(problem.loss(block), static_cast<int>(noise.dim()));
}

}  // namespace

double expected_curvature(const Loss& loss) {
  const double c2 = loss.scale * loss.scale;
  return loss.kind == Loss::Kind::student_t ? c2 / (c2 + 2) : 1.0;
}

double log_constant(const Loss& loss, int rows) {
  if (loss.kind != Loss::Kind::student_t) return -0.5 * rows * kLogTwoPi;
  const double dof = degrees_of_freedom(loss, rows);
  if (!(dof > 0))
    throw BadInputError("student-t: scale " + std::to_string(loss.scale) + " is an improper density over " +
                        std::to_string(rows) + " rows; the scale is √(degrees of freedom + rows) and must exceed " +
                        std::to_string(std::sqrt(double(rows))));
  return std::lgamma(0.5 * (dof + rows)) - std::lgamma(0.5 * dof) -
         0.5 * rows * std::log(std::numbers::pi * (dof + rows));
}

double log_constants(std::span<Problem* const> problems, const std::vector<MeasuredBlock>& measured) {
  double sum = 0;
  for (const MeasuredBlock& m : measured) sum += block_log_constant(detail::problem_at(problems, m.problem), m.block);
  if (!measured.empty()) return sum;
  for (const Problem* problem : problems) {
    if (problem->num_hard_blocks() > 0)
      throw BadInputError("calibrate: problems with hard constraints need CalibrationOptions::measured");
    for (const Block& block : problem->blocks()) sum += block_log_constant(*problem, block);
    sum += 0.5 * problem->size().unknowns * kLogTwoPi;
  }
  return sum;
}

}  // namespace tandem
