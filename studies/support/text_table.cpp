#include <algorithm>

#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

const std::string kGap = "  ";

std::string padded(const std::string& text, std::size_t to, TextTable::Align align) {
  const std::string blanks(to - std::min(to, width(text)), ' ');
  return align == TextTable::Align::left ? text + blanks : blanks + text;
}

/// Returns `head` centred in a horizontal rule of `to` characters: "── head ──".
std::string ruled(const std::string& head, std::size_t to) {
  const std::size_t dashes = to - std::min(to, width(head) + 2);
  std::string text;
  for (std::size_t i = 0; i < dashes / 2; ++i) text += "─";
  text += " " + head + " ";
  for (std::size_t i = dashes / 2; i < dashes; ++i) text += "─";
  return text;
}

std::string line(std::string text) {
  text.erase(text.find_last_not_of(' ') + 1);
  return text + "\n";
}

}  // namespace

std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

void TextTable::row(std::vector<std::string> cells) { rows_.push_back({std::move(cells), {}}); }

void TextTable::row(std::vector<std::string> cells, std::string text) {
  rows_.push_back({std::move(cells), std::move(text)});
}

void TextTable::group(std::size_t first, std::size_t last, std::string head) {
  groups_.push_back({first, last, std::move(head)});
}

std::vector<std::size_t> TextTable::widths() const {
  std::vector<std::size_t> widths;
  for (const Column& column : columns_) widths.push_back(width(column.head));
  for (const Row& row : rows_)
    for (std::size_t i = 0; i < std::min(row.cells.size(), widths.size()); ++i)
      widths[i] = std::max(widths[i], width(row.cells[i]));
  for (const Group& group : groups_) {  // a long group head widens its last column
    std::size_t span = kGap.size() * (group.last - group.first);
    for (std::size_t i = group.first; i <= group.last; ++i) span += widths[i];
    widths[group.last] += width(group.head) + 2 - std::min(width(group.head) + 2, span);
  }
  return widths;
}

std::string TextTable::str() const {
  const std::vector<std::size_t> to = widths();
  std::string text;
  if (!groups_.empty()) {
    std::string heads;
    for (const Group& group : groups_) {
      std::size_t start = 0, span = 0;
      for (std::size_t i = 0; i < group.first; ++i) start += to[i] + kGap.size();
      for (std::size_t i = group.first; i <= group.last; ++i) span += to[i] + (i < group.last ? kGap.size() : 0);
      heads += std::string(start - std::min(start, width(heads)), ' ') + ruled(group.head, span);
    }
    text += line(heads);
  }
  std::string heads;
  for (std::size_t i = 0; i < columns_.size(); ++i)
    heads += (i ? kGap : "") + padded(columns_[i].head, to[i], columns_[i].align);
  text += line(heads);
  for (const Row& row : rows_) {
    std::string cells;
    for (std::size_t i = 0; i < row.cells.size(); ++i)
      cells += (i ? kGap : "") + padded(row.cells[i], to[i], columns_[i].align);
    text += line(row.text.empty() ? cells : cells + kGap + row.text);
  }
  return text;
}

}  // namespace tandem
