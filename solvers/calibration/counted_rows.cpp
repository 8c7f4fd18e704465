#include <cmath>

#include <tandem/solvers/calibration/counted_rows.hpp>

namespace tandem {

double counted_rows(const Loss& loss, int rows, double leverage) {
  if (loss.kind == Loss::Kind::none || loss.kind == Loss::Kind::student_t) return rows;
  // Midpoint rule over x = √s, whose density is proportional to x^(rows − 1) exp(−x²/2).
  constexpr int kSteps = 400;
  const double step = (std::sqrt(double(rows)) + 9.0) / kSteps;
  double mass = 0, counted = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double x = (i + 0.5) * step, s = (1 - leverage) * x * x;
    const double density = std::pow(x, rows - 1) * std::exp(-0.5 * x * x);
    mass += density;
    const auto [rho, weight, change] = loss(s);
    counted += density * (weight * s + (weight + change * s) * leverage * rows);
  }
  return counted / mass;
}

}  // namespace tandem
