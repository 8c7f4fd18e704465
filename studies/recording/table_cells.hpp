#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tandem {

/// Splits lines of a table into cells. Cells may be quoted (RFC 4180).
class CellSplitter {
 public:
  explicit CellSplitter(char delimiter) : delimiter_(delimiter) {}

  /// Sets the cells of a line. They are valid until the next call and as long as the line.
  void split(std::string_view line, std::vector<std::string_view>& cells);

 private:
  char delimiter_;
  std::string storage_;
};

/// Returns the number of a cell; nan if it is none.
double cell_number(std::string_view cell, bool decimal_comma);
/// Returns whether a cell is a number with a comma, such as "-1,25".
bool has_decimal_comma(std::string_view cell);
/// Returns whether a cell is a number with a point or a comma.
bool is_number_cell(std::string_view cell);

/// Returns whether a line ends inside a quoted cell, so that the cell goes on in the next line. Quotes inside a cell,
/// such as in `5" pipe`, do not open one.
bool ends_in_quotes(std::string_view line);

/// Returns the delimiter that splits most lines into the same number of cells, the largest such number.
char detect_delimiter(const std::vector<std::string>& head);
/// Returns the most frequent number of cells of lines.
std::size_t usual_cells(const std::vector<std::string>& head, char delimiter);

}  // namespace tandem
