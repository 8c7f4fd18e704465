#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/problem/symmetric_pattern.hpp>

namespace tandem {

SymmetricPattern::BlockPlace SymmetricPattern::find(int block_of_rows, int block_of_columns) const {
  const auto place_of = [&](int block) { return place.empty() ? block : place[std::size_t(block)]; };
  const bool transposed = place_of(block_of_rows) < place_of(block_of_columns);
  const int column = transposed ? block_of_rows : block_of_columns, row = transposed ? block_of_columns : block_of_rows;
  const auto begin = block_row.begin() + block_start[std::size_t(column)],
             end = block_row.begin() + block_start[std::size_t(column) + 1];
  const auto at = std::lower_bound(begin, end, row, [&](int a, int b) { return place_of(a) < place_of(b); });
  const std::size_t entry = std::size_t(at - block_row.begin());
  return {static_cast<int>(entry), value_start[std::size_t(column)] + block_offset[entry], height(column), transposed};
}

std::vector<int> SymmetricPattern::column_starts() const {
  std::vector<int> starts;
  starts.reserve(std::size_t(size()) + 1);
  for (int k = 0; k < num_blocks(); ++k)
    for (int i = 0, start = value_start[std::size_t(k)]; i < width(k); ++i, start += height(k)) starts.push_back(start);
  starts.push_back(value_start.back());
  return starts;
}

std::vector<int> SymmetricPattern::rows() const {
  std::vector<int> row;
  row.reserve(std::size_t(nonzeros()));
  for (int k = 0; k < num_blocks(); ++k)
    for (int i = 0; i < width(k); ++i)
      for (int b = block_start[std::size_t(k)]; b < block_start[std::size_t(k) + 1]; ++b) {
        const std::size_t other = std::size_t(block_row[std::size_t(b)]);
        for (int r = first[other]; r < first[other + 1]; ++r) row.push_back(r);
      }
  return row;
}

void SymmetricPattern::place_values(const char* what) {
  block_offset.reserve(block_row.size());
  block_offset.clear();
  for (int k = 0; k < num_blocks(); ++k)
    for (int b = block_start[std::size_t(k)], rows = 0; b < block_start[std::size_t(k) + 1]; ++b) {
      block_offset.push_back(rows);
      rows += width(block_row[std::size_t(b)]);
    }
  std::vector<int> order(first.size() - 1);
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t k = 0; k < place.size(); ++k) order[std::size_t(place[k])] = static_cast<int>(k);
  value_start.assign(first.size(), 0);
  std::int64_t values = 0;
  for (const int k : order) {
    value_start[std::size_t(k)] = static_cast<int>(values);
    values += std::int64_t(height(k)) * width(k);
    if (values > std::numeric_limits<int>::max())
      throw BadInputError(std::string(what) + " has more than 2^31 entries, the limit of 32-bit indices");
  }
  value_start.back() = static_cast<int>(values);
}

}  // namespace tandem
