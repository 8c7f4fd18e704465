#include <cmath>
#include <fstream>
#include <utility>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/quaternion.hpp>
#include <tandem/studies/table.hpp>
#include <tandem/studies/text.hpp>

namespace tandem {
namespace {

constexpr double kSamePose = 1e-3;  // m, rad

std::string contents(const std::filesystem::path& file) {
  if (std::filesystem::is_directory(file)) throw Error(fmt::format("{} is a folder, not a file", file.string()));
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    const bool there = std::filesystem::exists(file);
    throw Error(fmt::format("{} {}", file.string(), there ? "cannot be read" : "is missing"));
  }
  std::string text(std::filesystem::file_size(file), '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  return text;
}

class Reader {
 public:
  Reader(const std::filesystem::path& file, const std::string& header, char separator, TimeOrder order)
      : table_{file, 0, {}, {}},
        header_(header),
        separator_(separator),
        order_(order),
        names_(split(header_, separator)) {
    table_.columns = names_.size();
  }

  Table read(bool header_expected) {
    const std::string text = contents(table_.file);
    std::string_view rest = text;
    if (rest.starts_with("\xEF\xBB\xBF")) rest.remove_prefix(3);  // byte order mark
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find('\n'), rest.size());
      const std::string_view line = trimmed(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
      ++line_;
      if (line.empty() || line.front() == '#') continue;
      separator_ == ' ' ? words(line, fields_) : split(line, separator_, fields_);
      if (!std::exchange(header_expected, false))
        add_row();
      else if (fields_ != names_)
        fail(fmt::format("the first line must name the columns {}, not {}", header_, quote(line)));
    }
    if (header_expected) fail(fmt::format("the line that names the columns {} is missing", header_));
    return std::move(table_);
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    throw Error(fmt::format("{}:{}: {}", table_.file.string(), std::max(line_, 1), reason));
  }

  void add_row() {
    if (fields_.size() != names_.size())
      fail(fmt::format("{} columns where {} are expected ({})", fields_.size(), names_.size(), header_));
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      const auto value = parse_number(fields_[i]);
      if (!value) fail(fmt::format("{} is {}, not a number", names_[i], quote(fields_[i])));
      if (!std::isfinite(*value)) fail(fmt::format("{} is {}; numbers must be finite", names_[i], fields_[i]));
      table_.values.push_back(*value);
    }
    table_.lines.push_back(line_);
    check_time();
  }

  void check_time() const {
    const std::size_t last = table_.rows() - 1;
    if (order_ == TimeOrder::any) return;
    if (last == 0 || table_.t(last) > table_.t(last - 1)) return;
    const bool repeats = table_.t(last) == table_.t(last - 1);
    if (repeats && order_ == TimeOrder::repeating) return;
    fail(fmt::format("time {} {} line {}{}", fields_[0], repeats ? "repeats that of" : "comes before that of",
                     table_.lines[last - 1], repeats ? "" : "; lines must be in time order"));
  }

  Table table_;
  std::string header_;
  char separator_;
  TimeOrder order_;
  std::vector<std::string_view> names_, fields_;
  int line_ = 0;
};

}  // namespace

std::string Table::where(std::size_t i) const { return fmt::format("{}:{}", file.string(), lines[i]); }

Table read_csv(const std::filesystem::path& file, const std::string& header, TimeOrder order) {
  return Reader(file, header, ',', order).read(true);
}

Table read_tum(const std::filesystem::path& file) {
  return Reader(file, "t x y z qx qy qz qw", ' ', TimeOrder::repeating).read(false);
}

std::vector<Stamped<SE3>> poses(const Table& table) {
  std::vector<Stamped<SE3>> result;
  result.reserve(table.rows());
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const double* row = table.row(i);
    const auto rotation = rotation_from(row + 4);
    if (!rotation) throw Error(fmt::format("{}: {}", table.where(i), not_a_rotation(row + 4)));
    const SE3 pose(*rotation, Vector<3>(row + 1));
    if (!result.empty() && table.t(i) == result.back().t) {  // loggers write a pose twice now and then
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
