#pragma once

#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <tandem/studies/recording/nmea_clock.hpp>

namespace tandem {

/// A line of a log with its sentence.
struct NmeaLine {
  std::size_t number;
  std::string type;
  double received;       ///< receive time [s]; nan without one
  std::string sentence;  ///< without $ and checksum
};

/// Gives times to the sentences that state none, such as headings.
///
/// If the lines have receive times, those are shifted to the time of the fixes by a moving mean of the difference.
/// Otherwise, the sentences of a type that follow a fix are spread evenly until the next fix, so the lines are kept
/// until then. Without any fix in the log, the time is the receive time.
class NmeaInterval {
 public:
  using Row = std::function<void(const NmeaLine& line, double time)>;

  struct Settings {
    bool fixes = false;          ///< whether the log has sentences with a time
    bool receive_times = false;  ///< whether the lines have receive times that are finer than a second
  };
  NmeaInterval(const Settings& settings, Row row) : settings_(settings), row_(std::move(row)) {}

  void add(NmeaLine line, const NmeaClock::Stamp& stamp);
  /// Passes on the last lines.
  void end() { pass_on(std::numeric_limits<double>::quiet_NaN()); }

 private:
  struct Entry {
    NmeaLine line;
    NmeaClock::Stamp stamp;
  };
  /// The sentences of one type since the last fix.
  struct Series {
    std::size_t count = 0, next = 0;
    double step = 0;  ///< s, in the last whole interval
  };

  void pass_on(double next_fix);
  void add_difference(double difference);
  double time_of(const NmeaLine& line, Series& series, double next_fix) const;

  Settings settings_;
  Row row_;
  std::vector<Entry> entries_;
  std::map<std::string, Series> series_;
  double fix_ = std::numeric_limits<double>::quiet_NaN();  ///< time of the last fix
  double difference_ = 0;                                  ///< time of the fixes minus receive time [s]
  int differences_ = 0;                                    ///< number in the mean
};

}  // namespace tandem
