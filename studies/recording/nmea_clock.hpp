#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <tandem/studies/recording/nmea_sentence.hpp>

namespace tandem {

/// The time of the sentences of a log, whose times of day lack a date. Dates come from RMC and ZDA.
///
/// A log is passed twice. The first pass divides it into runs without a jump in time and finds the date of each run, so
/// in the second pass a date also applies to the sentences before it. Midnight inside a run changes the day, in both
/// directions, since receivers may be out of order. Sentences without a fix (RMC with status V, GGA with quality 0)
/// give no date, and no time unless it continues that of the sentences with a fix.
class NmeaClock {
 public:
  struct Stamp {
    bool has_time = false;                                   ///< whether the sentence states a time of day
    double time = std::numeric_limits<double>::quiet_NaN();  ///< s since 1970; nan if it is not usable
  };

  /// `trusted`: whether sentences before the first one with a status count as those with a fix.
  explicit NmeaClock(bool trusted = false) : trusted_(trusted), void_(!trusted) {}

  /// Returns the time of the sentence in line `line`. During the first pass, its date may still be missing.
  Stamp stamp(std::size_t line, std::string_view type, const NmeaParts& parts);
  /// Ends the first pass.
  void end_first_pass();
  /// Returns to the start of the log.
  void restart();

  /// Returns whether sentences of this type state a time of day.
  static bool is_timed(std::string_view type);
  bool has_time() const { return !runs_.empty(); }
  bool has_status() const { return has_status_; }
  bool has_date() const { return has_date_; }
  bool has_void_date() const { return has_void_date_; }

 private:
  struct Reading {
    double of_day;
    bool fix;
    std::optional<double> date{};  ///< midnight [s since 1970]
  };
  struct Run {
    std::size_t line;  ///< the first one
    bool fix = false;
    std::optional<double> midnight{};  ///< of day 0 [s since 1970]
  };

  std::optional<Reading> read(std::string_view type, const NmeaParts& parts);
  void add_date(std::size_t line, double midnight);

  std::vector<Run> runs_;
  bool trusted_;
  bool first_pass_ = true, has_status_ = false, has_date_ = false, has_void_date_ = false;
  // State of a pass:
  bool void_;  ///< whether the last sentence with a status has no fix
  bool any_fix_ = false;
  std::optional<double> of_day_{};
  int day_ = 0;
  std::size_t run_ = 0;
};

}  // namespace tandem
