#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/recorded_time.hpp>
#include <tandem/studies/recording/recording_formats.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr double kDay = 86400;  // s
constexpr double kKnots = 1852.0 / 3600;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Conversion of a part of a sentence to a number.
enum class Part {
  number,
  text,
  time,       ///< hhmmss.ss
  latitude,   ///< ddmm.mm and N or S in the next part
  longitude,  ///< dddmm.mm and E or W in the next part
  east,       ///< degrees and E or W in the next part
  knots,
  kmh,
};

struct SentenceField {
  const char* name;
  const char* unit;
  std::size_t part;  ///< index after the address, from 1
  Part kind;
};

struct Sentence {
  std::string_view type;
  std::vector<SentenceField> fields;
};

/// Sentences whose fields have names. All others have their parts by number.
const std::vector<Sentence>& sentences() {
  static const std::vector<Sentence> all = {
      {"GGA",
       {{"latitude", "deg", 2, Part::latitude},
        {"longitude", "deg", 4, Part::longitude},
        {"quality", "", 6, Part::number},
        {"satellites", "", 7, Part::number},
        {"hdop", "", 8, Part::number},
        {"altitude", "m", 9, Part::number},
        {"geoid_separation", "m", 11, Part::number}}},
      {"RMC",
       {{"status", "", 2, Part::text},
        {"latitude", "deg", 3, Part::latitude},
        {"longitude", "deg", 5, Part::longitude},
        {"speed", "m/s", 7, Part::knots},
        {"course", "deg", 8, Part::number},
        {"variation", "deg", 10, Part::east}}},
      {"HDT", {{"heading", "deg", 1, Part::number}}},
      {"HDG",
       {{"heading", "deg", 1, Part::number}, {"deviation", "deg", 2, Part::east}, {"variation", "deg", 4, Part::east}}},
      {"VTG",
       {{"course", "deg", 1, Part::number},
        {"course_magnetic", "deg", 3, Part::number},
        {"speed", "m/s", 7, Part::kmh}}},
      {"DPT", {{"depth", "m", 1, Part::number}, {"offset", "m", 2, Part::number}}},
      {"ROT", {{"rate", "deg/min", 1, Part::number}, {"status", "", 2, Part::text}}},
  };
  return all;
}

/// Returns dddmm.mmm in degrees.
double degrees(double value) {
  const double whole = std::trunc(value / 100);
  return whole + (value - 100 * whole) / 60;
}

double number(std::string_view text) { return parse_number(text).value_or(kNan); }

std::optional<double> nmea_time(std::string_view text) {
  const double value = number(text);
  if (text.size() < 6 || !(value >= 0)) return {};
  const double hours = std::floor(value / 10000), minutes = std::floor(value / 100) - 100 * hours;
  return hours * 3600 + minutes * 60 + (value - 10000 * hours - 100 * minutes);
}

/// Lines of NMEA 0183, with or without a time in front of each. The time of a sentence is its own, or that of the last
/// sentence with one; the date comes from RMC and ZDA.
class NmeaRecording : public Recording {
 public:
  explicit NmeaRecording(const std::filesystem::path& file) {
    file_ = file;
    format_ = "NMEA";
    counting_ = true;
    scan([] {});
    counting_ = false;
    if (bad_ > 0)
      add_defect(fmt::format("{} lines with a wrong checksum are skipped, the first is line {}", bad_, first_bad_));
    if (!date_) add_defect("no sentence has a date (RMC or ZDA), so times count from midnight; give date in the map");
  }

  void read(const std::vector<RowRequest>& requests, const std::function<void()>& stop) override {
    requests_ = &requests;
    indices_.clear();
    for (const RowRequest& request : requests) {
      const RecordedStream* stream = find(request.stream);
      indices_.push_back(stream ? field_indices(*stream, request.fields) : std::vector<std::size_t>());
    }
    scan(stop);
    requests_ = nullptr;
  }

 private:
  void scan(const std::function<void()>& stop) {
    InputFile stream(file_);
    std::string line;
    now_ = kNan;
    // The date of the first pass applies to the sentences before the first date, too.
    midnight_ = counting_ ? 0 : date_.value_or(0);
    last_of_day_ = -1;
    for (std::size_t n = 1; std::getline(stream, line); ++n) {
      if (n % 4096 == 0) stop();
      const std::size_t dollar = line.find_first_of("$!");
      if (dollar == std::string::npos) continue;
      std::string_view sentence = trimmed(std::string_view(line).substr(dollar + 1));
      if (!valid(sentence)) {
        if (counting_ && bad_++ == 0) first_bad_ = n;
        continue;
      }
      sentence = sentence.substr(0, sentence.rfind('*'));
      split(sentence, ',', parts_);
      if (parts_.front().size() < 3) continue;
      handle(receive_time(std::string_view(line).substr(0, dollar)));
    }
  }

  /// Returns whether the checksum, if there is one, is right.
  static bool valid(std::string_view sentence) {
    const std::size_t star = sentence.rfind('*');
    if (star == std::string_view::npos) return true;
    unsigned sum = 0;
    for (const char c : sentence.substr(0, star)) sum ^= static_cast<unsigned char>(c);
    return fmt::format("{:02X}", sum) == upper(sentence.substr(star + 1, 2));
  }
  static std::string upper(std::string_view text) {
    std::string result(text);
    for (char& c : result) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return result;
  }

  /// Returns the time that a logger wrote in front of the sentence, or nan.
  static double receive_time(std::string_view prefix) {
    while (!prefix.empty() && std::string_view(",; \t]").find(prefix.back()) != std::string_view::npos)
      prefix.remove_suffix(1);
    while (!prefix.empty() && std::string_view("[ ").find(prefix.front()) != std::string_view::npos)
      prefix.remove_prefix(1);
    if (prefix.empty()) return kNan;
    const std::string_view first = prefix.substr(0, prefix.find_first_of(",;"));
    if (const auto value = parse_number(first))
      return *value * (*value > 1e17 ? 1e-9 : *value > 1e14 ? 1e-6 : *value > 1e11 ? 1e-3 : 1);
    return parse_time_text(first).value_or(kNan);
  }

  void handle(double received) {
    const std::string_view address = parts_.front();
    const bool vendor = address.front() == 'P';
    const std::string type(vendor || address.size() < 5 ? address : address.substr(address.size() - 3));
    update_time(type);
    const Sentence* known = nullptr;
    for (const Sentence& sentence : sentences())
      if (sentence.type == type) known = &sentence;
    if (counting_) count(type, known, received);
    if (!requests_) return;
    for (std::size_t r = 0; r < requests_->size(); ++r) {
      const RowRequest& request = (*requests_)[r];
      if (request.stream != type) continue;
      values_.clear();
      for (const std::size_t index : indices_[r]) values_.push_back(value(index, known));
      request.row({received, values_});
    }
  }

  void update_time(const std::string& type) {
    const std::size_t at = type == "GGA" || type == "RMC" || type == "ZDA" || type == "GNS" || type == "GST" ? 1
                           : type == "GLL"                                                                   ? 5
                                                                                                             : 0;
    if (at == 0 || at >= parts_.size()) return;
    const auto of_day = nmea_time(parts_[at]);
    if (!of_day) return;
    if (last_of_day_ - *of_day > kDay / 2) midnight_ += kDay;
    last_of_day_ = *of_day;
    if (const auto date = date_of(type)) {
      if (!date_) date_ = *date;
      midnight_ = *date;
    }
    now_ = midnight_ + *of_day;
  }

  std::optional<double> date_of(const std::string& type) const {
    double day = kNan, month = kNan, year = kNan;
    if (type == "RMC" && parts_.size() > 9 && parts_[9].size() == 6) {
      const double ddmmyy = number(parts_[9]);
      day = std::floor(ddmmyy / 10000);
      month = std::fmod(std::floor(ddmmyy / 100), 100);
      year = std::fmod(ddmmyy, 100) + (std::fmod(ddmmyy, 100) < 80 ? 2000 : 1900);
    } else if (type == "ZDA" && parts_.size() > 4) {
      day = number(parts_[2]);
      month = number(parts_[3]);
      year = number(parts_[4]);
    }
    if (!(day >= 1 && day <= 31 && month >= 1 && month <= 12 && year >= 1980)) return {};
    return kDay *
           static_cast<double>(days_since_1970(static_cast<int>(year), static_cast<int>(month), static_cast<int>(day)));
  }

  /// Fields: time, talker, then the named ones or the parts by number.
  void count(const std::string& type, const Sentence* known, double received) {
    auto stream = std::find_if(streams_.begin(), streams_.end(), [&](const auto& s) { return s.name == type; });
    if (stream == streams_.end()) {
      RecordedStream added{type, "NMEA/" + type};
      added.fields = {{"time", "s"}, {"talker"}};
      if (known)
        for (const SentenceField& field : known->fields) added.fields.push_back({field.name, field.unit});
      added.time_field = "time";
      stream = streams_.insert(streams_.end(), std::move(added));
    }
    if (!known)
      while (stream->fields.size() < parts_.size() + 1)
        stream->fields.push_back({fmt::format("{}", stream->fields.size() - 1)});
    ++stream->rows;
    const double t = std::isnan(now_) ? received : now_;
    if (!(stream->first <= t)) stream->first = t;
    if (!(stream->last >= t)) stream->last = t;
  }

  RecordedValue value(std::size_t index, const Sentence* known) const {
    if (index == 0) return {now_};
    if (index == 1) return {kNan, parts_.front().substr(0, 2)};
    const SentenceField numbered{"", "", index - 1, Part::number};
    const SentenceField& field = known ? known->fields[index - 2] : numbered;
    if (field.part >= parts_.size()) return {};
    const std::string_view part = trimmed(parts_[field.part]);
    const std::string_view side = field.part + 1 < parts_.size() ? trimmed(parts_[field.part + 1]) : std::string_view();
    const double sign = side == "S" || side == "W" ? -1 : 1;
    const double n = number(part);
    switch (field.kind) {
      case Part::number:
      case Part::time:
        return std::isnan(n) ? RecordedValue{kNan, part} : RecordedValue{n};
      case Part::text:
        return {kNan, part};
      case Part::latitude:
      case Part::longitude:
        return {sign * degrees(n)};
      case Part::east:
        return {sign * n};
      case Part::knots:
        return {n * kKnots};
      case Part::kmh:
        return {n / 3.6};
    }
    return {};
  }

  const std::vector<RowRequest>* requests_ = nullptr;
  std::vector<std::vector<std::size_t>> indices_;
  std::vector<std::string_view> parts_;
  std::vector<RecordedValue> values_;
  bool counting_ = false;
  std::size_t bad_ = 0, first_bad_ = 0;
  std::optional<double> date_;  ///< midnight of the first date [s since 1970]
  double now_ = kNan, midnight_ = 0, last_of_day_ = -1;
};

}  // namespace

std::unique_ptr<Recording> open_nmea(const std::filesystem::path& file) {
  return std::make_unique<NmeaRecording>(file);
}

}  // namespace tandem
