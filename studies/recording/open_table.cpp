#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/recorded_time.hpp>
#include <tandem/studies/recording/recorded_units.hpp>
#include <tandem/studies/recording/recording_formats.hpp>
#include <tandem/studies/recording/table_cells.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kProbedLines = 50;
constexpr std::size_t kQuotedLines = 100;  // of a quoted cell
constexpr int kLinesPerStop = 4096;        // lines between two calls of `stop`

class TableRecording : public Recording {
 public:
  TableRecording(const std::filesystem::path& file, const TableSettings& settings) : settings_(settings) {
    file_ = file;
    format_ = "table";
    for (const std::string& text : settings.missing)
      if (const auto number = parse_number(text)) missing_.push_back(*number);
    std::vector<std::string> head;
    std::vector<std::size_t> numbers;
    each_line([&](std::string_view line, std::size_t number) {
      head.emplace_back(line);
      numbers.push_back(number);
      return head.size() < kProbedLines;
    });
    if (head.empty()) throw Error(fmt::format("{} has no rows", file.string()));
    if (const std::size_t first = preamble(head); first > 0) {
      settings_.skip = numbers[first] - 1;
      format_ += fmt::format(" (begins at line {}; the lines before it are other text)", numbers[first]);
      head.erase(head.begin(), head.begin() + static_cast<long>(first));
    }
    delimiter_ = settings.delimiter.value_or(detect_delimiter(head));
    std::vector<std::string_view> cells;
    CellSplitter splitter(delimiter_);
    detect_decimal_comma(head, splitter);
    splitter.split(head.front(), cells);
    header_ = settings.header.value_or(detect_header(cells));
    const std::string comment = first_comment();
    if (!comment.empty() && settings.header.value_or(true) && !detect_header(cells)) {
      const std::size_t columns = cells.size();
      std::vector<std::string_view> names;
      splitter.split(comment, names);
      if (names.size() == columns && columns > 1 && detect_header(names) && names_time(names)) {
        header_ = false;
        add_stream(names);
        return;
      }
    }
    add_stream(header_ ? cells : std::vector<std::string_view>());
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
    each_line([&](std::string_view line, std::size_t number) {
      if (std::exchange(header, false)) return true;
      if (++lines % kLinesPerStop == 0) stop();
      splitter.split(line, cells);
      widest_ = std::max(widest_, cells.size());
      if (delimiter_ != ' ' && ends_in_quotes(line)) add_open_quote(number);
      for (std::size_t r = 0; r < requests.size(); ++r) {
        values.clear();
        for (const std::size_t index : indices[r])
          values.push_back(index < cells.size() ? value(cells[index]) : RecordedValue());
        requests[r].row({std::numeric_limits<double>::quiet_NaN(), values, number});
      }
      return true;
    });
  }

 private:
  void add_open_quote(std::size_t line) {
    if (std::exchange(open_quote_, true)) return;
    add_defect(fmt::format("line {}: a quoted cell is not closed within {} lines; each line is read as a row", line,
                           kQuotedLines));
  }

  /// Returns the last comment before the first row, without its characters for comments.
  std::string first_comment() const {
    InputFile stream(file_);
    std::string line, comment;
    for (std::size_t number = 0; std::getline(stream, line); ++number) {
      if (number < settings_.skip) continue;
      std::string_view text = trimmed(line);
      if (number == 0 && text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
      if (text.empty()) continue;
      if (settings_.comment.find(text.front()) == std::string::npos) break;
      while (!text.empty() && settings_.comment.find(text.front()) != std::string::npos) text.remove_prefix(1);
      comment = trimmed(text);
    }
    return comment;
  }

  /// Appends the lines in which a quoted cell goes on, and returns their number; none if it is not closed soon.
  static std::size_t join_quoted(InputFile& stream, std::string& line) {
    const auto after = stream.tellg();
    std::string joined = line, more;
    for (std::size_t n = 1; n <= kQuotedLines && std::getline(stream, more); ++n) {
      joined += '\n' + more;
      if (ends_in_quotes(joined)) continue;
      line = std::move(joined);
      return n;
    }
    stream.clear();
    stream.seekg(after);
    return 0;
  }

  /// Calls f(line, number) for each line of the table, without comments and empty lines, until it returns false.
  template <class F>
  void each_line(F f) const {
    InputFile stream(file_);
    std::string line;
    std::size_t number = 0, next = 0;
    while (std::getline(stream, line)) {
      number = ++next;
      if (delimiter_ != ' ' && line.find('"') != std::string::npos && ends_in_quotes(line))
        next += join_quoted(stream, line);
      std::string_view text = line;
      if (number == 1 && text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
      if (number <= settings_.skip) continue;
      while (!text.empty() && (text.back() == '\r' || text.back() == '\0')) text.remove_suffix(1);
      const std::string_view content = trimmed(text);
      if (content.empty() || settings_.comment.find(content.front()) != std::string::npos) continue;
      if (!f(text, number)) return;
    }
  }

  /// Returns the number of lines before the header: the first line without numbers that has as many cells as most lines
  /// after it. Returns 0 if the first line is one, or if there is none.
  std::size_t preamble(const std::vector<std::string>& head) const {
    if (settings_.skip > 0 || settings_.header) return 0;
    const char delimiter = settings_.delimiter.value_or(detect_delimiter(head));
    const std::size_t usual = usual_cells(head, delimiter);
    CellSplitter splitter(delimiter);
    std::vector<std::string_view> cells;
    std::vector<std::size_t> counts;
    std::optional<std::size_t> first;
    for (std::size_t i = 0; i < head.size(); ++i) {
      splitter.split(head[i], cells);
      counts.push_back(cells.size());
      if (first || cells.size() != usual) continue;
      if (usual < 2 || i == 0 || !detect_header(cells)) return 0;
      first = i;
    }
    if (!first) return 0;
    const auto same = std::count(counts.begin() + static_cast<long>(*first), counts.end(), usual);
    return 2 * static_cast<std::size_t>(same) > head.size() - *first && same > 1 ? *first : 0;
  }

  void detect_decimal_comma(const std::vector<std::string>& head, CellSplitter& splitter) {
    if (settings_.decimal_comma) {
      decimal_comma_ = *settings_.decimal_comma;
      return;
    }
    constexpr std::size_t kThousands = 3;
    std::vector<std::string_view> cells;
    for (const std::string& line : head) {
      splitter.split(line, cells);
      for (const std::string_view cell : cells)  // the quoted "1,234" of a table with commas may be 1234
        decimal_comma_ |=
            has_decimal_comma(cell) && (delimiter_ != ',' || cell.size() - cell.find(',') - 1 != kThousands);
    }
  }

  static bool detect_header(const std::vector<std::string_view>& cells) {
    return std::none_of(cells.begin(), cells.end(), is_number_cell) &&
           std::none_of(cells.begin(), cells.end(), [](std::string_view c) {
             return parse_time_text(c).has_value() || day_and_month(c).has_value();
           });
  }

  /// Adds the stream. `names` is empty if the table has no header.
  void add_stream(const std::vector<std::string_view>& names) {
    RecordedStream stream{file_.stem().string()};
    std::vector<std::string> repeated;
    for (const std::string_view cell : names) {
      const std::size_t column = stream.fields.size() + 1;
      std::string name(trimmed(cell));
      const std::string unit = unit_in_name(name);
      if (name.empty()) name = fmt::format("{}", column);
      if (std::any_of(stream.fields.begin(), stream.fields.end(), [&](const auto& f) { return f.name == name; })) {
        if (std::find(repeated.begin(), repeated.end(), name) == repeated.end()) repeated.push_back(name);
        name += fmt::format(" (column {})", column);
      }
      stream.fields.push_back({name, unit});
    }
    if (!repeated.empty())
      add_defect(
          fmt::format("the header repeats {}; the name stands for the first of these columns, and the number of a "
                      "column for each",
                      listed(repeated)));
    set_date_order(stream);
    set_time_fields(stream);
    streams_.push_back(std::move(stream));
    count_rows();
    std::vector<RecordedField>& fields = streams_[0].fields;
    if (names.empty())
      for (std::size_t i = 1; i <= widest_; ++i) fields.push_back({fmt::format("{}", i)});
  }

  /// Returns whether a column has the name of a time.
  static bool is_time(std::string_view column) {
    const std::string name = lower_case(column);
    if (name == "t") return true;
    for (const char* start : {"t_", "t [", "time", "stamp", "utc", "date", "epoch"})
      if (name.starts_with(start)) return true;
    return false;
  }
  static bool names_time(const std::vector<std::string_view>& names) {
    return std::any_of(names.begin(), names.end(), is_time);
  }

  /// Sets the first field that has the name of a time. If the table has a column for dates and one for times of day, sets
  /// both.
  void set_time_fields(RecordedStream& stream) const {
    std::string date, time;
    for (const RecordedField& field : stream.fields) {
      if (!is_time(field.name)) continue;
      if (stream.time_field.empty()) stream.time_field = field.name;
      const std::string name = lower_case(field.name);
      const bool is_date = name.starts_with("date") && name.find("time") == std::string::npos;
      std::string& first = is_date ? date : time;
      if (first.empty()) first = field.name;
    }
    if (date.empty() || time.empty() || !first_row_has(date, time, stream)) return;
    stream.time_field = time;
    stream.date_field = date;
  }

  /// Sets the order of day and month: a value above 12 anywhere in the table is a day.
  void set_date_order(RecordedStream& stream) const {
    stream.date_order = settings_.date_order;
    if (stream.date_order != DateOrder::unknown) return;
    bool any = false, first = false, second = false;
    std::size_t lines = 0;
    CellSplitter splitter(delimiter_);
    std::vector<std::string_view> cells;
    each_line([&](std::string_view line, std::size_t) {
      splitter.split(line, cells);
      for (const std::string_view cell : cells)
        if (const auto date = day_and_month(cell)) {
          any = true;
          first |= date->first > 12;
          second |= date->second > 12;
        }
      return any || ++lines < kProbedLines;
    });
    if (first == second) return;
    stream.date_order = first ? DateOrder::dmy : DateOrder::mdy;
    stream.time_note =
        fmt::format("dates are {}, since a value above 12 is a day", first ? "day/month/year" : "month/day/year");
  }

  /// Returns whether the first row has a date in one field and a time of day in another.
  bool first_row_has(const std::string& date_field, const std::string& time_field, const RecordedStream& stream) const {
    const std::vector<std::size_t> indices = field_indices(stream, {date_field, time_field});
    bool header = header_, result = false;
    each_line([&](std::string_view line, std::size_t) {
      if (std::exchange(header, false)) return true;
      CellSplitter splitter(delimiter_);
      std::vector<std::string_view> cells;
      splitter.split(line, cells);
      if (std::max(indices[0], indices[1]) >= cells.size()) return true;
      const RecordedValue date = value(cells[indices[0]]);
      const auto day = recorded_date(date.number, date.text, stream.date_order),
                 time = parse_time_text(cells[indices[1]]);
      result = day && std::fmod(*day, kSecondsPerDay) == 0 && *day >= kSecondsPerDay && time && *time <= kSecondsPerDay;
      return false;
    });
    return result;
  }

  void count_rows() {
    RecordedStream& stream = streams_[0];
    double factor = 1;
    bool has_unit = false;
    if (!stream.time_field.empty()) {
      const RecordedField& field = stream.fields[field_indices(stream, {stream.time_field})[0]];
      has_unit = !field.unit.empty();
      if (const auto unit = find_unit(field.unit); unit && unit->quantity == Quantity::time && unit->factor > 0)
        factor = unit->factor;
    }
    RowRequest request{stream.name, {}, {}};
    if (!stream.time_field.empty()) request.fields.push_back(stream.time_field);
    if (!stream.date_field.empty()) request.fields.push_back(stream.date_field);
    request.row = [&](const RecordedRow& row) {
      ++stream.rows;
      if (row.values.empty()) return;
      const RecordedValue& v = row.values[0];
      double t = v.text.empty() ? v.number * factor : parse_time_text(v.text, stream.date_order).value_or(v.number);
      if (v.text.empty() && !has_unit) t = seconds_by_magnitude(t);
      if (row.values.size() > 1)
        t += recorded_date(row.values[1].number, row.values[1].text, stream.date_order)
                 .value_or(std::numeric_limits<double>::quiet_NaN());
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
    const double number = cell_number(cell, decimal_comma_);
    if (std::find(missing_.begin(), missing_.end(), number) != missing_.end()) return {};
    return {number, number == number ? std::string_view() : cell};
  }

  TableSettings settings_;
  char delimiter_ = ',';
  bool decimal_comma_ = false, header_ = false, open_quote_ = false;
  std::vector<double> missing_;  ///< the numbers of `settings_.missing`
  std::size_t widest_ = 0;       ///< largest number of cells in a row
};

}  // namespace

std::unique_ptr<Recording> open_table(const std::filesystem::path& file, const TableSettings& settings) {
  return std::make_unique<TableRecording>(file, settings);
}

}  // namespace tandem
