#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include <amd.h>

#include <tandem/solvers/linear/block_symbolic.hpp>

namespace tandem::detail {
namespace {

/// Computes the structure of the factor column by column (George & Liu 1981). The rows of a column are its own rows in
/// H and those of its children in the elimination tree. Returns infinite flops if they exceed `most_flops` or if the
/// block rows exceed `most_rows`, as a bad order would not fit into memory.
BlockSymbolic symbolic(const SymmetricPattern& pattern, std::vector<int> order, double most_flops, double most_rows) {
  const int n = pattern.num_blocks();
  std::vector<int> place(order.size());
  for (int k = 0; k < n; ++k) place[std::size_t(order[std::size_t(k)])] = k;

  std::vector<std::vector<int>> below(order.size());
  for (int k = 0; k < n; ++k)
    for (int b = pattern.block_start[std::size_t(k)] + 1; b < pattern.block_start[std::size_t(k) + 1]; ++b) {
      const auto [low, high] =
          std::minmax(place[std::size_t(k)], place[std::size_t(pattern.block_row[std::size_t(b)])]);
      below[std::size_t(low)].push_back(high);
    }

  BlockSymbolic s;
  s.row_start.push_back(0);
  for (std::size_t k = 0; k < below.size(); ++k) {
    auto& rows = below[k];
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    s.row.push_back(static_cast<int>(k));
    s.row.insert(s.row.end(), rows.begin(), rows.end());
    s.row_start.push_back(static_cast<int>(s.row.size()));
    if (!rows.empty()) {
      auto& parent = below[std::size_t(rows.front())];
      parent.insert(parent.end(), rows.begin() + 1, rows.end());
    }
    const auto width = [&](std::size_t block) {
      const auto original = std::size_t(order[block]);
      return double(pattern.first[original + 1] - pattern.first[original]);
    };
    double height = 0;
    for (const int r : rows) height += width(std::size_t(r));
    const double w = width(k);
    s.flops += w * w * w / 3 + w * w * height + w * height * (height + 1) / 2;
    if (s.flops > most_flops || double(s.row.size()) > most_rows) {
      s.flops = std::numeric_limits<double>::infinity();
      return s;
    }
    std::vector<int>().swap(rows);
  }
  s.order = std::move(order);
  return s;
}

std::vector<int> amd_order_of(const SymmetricPattern& pattern) {
  const int n = pattern.num_blocks();
  std::vector<int> order(static_cast<std::size_t>(n));
  if (amd_order(n, pattern.block_start.data(), pattern.block_row.data(), order.data(), nullptr, nullptr) < AMD_OK)
    throw std::bad_alloc();
  return order;
}

/// Orders the first half forwards and the second half backwards. Blocks of the second half that are adjacent to the
/// first one come last.
BlockSymbolic from_both_ends(const SymmetricPattern& pattern, double most_rows) {
  const int n = pattern.num_blocks(), half = n / 2;
  std::vector<char> between(std::size_t(n), 0);
  for (int b = 0; b < pattern.block_start[std::size_t(half)]; ++b)
    if (pattern.block_row[std::size_t(b)] >= half) between[std::size_t(pattern.block_row[std::size_t(b)])] = 1;
  std::vector<int> order;
  for (int k = 0; k < half; ++k) order.push_back(k);
  for (int k = n - 1; k >= half; --k)
    if (!between[std::size_t(k)]) order.push_back(k);
  const int second_part = static_cast<int>(order.size());
  for (int k = half; k < n; ++k)
    if (between[std::size_t(k)]) order.push_back(k);
  BlockSymbolic s = symbolic(pattern, std::move(order), std::numeric_limits<double>::infinity(), most_rows);
  s.first_part = half;
  s.second_part = second_part;
  return s;
}

}  // namespace

SymmetricPattern blocks_with(const SymmetricPattern& pattern, std::span<const std::pair<int, int>> pairs) {
  std::vector<std::vector<int>> added(std::size_t(pattern.num_blocks()));
  for (const auto& [a, b] : pairs) added[std::size_t(std::min(a, b))].push_back(std::max(a, b));
  SymmetricPattern blocks;
  blocks.first = pattern.first;
  blocks.block_start.push_back(0);
  for (std::size_t k = 0; k < added.size(); ++k) {
    std::vector<int>& rows = added[k];
    rows.insert(rows.end(), pattern.block_row.begin() + pattern.block_start[k],
                pattern.block_row.begin() + pattern.block_start[k + 1]);
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    blocks.block_row.insert(blocks.block_row.end(), rows.begin(), rows.end());
    blocks.block_start.push_back(static_cast<int>(blocks.block_row.size()));
  }
  return blocks;
}

BlockSymbolic analyze(const SymmetricPattern& pattern, double natural_flops, bool both_ends) {
  constexpr double any = std::numeric_limits<double>::infinity();
  // A band with hardly any fill is close to optimal.
  const double hardly_any_fill = 1.5 * double(pattern.block_row.size());
  if (both_ends && pattern.num_blocks() >= kMinBlocksForBothEnds) {
    BlockSymbolic band = from_both_ends(pattern, hardly_any_fill);
    if (band.flops < any) return band;
  }
  std::vector<int> natural(static_cast<std::size_t>(pattern.num_blocks()));
  std::iota(natural.begin(), natural.end(), 0);
  BlockSymbolic band = symbolic(pattern, natural, any, hardly_any_fill);
  if (band.flops < any) return band;
  BlockSymbolic amd = symbolic(pattern, amd_order_of(pattern), any, any);
  BlockSymbolic own = symbolic(pattern, std::move(natural), natural_flops * amd.flops, any);
  return own.flops < any ? std::move(own) : std::move(amd);
}

SymmetricPattern in_elimination_order(const SymmetricPattern& pattern, const BlockSymbolic& structure) {
  SymmetricPattern result;
  result.first = pattern.first;
  result.first_part = structure.first_part;
  result.second_part = structure.second_part;
  result.place.resize(structure.order.size());
  for (std::size_t k = 0; k < structure.order.size(); ++k)
    result.place[std::size_t(structure.order[k])] = static_cast<int>(k);
  result.block_start.reserve(structure.order.size() + 1);
  result.block_row.reserve(structure.row.size());
  for (const int place : result.place) {
    result.block_start.push_back(static_cast<int>(result.block_row.size()));
    for (int r = structure.row_start[std::size_t(place)]; r < structure.row_start[std::size_t(place) + 1]; ++r)
      result.block_row.push_back(structure.order[std::size_t(structure.row[std::size_t(r)])]);
  }
  result.block_start.push_back(static_cast<int>(result.block_row.size()));
  result.place_values("the Cholesky factor");
  return result;
}

}  // namespace tandem::detail
