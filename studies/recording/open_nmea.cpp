#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include <tandem/studies/recording/nmea_clock.hpp>
#include <tandem/studies/recording/nmea_interval.hpp>
#include <tandem/studies/recording/recording_formats.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Lines of NMEA 0183, with or without a receive time in front of each.
class NmeaRecording : public Recording {
 public:
  explicit NmeaRecording(const std::filesystem::path& file) {
    file_ = file;
    format_ = "NMEA";
    learn();
    scan([] {}, [this](const NmeaLine& line, double time) { count(line, time); });
    describe_streams();
    if (bad_ > 0)
      add_defect(fmt::format("{} lines with a wrong checksum are skipped, the first is line {}", bad_, first_bad_));
    if (cut_ > 0)
      add_defect(fmt::format(
          "{} lines are skipped as cut: they lack the checksum that others of their type have, the first is "
          "line {}",
          cut_, first_cut_));
    if (!clock_.has_date())
      add_defect(
          fmt::format("no sentence {}has a date (RMC or ZDA), so times count from midnight; give date in the map",
                      clock_.has_void_date() ? "with a fix " : ""));
  }

  void read(const std::vector<RowRequest>& requests, const std::function<void()>& stop) override {
    std::vector<std::vector<std::size_t>> indices;
    for (const RowRequest& request : requests) {
      const RecordedStream* stream = find(request.stream);
      indices.push_back(stream ? field_indices(*stream, request.fields) : std::vector<std::size_t>());
    }
    std::vector<RecordedValue> values;
    scan(stop, [&](const NmeaLine& line, double time) {
      for (std::size_t r = 0; r < requests.size(); ++r) {
        if (requests[r].stream != line.type) continue;
        split(line.sentence, ',', parts_);
        values.clear();
        for (const std::size_t index : indices[r]) values.push_back(value(index, find_nmea_sentence(line.type), time));
        requests[r].row({line.received, values});
      }
    });
  }

 private:
  struct Checksums {
    std::size_t with = 0, without = 0;
  };

  /// Calls f(line, whether it has a checksum) for each sentence that is not damaged.
  template <class F>
  void each_sentence(const std::function<void()>& stop, F f) {
    InputFile stream(file_);
    std::string text;
    bad_ = 0;
    for (std::size_t n = 1; std::getline(stream, text); ++n) {
      if (n % 4096 == 0) stop();
      const std::size_t first = text.find_first_of("$!");
      // The rest of a cut sentence may precede a whole one.
      for (std::size_t at = first; at != std::string::npos; at = text.find_first_of("$!", at + 1)) {
        const std::string_view sentence = trimmed(std::string_view(text).substr(at + 1));
        const NmeaChecksum checksum = nmea_checksum(sentence);
        if (checksum == NmeaChecksum::wrong) {
          if (bad_++ == 0) first_bad_ = n;
          continue;
        }
        const std::string_view content = sentence.substr(0, sentence.rfind('*'));
        const std::string_view address = content.substr(0, content.find(','));
        if (address.size() >= 3)
          f(NmeaLine{n, nmea_type(address), nmea_receive_time(std::string_view(text).substr(0, first)),
                     std::string(content)},
            checksum == NmeaChecksum::right);
        break;
      }
    }
  }

  /// Makes the first pass: finds the dates, and whether the sentences of each type have checksums.
  void learn() {
    learn_dates();
    if (!clock_.has_status()) {  // for example, a log of ZDA and HDT
      clock_ = NmeaClock(true);
      learn_dates();
    }
    times_.fixes = clock_.has_time();
  }

  void learn_dates() {
    checksums_.clear();
    each_sentence([] {},
                  [&](const NmeaLine& line, bool checked) {
                    ++(checked ? checksums_[line.type].with : checksums_[line.type].without);
                    split(line.sentence, ',', parts_);
                    clock_.stamp(line.number, line.type, parts_);
                    times_.receive_times |= line.received != std::floor(line.received) && !std::isnan(line.received);
                  });
    clock_.end_first_pass();
  }

  /// Calls row(line, time) for each sentence.
  void scan(const std::function<void()>& stop, const NmeaInterval::Row& row) {
    clock_.restart();
    cut_ = 0;
    NmeaInterval interval(times_, row);
    each_sentence(stop, [&](NmeaLine line, bool checked) {
      const Checksums& of_type = checksums_.at(line.type);
      if (!checked && of_type.with > of_type.without) {
        if (cut_++ == 0) first_cut_ = line.number;
        return;
      }
      split(line.sentence, ',', parts_);
      const NmeaClock::Stamp stamp = clock_.stamp(line.number, line.type, parts_);
      interval.add(std::move(line), stamp);
    });
    interval.end();
  }

  /// Counts a row. Fields: time, talker, then the named ones or the parts by number.
  void count(const NmeaLine& line, double time) {
    split(line.sentence, ',', parts_);
    const NmeaSentence* known = find_nmea_sentence(line.type);
    auto stream = std::find_if(streams_.begin(), streams_.end(), [&](const auto& s) { return s.name == line.type; });
    if (stream == streams_.end()) {
      RecordedStream added{line.type, "NMEA/" + line.type};
      added.fields = {{"time", "s"}, {"talker"}};
      if (known)
        for (const NmeaField& field : known->fields) added.fields.push_back({field.name, field.unit});
      added.time_field = "time";
      stream = streams_.insert(streams_.end(), std::move(added));
    }
    if (!known)
      while (stream->fields.size() < parts_.size() + 1)
        stream->fields.push_back({fmt::format("{}", stream->fields.size() - 1)});
    if (line.type == "HDG" && !std::isnan(nmea_value(parts_, known->fields.back()).number)) ++true_headings_;
    ++stream->rows;
    if (!(stream->first <= time)) stream->first = time;
    if (!(stream->last >= time)) stream->last = time;
  }

  void describe_streams() {
    for (RecordedStream& stream : streams_) {
      // The field heading_true is the last one, and only those logs have it that state the variation.
      if (stream.name == "HDG" && 2 * true_headings_ < stream.rows) stream.fields.pop_back();
      if (!times_.fixes || NmeaClock::is_timed(stream.name)) continue;
      stream.time_note =
          times_.receive_times
              ? "its sentences have no time; they take the receive time, shifted to the time of the fixes"
              : "its sentences have no time; those after a fix are spread evenly until the next fix";
    }
  }

  RecordedValue value(std::size_t index, const NmeaSentence* known, double time) const {
    if (index == 0) return {time};
    if (index == 1) return {std::nan(""), parts_.front().substr(0, 2)};
    return nmea_value(parts_, known ? known->fields[index - 2] : NmeaField{"", "", index - 1, NmeaPart::number});
  }

  NmeaClock clock_;
  NmeaInterval::Settings times_;
  NmeaParts parts_;
  std::map<std::string, Checksums> checksums_;
  std::size_t true_headings_ = 0;
  std::size_t bad_ = 0, first_bad_ = 0, cut_ = 0, first_cut_ = 0;
};

}  // namespace

std::unique_ptr<Recording> open_nmea(const std::filesystem::path& file) {
  return std::make_unique<NmeaRecording>(file);
}

}  // namespace tandem
