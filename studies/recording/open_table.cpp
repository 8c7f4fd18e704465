#include <algorithm>
#include <cctype>
#include <map>
#include <utility>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/recorded_time.hpp>
#include <tandem/studies/recording/recorded_units.hpp>
#include <tandem/studies/recording/recording_formats.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kProbedLines = 50;
constexpr int kLinesPerStop = 4096;  // lines between two calls of `stop`

/// Splits lines of a table into cells. Cells may be quoted (RFC 4180).
class CellSplitter {
 public:
  explicit CellSplitter(char delimiter) : delimiter_(delimiter) {}

  void split(std::string_view line, std::vector<std::string_view>& cells) {
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
    const auto end_cell = [&] {
      cells.push_back(trimmed(std::string_view(storage_).substr(begin)));
      begin = storage_.size();
    };
    for (const char c : line)
      if (c == '"')
        quoted = !quoted;
      else if (c == delimiter_ && !quoted)
        end_cell();
      else
        storage_ += c;
    end_cell();
  }

 private:
  char delimiter_;
  std::string storage_;
};

/// Returns the number of a cell; nan if it is none.
double number_of(std::string_view cell, bool decimal_comma) {
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
  if (comma == std::string_view::npos) return false;
  return std::all_of(cell.begin(), cell.end(),
                     [](char c) { return (c >= '0' && c <= '9') || c == ',' || c == '-' || c == '+'; });
}

bool is_number(std::string_view cell) { return parse_number(cell).has_value() || has_decimal_comma(cell); }

class TableRecording : public Recording {
 public:
  TableRecording(const std::filesystem::path& file, const TableSettings& settings) : settings_(settings) {
    file_ = file;
    format_ = "table";
    std::vector<std::string> head;
    each_line([&](std::string_view line) {
      head.emplace_back(line);
      return head.size() < kProbedLines;
    });
    if (head.empty()) throw Error(fmt::format("{} has no rows", file.string()));
    delimiter_ = settings.delimiter.value_or(detect_delimiter(head));
    std::vector<std::string_view> cells;
    CellSplitter splitter(delimiter_);
    detect_decimal_comma(head, splitter);
    splitter.split(head.front(), cells);
    header_ = settings.header.value_or(detect_header(cells));
    add_stream(head, splitter, cells);
  }

  void read(const std::vector<RowRequest>& requests, const std::function<void()>& stop) override {
    std::vector<std::vector<std::size_t>> indices;
    for (const RowRequest& request : requests)
      indices.push_back(field_indices(streams_[0], with_names(request.fields)));
    CellSplitter splitter(delimiter_);
    std::vector<std::string_view> cells;
    std::vector<RecordedValue> values;
    bool header = header_;
    int lines = 0;
    each_line([&](std::string_view line) {
      if (std::exchange(header, false)) return true;
      if (++lines % kLinesPerStop == 0) stop();
      splitter.split(line, cells);
      for (std::size_t r = 0; r < requests.size(); ++r) {
        values.clear();
        for (const std::size_t index : indices[r])
          values.push_back(index < cells.size() ? value(cells[index]) : RecordedValue());
        requests[r].row({std::numeric_limits<double>::quiet_NaN(), values});
      }
      return true;
    });
  }

 private:
  /// Calls f(line) for each line of the table, without comments and empty lines, until it returns false.
  template <class F>
  void each_line(F f) const {
    InputFile stream(file_);
    std::string line;
    std::size_t number = 0;
    while (std::getline(stream, line)) {
      std::string_view text = line;
      if (number++ == 0 && text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
      if (number <= settings_.skip) continue;
      while (!text.empty() && (text.back() == '\r' || text.back() == '\0')) text.remove_suffix(1);
      const std::string_view content = trimmed(text);
      if (content.empty() || settings_.comment.find(content.front()) != std::string::npos) continue;
      if (!f(text)) return;
    }
  }

  /// Returns the delimiter that splits most lines into the same number of cells, the largest such number.
  static char detect_delimiter(const std::vector<std::string>& head) {
    char best = ',';
    std::pair<std::size_t, std::size_t> best_score{0, 0};
    for (const char delimiter : {'\t', ';', '|', ',', ' '}) {
      CellSplitter splitter(delimiter);
      std::map<std::size_t, std::size_t> counts;
      std::vector<std::string_view> cells;
      for (const std::string& line : head) {
        splitter.split(line, cells);
        ++counts[cells.size()];
      }
      const auto most = std::max_element(counts.begin(), counts.end(),
                                         [](const auto& a, const auto& b) { return a.second < b.second; });
      if (most->first < 2) continue;
      const std::pair score{most->second, delimiter == ',' || delimiter == ' ' ? std::size_t(0) : most->first};
      if (score > best_score) {
        best_score = score;
        best = delimiter;
      }
    }
    return best;
  }

  void detect_decimal_comma(const std::vector<std::string>& head, CellSplitter& splitter) {
    if (settings_.decimal_comma) {
      decimal_comma_ = *settings_.decimal_comma;
      return;
    }
    if (delimiter_ == ',') return;
    std::vector<std::string_view> cells;
    for (const std::string& line : head) {
      splitter.split(line, cells);
      for (const std::string_view cell : cells) decimal_comma_ |= has_decimal_comma(cell);
    }
  }

  static bool detect_header(const std::vector<std::string_view>& cells) {
    return std::none_of(cells.begin(), cells.end(), is_number) &&
           std::none_of(cells.begin(), cells.end(), [](std::string_view c) { return parse_time_text(c).has_value(); });
  }

  void add_stream(const std::vector<std::string>& head, CellSplitter& splitter, std::vector<std::string_view>& cells) {
    RecordedStream stream{file_.stem().string()};
    if (header_) {
      for (const std::string_view cell : cells) {
        std::string name(trimmed(cell));
        if (name.empty()) name = fmt::format("{}", stream.fields.size() + 1);
        stream.fields.push_back({name, unit_in_name(name)});
      }
    } else {
      std::size_t columns = 0;
      for (const std::string& line : head) {
        splitter.split(line, cells);
        columns = std::max(columns, cells.size());
      }
      for (std::size_t i = 1; i <= columns; ++i) stream.fields.push_back({fmt::format("{}", i)});
    }
    stream.time_field = time_field(stream.fields);
    streams_.push_back(std::move(stream));
    count_rows();
  }

  /// Returns the field that has the name of a time, or an empty text.
  static std::string time_field(const std::vector<RecordedField>& fields) {
    for (const RecordedField& field : fields) {
      std::string name = field.name;
      std::transform(name.begin(), name.end(), name.begin(),
                     [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      if (name == "t" || name.starts_with("t_") || name.starts_with("t [") || name.starts_with("time") ||
          name.starts_with("stamp") || name.starts_with("utc") || name.starts_with("date") || name.starts_with("epoch"))
        return field.name;
    }
    return "";
  }

  void count_rows() {
    RecordedStream& stream = streams_[0];
    double factor = 1;
    if (!stream.time_field.empty()) {
      const RecordedField& field = stream.fields[field_indices(stream, {stream.time_field})[0]];
      if (const auto unit = find_unit(field.unit); unit && unit->quantity == Quantity::time) factor = unit->factor;
    }
    RowRequest request{stream.name, {}, {}};
    if (!stream.time_field.empty()) request.fields.push_back(stream.time_field);
    request.row = [&](const RecordedRow& row) {
      if (stream.rows++ > 0 && row.values.empty()) return;
      if (row.values.empty()) return;
      const RecordedValue& v = row.values[0];
      const double t = v.text.empty() ? v.number * factor : parse_time_text(v.text).value_or(v.number);
      if (!(stream.first <= t)) stream.first = t;
      if (!(stream.last >= t)) stream.last = t;
    };
    read({request}, [] {});
  }

  /// Replaces column numbers ("3") by names if the table has a header.
  std::vector<std::string> with_names(std::vector<std::string> fields) const {
    const std::vector<RecordedField>& known = streams_[0].fields;
    for (std::string& field : fields) {
      if (std::any_of(known.begin(), known.end(), [&](const RecordedField& f) { return f.name == field; })) continue;
      const auto number = parse_positive_integer(field);
      if (number && static_cast<std::size_t>(*number) <= known.size())
        field = known[static_cast<std::size_t>(*number) - 1].name;
    }
    return fields;
  }

  RecordedValue value(std::string_view cell) const {
    if (cell.size() > 1 && cell.front() == '\'' && cell.back() == '\'') cell = cell.substr(1, cell.size() - 2);
    for (const std::string& missing : settings_.missing)
      if (cell == missing) return {};
    const double number = number_of(cell, decimal_comma_);
    return {number, number == number ? std::string_view() : cell};
  }

  TableSettings settings_;
  char delimiter_ = ',';
  bool decimal_comma_ = false, header_ = false;
};

}  // namespace

std::unique_ptr<Recording> open_table(const std::filesystem::path& file, const TableSettings& settings) {
  return std::make_unique<TableRecording>(file, settings);
}

}  // namespace tandem
