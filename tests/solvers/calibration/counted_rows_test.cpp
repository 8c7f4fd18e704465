#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <tandem/solvers/calibration/counted_rows.hpp>

namespace tandem {
namespace {

TEST(CountedRows, CountsAllRowsWithoutALossAndForADensity) {
  EXPECT_EQ(counted_rows({}, 3), 3);
  EXPECT_EQ(counted_rows(StudentT(4, 3), 3), 3);
  EXPECT_NEAR(counted_rows(Huber(50), 3), 3, 1e-9) << "a loss that reaches only the far tails";
  EXPECT_NEAR(counted_rows(Cauchy(1e5), 6), 6, 1e-6);
}

TEST(CountedRows, IsTheMeanUnderNormalNoise) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  constexpr int n = 200'000;
  for (const Loss& loss : {Huber(1), Cauchy(2), GemanMcClure(3), Tukey(4)})
    for (const int rows : {1, 3, 6}) {
      double sum = 0, squares = 0;
      const double leverage = rows == 3 ? 0.4 : 0;
      for (int i = 0; i < n; ++i) {
        double s = 0;
        for (int k = 0; k < rows; ++k) s += (1 - leverage) * std::pow(normal(random), 2);
        const double x = loss(s).d1 * s + (loss(s).d1 + loss(s).d2 * s) * leverage * rows;
        sum += x;
        squares += x * x;
      }
      const double mean = sum / n, error = std::sqrt((squares / n - mean * mean) / n);
      EXPECT_NEAR(counted_rows(loss, rows, leverage), mean, 4 * error) << int(loss.kind) << " of " << rows;
      EXPECT_LT(counted_rows(loss, rows), rows);
    }
}

}  // namespace
}  // namespace tandem
