#pragma once

#include <string>
#include <vector>

namespace tandem {

/// A UTF-8 text table for terminals. Each column is as wide as its widest cell.
class TextTable {
 public:
  enum class Align { left, right };
  struct Column {
    std::string head;
    Align align = Align::right;
  };

  explicit TextTable(std::vector<Column> columns) : columns_(std::move(columns)) {}

  /// Adds a row with one cell for each column.
  void row(std::vector<std::string> cells);
  /// Adds a row with the first cells and a text that spans the remaining columns.
  void row(std::vector<std::string> cells, std::string text);
  /// Adds a heading above the headings of the columns first … last.
  void group(std::size_t first, std::size_t last, std::string head);

  std::string str() const;

 private:
  struct Row {
    std::vector<std::string> cells;
    std::string text;
  };
  struct Group {
    std::size_t first, last;
    std::string head;
  };
  std::vector<std::size_t> widths() const;

  std::vector<Column> columns_;
  std::vector<Row> rows_;
  std::vector<Group> groups_;
};

/// Returns the number of characters of a UTF-8 text.
std::size_t width(const std::string& text);

}  // namespace tandem
