#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include <tandem/studies/recording/table_cells.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Returns the most frequent number of cells, and the number of lines that have it; zeros without lines.
std::pair<std::size_t, std::size_t> usual(const std::vector<std::string>& head, char delimiter) {
  CellSplitter splitter(delimiter);
  std::map<std::size_t, std::size_t> counts;
  std::vector<std::string_view> cells;
  for (const std::string& line : head) {
    splitter.split(line, cells);
    ++counts[cells.size()];
  }
  const auto most =
      std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == counts.end()) return {};
  return *most;
}

}  // namespace

void CellSplitter::split(std::string_view line, std::vector<std::string_view>& cells) {
  if (delimiter_ == ' ') {
    words(line, cells);
    return;
  }
  if (line.find('"') == std::string_view::npos) {
    tandem::split(line, delimiter_, cells);
    return;
  }
  cells.clear();
  storage_.clear();
  storage_.reserve(line.size() + 1);  // cells point into it
  std::size_t begin = 0;
  bool quoted = false;
  const auto cell = [&] { return trimmed(std::string_view(storage_).substr(begin)); };
  const auto end_cell = [&] {
    cells.push_back(cell());
    begin = storage_.size();
  };
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"')
      storage_ += line[i++];
    else if (c == '"' && (quoted || cell().empty()))
      quoted = !quoted;
    else if (c == delimiter_ && !quoted)
      end_cell();
    else
      storage_ += c;
  }
  end_cell();
}

double cell_number(std::string_view cell, bool decimal_comma) {
  if (decimal_comma && cell.find(',') != std::string_view::npos) {
    std::string text(cell);
    std::replace(text.begin(), text.end(), ',', '.');
    return parse_number(text).value_or(std::numeric_limits<double>::quiet_NaN());
  }
  if (!cell.empty() && cell.front() == '+') cell.remove_prefix(1);
  return parse_number(cell).value_or(std::numeric_limits<double>::quiet_NaN());
}

bool has_decimal_comma(std::string_view cell) {
  const std::size_t comma = cell.find(',');
  if (comma == std::string_view::npos || cell.find(',', comma + 1) != std::string_view::npos) return false;
  return std::all_of(cell.begin(), cell.end(),
                     [](char c) { return (c >= '0' && c <= '9') || c == ',' || c == '-' || c == '+'; });
}

bool is_number_cell(std::string_view cell) { return parse_number(cell).has_value() || has_decimal_comma(cell); }

bool ends_in_quotes(std::string_view line) {
  constexpr std::string_view kDelimiters = ",;|\t";
  bool begins = true, quoted = false;
  for (const char c : line) {
    if (quoted || begins) quoted = (c == '"') != quoted;
    begins = !quoted && (kDelimiters.find(c) != std::string_view::npos || (begins && c == ' ') || c == '"');
  }
  return quoted;
}

std::size_t usual_cells(const std::vector<std::string>& head, char delimiter) { return usual(head, delimiter).first; }

char detect_delimiter(const std::vector<std::string>& head) {
  char best = ',';
  std::pair<std::size_t, std::size_t> best_score{0, 0};
  for (const char delimiter : {'\t', ';', '|', ',', ' '}) {
    const auto [cells, lines] = usual(head, delimiter);
    if (cells < 2) continue;
    const std::pair score{lines, delimiter == ',' || delimiter == ' ' ? std::size_t(0) : cells};
    if (score > best_score) {
      best_score = score;
      best = delimiter;
    }
  }
  return best;
}

}  // namespace tandem
