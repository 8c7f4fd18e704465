#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/scenario/quaternion.hpp>
#include <tandem/studies/scenario/table.hpp>
#include <tandem/studies/support/csv.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr double kSamePose = 1e-3;  // m, rad

}  // namespace

RowFormat::RowFormat(const std::string& columns, char separator) : columns_(columns), separator_(separator) {
  for (const std::string_view name : split(columns_, separator)) names_.emplace_back(name);
}

void RowFormat::split_fields(std::string_view line) {
  if (separator_ == ' ') {
    words(line, fields_);
  } else if (line.find('"') == std::string_view::npos) {
    split(line, separator_, fields_);
  } else {
    unquoted_ = csv_cells(line);
    fields_.assign(unquoted_.begin(), unquoted_.end());
  }
}

bool RowFormat::is_header(std::string_view line) {
  split_fields(line);
  return std::equal(fields_.begin(), fields_.end(), names_.begin(), names_.end());
}

const std::vector<double>& RowFormat::parse(std::string_view line) {
  split_fields(line);
  if (fields_.size() != names_.size())
    throw Error(fmt::format("expected {} columns ({}), found {}", names_.size(), columns_, fields_.size()));
  values_.clear();
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    const bool may_miss = missing_values_ && i > 0;
    const auto value = may_miss && fields_[i].empty() ? std::optional(double(NAN)) : parse_number(fields_[i]);
    if (may_miss && value && std::isnan(*value)) {
      values_.push_back(NAN);
      continue;
    }
    if (!value) throw Error(fmt::format("{} is {}, not a number", names_[i], quote(fields_[i])));
    if (!std::isfinite(*value)) throw Error(fmt::format("{} is {}; numbers must be finite", names_[i], fields_[i]));
    values_.push_back(*value);
  }
  return values_;
}

RowFile::RowFile(std::filesystem::path file, RowFormat format, TimeOrder order)
    : RowFile(std::make_unique<InputFile>(file), file, std::move(format), order) {}

RowFile::RowFile(std::unique_ptr<std::istream> stream, std::filesystem::path file, RowFormat format, TimeOrder order)
    : file_(std::move(file)),
      format_(std::move(format)),
      order_(order),
      stream_(std::move(stream)),
      header_expected_(format_.has_header()) {}

bool RowFile::next() {
  while (std::getline(*stream_, text_)) {
    std::string_view line = text_;
    if (line_ == 0 && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);  // byte order mark
    line = trimmed(line);
    ++line_;
    if (line.empty() || line.front() == '#') continue;
    if (std::exchange(header_expected_, false)) {
      if (!format_.is_header(line))
        fail(fmt::format("the first line must be the header {}, not {}", format_.columns(), quote(line)));
      continue;
    }
    try {
      row_ = &format_.parse(line);
    } catch (const Error& error) {
      fail(error.what());
    }
    check_time();
    return true;
  }
  if (header_expected_) fail(fmt::format("the header line {} is missing", format_.columns()));
  return false;
}

void RowFile::check_time() {
  const double t = row_->front(), before = std::exchange(last_t_, t);
  const int line_before = std::exchange(last_line_, line_);
  if (order_ == TimeOrder::any || line_before == 0 || t > before) return;
  const bool repeats = t == before;
  if (repeats && order_ == TimeOrder::repeating) return;
  fail(fmt::format("time {} {} line {}{}", format_.first_field(), repeats ? "repeats that of" : "comes before that of",
                   line_before, repeats ? "" : "; lines must be in time order"));
}

std::string RowFile::where() const { return fmt::format("{}:{}", file_.string(), std::max(line_, 1)); }

void RowFile::fail(const std::string& reason) const { throw Error(where() + ": " + reason); }

std::string Table::where(std::size_t i) const { return fmt::format("{}:{}", file.string(), lines[i]); }

Table read_table(RowFile& rows, const Stop& stop) {
  constexpr std::size_t kStopCheckInterval = 1024;  // rows
  Table table{rows.file(), rows.format().size(), {}, {}};
  while (rows.next()) {
    if (table.rows() % kStopCheckInterval == 0 && stop.reached()) stop.check("reading " + rows.file().string());
    table.values.insert(table.values.end(), rows.row().begin(), rows.row().end());
    table.lines.push_back(rows.line());
  }
  return table;
}

Table read_csv(const std::filesystem::path& file, const std::string& header, TimeOrder order, const Stop& stop) {
  RowFile rows(file, RowFormat::csv(header), order);
  return read_table(rows, stop);
}

Table read_sensor_rows(const std::filesystem::path& file, const std::string& header, TimeOrder order,
                       const Stop& stop) {
  RowFile rows(file, RowFormat::csv(header).with_missing_values(), order);
  return read_table(rows, stop);
}

Table read_tum(const std::filesystem::path& file, const Stop& stop) {
  RowFile rows(file, RowFormat::tum(), TimeOrder::repeating);
  return read_table(rows, stop);
}

Table read_odometry(const std::filesystem::path& file, const Stop& stop) {
  RowFile rows(file, RowFormat::tum().with_missing_values(), TimeOrder::repeating);
  return read_table(rows, stop);
}

std::vector<Stamped<SE3>> poses(const Table& table) {
  std::vector<Stamped<SE3>> result;
  result.reserve(table.rows());
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const double* row = table.row(i);
    const auto rotation = rotation_from(row + 4);
    if (!rotation) throw Error(fmt::format("{}: {}", table.where(i), quaternion_error(row + 4)));
    const SE3 pose(*rotation, Vector<3>(row + 1));
    if (!result.empty() && table.t(i) == result.back().t) {  // some loggers occasionally write a pose twice
      if (!((result.back().value.inverse() * pose).Log().cwiseAbs().maxCoeff() <= kSamePose))
        throw Error(fmt::format("{}: time {} repeats that of line {} with another pose", table.where(i), table.t(i),
                                table.lines[i - 1]));
      continue;
    }
    result.push_back({table.t(i), pose});
  }
  return result;
}

}  // namespace tandem
