#pragma once

#include <string>
#include <vector>

#include <tandem/studies/report/plot_parts.hpp>

namespace tandem::plot {

/// The time axis of a run's figures: UTC if the stamps are seconds since 1970, else hours, minutes and seconds since
/// the start; decimal hours if such a run takes a day or longer. Times are in seconds since the start.
class TimeAxis {
 public:
  /// `start`: stamp of the first keyframe [s]. `span`: duration of the run [s].
  TimeAxis(double start, double span);

  /// Returns times as the page expects them: in ms since 1970, or in hours.
  Json values(const std::vector<double>& t) const;
  /// Returns the layout of the axis.
  Json axis() const;
  /// Returns a time, as on the axis: hours, minutes and seconds of the day (UTC) or since the start.
  std::string text(double t) const;
  /// Returns the start as date and time; empty if the stamps are not UTC.
  std::string start_text() const;

 private:
  double start_, span_;
  bool utc_, hours_;
};

}  // namespace tandem::plot
