#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include <tandem/studies/support/csv.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Appends a text. Quotes it if RFC 4180 requires that, or if it starts or ends with a blank.
void append_quoted(std::string& out, const std::string& text) {
  const bool plain = text.find_first_of(",\"\r\n") == std::string::npos && trimmed(text).size() == text.size();
  if (plain) {
    out += text;
    return;
  }
  out += '"';
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  out += '"';
}

}  // namespace

CsvCell CsvCell::fixed(double value, int decimals) {
  return std::isfinite(value) ? CsvCell(fmt::format("{:.{}f}", value, decimals)) : CsvCell();
}

CsvCell CsvCell::rounded(double value, int digits) {
  return std::isfinite(value) ? CsvCell(fmt::format("{:.{}g}", value, digits)) : CsvCell();
}

void CsvCell::append_to(std::string& text) const {
  if (const auto* number = std::get_if<double>(&value_)) {
    if (std::isfinite(*number)) fmt::format_to(std::back_inserter(text), "{}", *number);
  } else if (const auto* count = std::get_if<long long>(&value_)) {
    fmt::format_to(std::back_inserter(text), "{}", *count);
  } else if (const auto* words = std::get_if<std::string>(&value_)) {
    append_quoted(text, *words);
  }
}

std::pair<std::string, std::optional<std::string_view>> csv_first_cell(std::string_view line) {
  const std::size_t begin = line.find_first_not_of(" \t");
  if (begin == std::string_view::npos || line[begin] != '"') {
    const std::size_t comma = line.find(',');
    std::string cell(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return {std::move(cell), std::nullopt};
    return {std::move(cell), line.substr(comma + 1)};
  }
  std::string cell;
  std::size_t i = begin + 1;
  for (; i < line.size(); ++i) {
    if (line[i] == '"' && (i + 1 == line.size() || line[++i] != '"')) break;  // "" is an escaped quote
    cell += line[i];
  }
  const std::size_t comma = line.find(',', std::min(i, line.size()));
  if (comma == std::string_view::npos) return {std::move(cell), std::nullopt};
  return {std::move(cell), line.substr(comma + 1)};
}

std::vector<std::string> csv_cells(std::string_view line) {
  std::vector<std::string> cells;
  for (std::optional<std::string_view> rest = line; rest;) {
    auto [cell, after] = csv_first_cell(*rest);
    cells.push_back(std::move(cell));
    rest = after;
  }
  return cells;
}

}  // namespace tandem
