#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/csv.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/stamps.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::array kTimeColumns = {"t", "time", "stamp", "timestamp"};

/// Returns the cells of a line, separated by the first of , ; tab and blank that it contains.
std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells;
  if (line.find(',') != std::string_view::npos) return csv_cells(line);
  const char separator = line.find(';') != std::string_view::npos ? ';' : '\t';
  if (line.find(separator) == std::string_view::npos) {
    for (const std::string_view cell : words(line)) cells.emplace_back(cell);
  } else {
    for (const std::string_view cell : split(line, separator)) cells.emplace_back(cell);
  }
  return cells;
}

/// Returns the index of the column of times in a header. Throws Error if there is none.
std::size_t time_column(const std::vector<std::string>& names, const std::string& where) {
  for (const char* name : kTimeColumns)
    if (const auto found = std::find(names.begin(), names.end(), name); found != names.end())
      return std::size_t(found - names.begin());
  if (names.size() == 1) return 0;
  throw Error(fmt::format("{}: none of the columns {} is {}; rename the column of times [s]", where,
                          printable(fmt::format("{}", fmt::join(names, ", "))),
                          listed({kTimeColumns.begin(), kTimeColumns.end()}, "or")));
}

}  // namespace

std::vector<double> read_stamps(const std::filesystem::path& file) {
  InputFile stream(file);
  std::vector<double> stamps;
  std::optional<std::size_t> column;
  std::size_t number = 0;
  for (std::string text; std::getline(stream, text);) {
    std::string_view line = text;
    if (number++ == 0 && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);  // byte order mark
    line = trimmed(line);
    if (line.empty() || line.front() == '#') continue;
    const std::vector<std::string> cells = cells_of(line);
    const std::string where = fmt::format("{}:{}", file.string(), number);
    if (!column && !parse_number(cells[0])) {
      column = time_column(cells, where);
      continue;
    }
    if (!column) column = 0;
    const auto t = *column < cells.size() ? parse_number(cells[*column]) : std::nullopt;
    if (!t || !std::isfinite(*t))
      throw Error(fmt::format("{}: {} is not a time; times are finite numbers, in seconds", where,
                              quote(*column < cells.size() ? cells[*column] : "")));
    stamps.push_back(*t);
  }
  if (stamps.empty()) throw Error(file.string() + ": there are no times; give one per line, in seconds");
  return stamps;
}

}  // namespace tandem
