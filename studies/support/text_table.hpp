#pragma once

#include <string>
#include <vector>

namespace tandem {

/// Columns of text for a terminal, each as wide as its widest cell; UTF-8.
class TextTable {
 public:
  enum class Align { left, right };
  struct Column {
    std::string head;
    Align align = Align::right;
  };

  explicit TextTable(std::vector<Column> columns) : columns_(std::move(columns)) {}

  /// A cell each column.
  void row(std::vector<std::string> cells);
  /// The first cells, then a text across the columns that are left.
  void row(std::vector<std::string> cells, std::string text);
  /// A second head above the columns first … last.
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

/// Characters of a UTF-8 text, each a column of a terminal wide.
std::size_t width(const std::string& text);

}  // namespace tandem
