#pragma once

#include <concepts>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// A cell of a CSV file: a number, a text or nothing. A number has the fewest digits that read back to the same value;
/// one that is not finite makes an empty cell. A text is quoted if RFC 4180 requires it.
class CsvCell {
 public:
  CsvCell() = default;
  CsvCell(double value) : value_(value) {}
  template <std::integral I>
  CsvCell(I value) : value_(static_cast<long long>(value)) {}
  CsvCell(std::string_view text) : value_(std::string(text)) {}
  CsvCell(const std::string& text) : value_(text) {}
  CsvCell(const char* text) : value_(std::string(text)) {}
  template <class T>
  CsvCell(const std::optional<T>& value) {
    if (value) *this = CsvCell(*value);
  }
  /// Returns a number with a fixed number of decimals.
  static CsvCell fixed(double value, int decimals);
  /// Returns a number with at most `digits` significant digits.
  static CsvCell rounded(double value, int digits);

  void append_to(std::string& text) const;

 private:
  std::variant<std::monostate, double, long long, std::string> value_;
};

/// A column of a CSV file.
template <class Row>
struct CsvColumn {
  std::string name;  ///< name with the unit: "error_x_m"
  std::string doc;   ///< description with unit and axes, as in docs/file_formats.md
  std::function<CsvCell(const Row&)> cell;
};

/// The columns of one kind of CSV file. Each line of the file shows one `Row`.
template <class Row>
class CsvTable {
 public:
  CsvTable() = default;
  CsvTable(std::vector<CsvColumn<Row>> columns) : columns_(std::move(columns)) {}

  CsvTable& add(std::string name, std::string doc, std::function<CsvCell(const Row&)> cell) {
    columns_.push_back({std::move(name), std::move(doc), std::move(cell)});
    return *this;
  }
  /// Adds one column for each component of a vector; "{}" in the name is replaced by the axis. `vector(row)` returns a
  /// vector or an optional vector. Cells are empty for components beyond its size.
  template <class F>
  CsvTable& add_each(const std::vector<std::string>& axes, const std::string& name, const std::string& doc, F vector) {
    for (std::size_t i = 0; i < axes.size(); ++i)
      add(with_axis(name, axes[i]), doc, [vector, i](const Row& row) {
        const auto component = [i = static_cast<std::ptrdiff_t>(i)](const auto& v) {
          return i < v.size() ? CsvCell(v[i]) : CsvCell();
        };
        const auto v = vector(row);
        if constexpr (requires { v.has_value(); })
          return v ? component(*v) : CsvCell();
        else
          return component(v);
      });
    return *this;
  }
  template <class F>
  CsvTable& add_xyz(const std::string& name, const std::string& doc, F vector) {
    return add_each({"x", "y", "z"}, name, doc, std::move(vector));
  }

  FileDescription describe(std::string file) const {
    FileDescription description{std::move(file), "column", {}};
    for (const CsvColumn<Row>& column : columns_) description.columns.emplace_back(column.name, column.doc);
    return description;
  }

  /// Returns the header line.
  std::string header() const {
    std::string text;
    for (const CsvColumn<Row>& column : columns_) {
      if (!text.empty()) text += ',';
      CsvCell(column.name).append_to(text);
    }
    return text + '\n';
  }
  /// Returns the line of one row.
  std::string row(const Row& row) const {
    std::string text;
    append_row(text, row);
    return text;
  }
  /// Returns the text of a whole file: the header and all rows.
  template <class Rows>
  std::string text(const Rows& rows) const {
    std::string text = header();
    for (const auto& row : rows) append_row(text, row);
    return text;
  }

 private:
  void append_row(std::string& text, const Row& row) const {
    bool first = true;
    for (const CsvColumn<Row>& column : columns_) {
      if (!std::exchange(first, false)) text += ',';
      column.cell(row).append_to(text);
    }
    text += '\n';
  }
  static std::string with_axis(std::string text, const std::string& axis) {
    if (const std::size_t at = text.find("{}"); at != std::string::npos) text.replace(at, 2, axis);
    return text;
  }

  std::vector<CsvColumn<Row>> columns_;
};

/// Returns the first cell of a line without its quotes (or, if unquoted, without surrounding blanks), and the text
/// after its comma (nothing for the last cell).
std::pair<std::string, std::optional<std::string_view>> csv_first_cell(std::string_view line);

/// Returns all cells of a line.
std::vector<std::string> csv_cells(std::string_view line);

}  // namespace tandem
