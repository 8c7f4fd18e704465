#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include <tandem/problem/symmetric_pattern.hpp>
#include <tandem/solvers/linear/block_symbolic.hpp>

namespace tandem::testing {

/// Symmetric block matrix, dense and as values of a pattern.
struct BlockMatrix {
  SymmetricPattern pattern;
  Eigen::MatrixXd dense;
  Eigen::VectorXd values;
};

/// Returns a positive definite matrix with blocks of these sizes. `pairs` (column < row) are the blocks below the
/// diagonal.
inline BlockMatrix make_matrix(const std::vector<int>& sizes, const std::vector<std::pair<int, int>>& pairs,
                               unsigned seed) {
  BlockMatrix m;
  auto& p = m.pattern;
  p.first = {0};
  for (const int size : sizes) p.first.push_back(p.first.back() + size);
  const int n = p.size();
  m.dense = Eigen::MatrixXd::Zero(n, n);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto add = [&](std::vector<int> blocks) {  // JᵀJ of a residual with three rows that reads these blocks
    const auto size = [&](int b) { return p.first[std::size_t(b) + 1] - p.first[std::size_t(b)]; };
    std::vector<Eigen::MatrixXd> J;
    for (const int b : blocks) J.push_back(Eigen::MatrixXd::NullaryExpr(3, size(b), [&] { return normal(random); }));
    for (std::size_t i = 0; i < J.size(); ++i)
      for (std::size_t k = 0; k < J.size(); ++k)
        m.dense.block(p.first[std::size_t(blocks[i])], p.first[std::size_t(blocks[k])], size(blocks[i]),
                      size(blocks[k])) += J[i].transpose() * J[k];
  };
  for (const auto& [column, row] : pairs) add({column, row});
  for (int b = 0; b < static_cast<int>(sizes.size()); ++b)
    for (int i = 0; i < 4; ++i) add({b});

  std::vector<std::pair<int, int>> all(pairs);
  for (int b = 0; b < static_cast<int>(sizes.size()); ++b) all.emplace_back(b, b);
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  p.block_start.assign(sizes.size() + 1, 0);
  for (const auto& [column, row] : all) {
    ++p.block_start[std::size_t(column) + 1];
    p.block_row.push_back(row);
  }
  std::partial_sum(p.block_start.begin(), p.block_start.end(), p.block_start.begin());
  p.place_values("the matrix");
  std::vector<double> values;
  for (std::size_t b = 0; b < sizes.size(); ++b)
    for (int c = p.first[b]; c < p.first[b + 1]; ++c)
      for (int k = p.block_start[b]; k < p.block_start[b + 1]; ++k) {
        const std::size_t other = std::size_t(p.block_row[std::size_t(k)]);
        for (int r = p.first[other]; r < p.first[other + 1]; ++r) values.push_back(m.dense(r, c));
      }
  m.values = Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  return m;
}

inline std::vector<int> random_sizes(int blocks, std::mt19937& random) {
  std::vector<int> sizes;
  for (int b = 0; b < blocks; ++b) sizes.push_back(std::vector{6, 3, 1, 2, 6, 9}[random() % 6]);
  return sizes;
}

inline BlockMatrix chain(int blocks, int reach, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::pair<int, int>> pairs;
  for (int b = 0; b < blocks; ++b)
    for (int k = 1; k <= reach && b + k < blocks; ++k) pairs.emplace_back(b, b + k);
  return make_matrix(random_sizes(blocks, random), pairs, seed);
}

/// Chain that is long enough for elimination from both ends. With `hub`, a last block is adjacent to all others.
inline BlockMatrix long_chain(int reach, bool hub, unsigned seed) {
  constexpr int blocks = detail::kMinBlocksForBothEnds + 31;
  std::mt19937 random(seed);
  std::vector<std::pair<int, int>> pairs;
  for (int b = 0; b < blocks; ++b) {
    for (int k = 1; k <= reach && b + k < blocks; ++k) pairs.emplace_back(b, b + k);
    if (hub && b + reach < blocks - 1) pairs.emplace_back(b, blocks - 1);
  }
  return make_matrix(random_sizes(blocks, random), pairs, seed);
}

/// Star with the hub first, for which the natural order causes complete fill, and random additional pairs.
inline BlockMatrix star(int blocks, int extra, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::pair<int, int>> pairs;
  for (int b = 1; b < blocks; ++b) pairs.emplace_back(0, b);
  for (int i = 0; i < extra; ++i) {
    const int a = static_cast<int>(random() % unsigned(blocks)), b = static_cast<int>(random() % unsigned(blocks));
    if (a != b) pairs.emplace_back(std::min(a, b), std::max(a, b));
  }
  return make_matrix(random_sizes(blocks, random), pairs, seed);
}

inline Eigen::VectorXd right_side(Eigen::Index n) {
  return Eigen::VectorXd::NullaryExpr(n, [](Eigen::Index i) { return std::sin(1.0 + 3.0 * double(i)); });
}

}  // namespace tandem::testing
