#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tandem/studies/online/track_records.hpp>
#include <tandem/studies/scenario/frame.hpp>
#include <tandem/studies/support/file_description.hpp>

namespace tandem {

/// Covariances in a line: the joint one of chaser and target, that of each, or none.
enum class LineCovariance { joint, blocks, off };

/// Returns an update as one line of JSON, with a line end, in the frame of the scenario. `sensors` are the names of the
/// sensors in the record's health, `ahead` the prediction horizons [s].
std::string track_json_line(const TrackRecord& record, const Frame& frame, const std::vector<std::string>& sensors,
                            const std::vector<double>& ahead, LineCovariance covariance = LineCovariance::joint);
/// Returns updates as such lines, at most `rate` per second of data.
class TrackJsonLines {
 public:
  TrackJsonLines(const Frame& frame, std::vector<std::string> sensors, std::vector<double> ahead,
                 LineCovariance covariance, std::optional<double> rate)
      : frame_(frame),
        sensors_(std::move(sensors)),
        ahead_(std::move(ahead)),
        covariance_(covariance),
        interval_(rate ? 1 / *rate : 0) {}

  /// Returns the line of a record, or an empty string if the rate does not allow one.
  std::string operator()(const TrackRecord& record) {
    constexpr double kRounding = 1e-6;  // s
    const double since = record.t - last_;
    if (since >= 0 && since < interval_ - kRounding) return "";  // an earlier time follows a reset of the time base
    last_ = record.t;
    return track_json_line(record, frame_, sensors_, ahead_, covariance_);
  }

 private:
  const Frame frame_;
  const std::vector<std::string> sensors_;
  const std::vector<double> ahead_;
  const LineCovariance covariance_;
  const double interval_;  // s
  double last_ = -HUGE_VAL;
};

/// Returns the keys of these lines.
FileDescription track_json_line_keys();

}  // namespace tandem
