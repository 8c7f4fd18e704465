#include <algorithm>
#include <cctype>

#include <tandem/solvers/name_suggestions.hpp>

namespace tandem {
namespace {

/// Number of insertions, deletions, replacements and swaps of neighbours between a and b, ignoring case (Damerau 1964).
int edit_distance(std::string_view a, std::string_view b) {
  const auto same = [&](std::size_t i, std::size_t j) {
    return std::tolower(static_cast<unsigned char>(a[i])) == std::tolower(static_cast<unsigned char>(b[j]));
  };
  std::vector<std::vector<int>> d(a.size() + 1, std::vector<int>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = static_cast<int>(i);
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i)
    for (std::size_t j = 1; j <= b.size(); ++j) {
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + !same(i - 1, j - 1)});
      if (i > 1 && j > 1 && same(i - 1, j - 2) && same(i - 2, j - 1)) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

}  // namespace

std::string did_you_mean(std::string_view word, const std::vector<std::string>& known) {
  const std::string* nearest = nullptr;
  int least = std::max(static_cast<int>(word.size()) / 3, 1) + 1;  // a third of the letters may differ
  for (const std::string& candidate : known) {
    const int distance = edit_distance(word, candidate);
    if (distance < least) nearest = &candidate, least = distance;
  }
  return nearest ? "; did you mean " + *nearest + "?" : "";
}

}  // namespace tandem
