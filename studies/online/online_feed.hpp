#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <istream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <tandem/solvers/online/stream_clocks.hpp>
#include <tandem/studies/online/reorder_buffer.hpp>
#include <tandem/studies/online/settling_lines.hpp>
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/scenario/table.hpp>

namespace tandem {

/// Counts of rejected input lines by sensor and reason.
class RejectedLines {
 public:
  using Counts = std::map<std::pair<std::string, std::string>, std::size_t>;

  void add(const std::string& sensor, const std::string& reason, std::size_t n = 1) { counts_[{sensor, reason}] += n; }
  void restore(const Counts& counts) { counts_ = counts; }
  const Counts& counts() const { return counts_; }

 private:
  Counts counts_;
};

/// One input stream of a scenario: the odometry, or one sensor.
struct FeedStream {
  enum class Kind { odometry, imu, ego, target };
  Kind kind;
  std::size_t sensor;  ///< index of the sensor in the scenario's navigation or tracking data
  std::string name;    ///< "odometry" or the name of the sensor
  std::filesystem::path file;
  RowFormat of_file, of_stream;   ///< format of a line in the file, and of a live line after its sensor name
  bool may_repeat;                ///< whether consecutive lines may have the same time
  std::vector<double> missing{};  ///< numbers that stand for missing data
};

/// One parsed input line, in ENU-FLU.
struct FeedLine {
  double t;                 ///< common time of all streams [s]: the stamp, corrected by StreamClocks if needed
  std::size_t stream;       ///< index in FeedStreams::all()
  bool time_reset = false;  ///< whether the common time restarts with this line; it may then run backwards
  std::variant<Stamped<SE3>, ImuSample, EgoMeasurement, Measurement> data;
};

/// The input streams of a scenario, in the order in which lines of the same time are used: the chaser's motion first,
/// then target poses, then the other target measurements.
class FeedStreams {
 public:
  explicit FeedStreams(const Scenario& settings);

  const std::vector<FeedStream>& all() const { return streams_; }
  std::vector<FeedStream>& all() { return streams_; }
  /// Converts a row of a stream. Throws Error with the reason, without file and line, if the row is invalid.
  FeedLine line(std::size_t stream, const std::vector<double>& row) const;

 private:
  Frame frame_;
  bool planar_;
  std::vector<SensorType> target_;
  std::vector<EgoSensorType> ego_;
  std::vector<FeedStream> streams_;
};

/// The read position of an OnlineFeed.
struct FeedCheckpoint {
  std::vector<std::size_t> rows{};  ///< number of rows used of each stream's file; zeros for a StreamFeed
  StreamClocks::Checkpoint clocks{};
  RejectedLines::Counts rejected_lines{};
};

/// Source of a scenario's measurements, line by line in order of arrival: a line stamped t arrives at t. StreamClocks
/// assigns the time of each line. Lines of the odometry or the IMU that arrive in disorder are brought into order; those
/// of other sensors may be late. The feed counts and discards lines that repeat an earlier line or its time where it
/// may not, or whose time is a single outlier. Memory does not grow with the number of lines.
class OnlineFeed {
 public:
  explicit OnlineFeed(const Scenario& settings);
  virtual ~OnlineFeed() = default;
  OnlineFeed(const OnlineFeed&) = delete;

  /// Called with one sentence when StreamClocks detects the unit, an offset or a jump of a stream's clock.
  std::function<void(const std::string&)> on_notice;

  /// Sets the unit of all stamps [s]. Without this call, the feed detects the unit, from nanoseconds to seconds.
  void set_unit(double seconds) { clocks_.set_unit(seconds); }

  /// Gives out each line only after a line `seconds` later has arrived, in the order of the times: late lines of all
  /// streams then come in order. There are no checkpoints while lines wait.
  void set_settling_time(double seconds) { settling_.set_delay(seconds); }

  /// Returns the next line, or nothing at the end of the data.
  std::optional<FeedLine> next();
  const FeedStreams& streams() const { return streams_; }
  const RejectedLines& rejected_lines() const { return rejected_; }

  /// Returns the read position, or nothing while accepted lines still wait for next().
  std::optional<FeedCheckpoint> checkpoint() const;
  /// Continues from a checkpoint; call it before next(). Throws Error if a file has fewer rows than the checkpoint.
  void restore(const FeedCheckpoint& checkpoint);

 protected:
  /// Reads the next line of any stream, in order of arrival; nothing at the end.
  virtual std::optional<FeedLine> read() = 0;
  /// Returns the number of rows that read() has returned of a stream, less the last `held`, which are not yet accepted.
  virtual std::size_t rows(std::size_t /*stream*/, std::size_t /*held*/) const { return 0; }
  virtual void skip(std::size_t /*stream*/, std::size_t /*rows*/) {}

  FeedStreams streams_;
  RejectedLines rejected_;

 private:
  std::optional<FeedLine> next_accepted();
  void judge(FeedLine line);
  void make_ready(std::size_t stream, FeedLine line, bool time_reset);
  bool is_repeated(std::size_t stream, const FeedLine& line);

  StreamClocks clocks_;
  std::deque<FeedLine> waiting_;                     // lines that wait until the unit of stamps is known
  std::vector<std::deque<FeedLine>> held_;           // per stream: lines after a time jump that is not yet confirmed
  std::deque<FeedLine> ready_;                       // accepted lines
  SettlingLines<FeedLine> settling_;                 // accepted lines
  std::vector<ReorderBuffer<FeedLine>> disordered_;  // per stream: lines of the motion; unused if lines settle
  std::vector<std::multimap<double, std::size_t>> recent_;  // per stream: hashes of the newest lines by time
};

/// Feed that merges the files of a scenario folder by time. next() throws Error with file, line and reason if a line is
/// malformed.
class FolderFeed : public OnlineFeed {
 public:
  /// Throws Error if a file is missing.
  explicit FolderFeed(const Scenario& settings);

 protected:
  std::optional<FeedLine> read() override;
  std::size_t rows(std::size_t stream, std::size_t held) const override { return rows_[stream] - held; }
  void skip(std::size_t stream, std::size_t rows) override;

 private:
  void advance(std::size_t stream);

  std::vector<std::unique_ptr<RowFile>> files_;
  std::vector<std::optional<FeedLine>> heads_;  // the next line of each stream
  std::vector<std::size_t> rows_;               // number of rows of each stream that read() has returned
};

/// Returns a warning if the stamps of a sensor file do not overlap those of the chaser's motion (odometry or IMU), else
/// an empty string. Reads only the first and the last lines of each file.
std::string timestamp_overlap_warning(const Scenario& settings);

/// Feed that reads lines "NAME,<row of that sensor's CSV file>" from a file descriptor; chaser poses are
/// "odometry,t,x,y,z,qx,qy,qz,qw". Skips empty lines and lines that begin with #. Counts and discards malformed lines,
/// and passes a warning with the line number to `warn`.
class StreamFeed : public OnlineFeed {
 public:
  /// `name` is the name of the input in messages. Setting `stop` ends the feed, also while it waits for input.
  StreamFeed(const Scenario& settings, int descriptor, std::string name, const std::atomic<bool>& stop,
             std::function<void(const std::string&)> warn);
  /// Appends more input to its argument; returns false at the end of the input.
  using Source = std::function<bool(std::string&)>;
  StreamFeed(const Scenario& settings, Source more, std::string name, const std::atomic<bool>& stop,
             std::function<void(const std::string&)> warn);

 protected:
  std::optional<FeedLine> read() override;

 private:
  bool read_line();
  bool fill();
  std::optional<FeedLine> parsed(std::string_view line);

  Source more_;
  std::string name_;
  const std::atomic<bool>& stop_;
  std::function<void(const std::string&)> warn_;
  std::map<std::string, std::size_t, std::less<>> by_name_;
  std::string buffer_, line_;
  std::size_t taken_ = 0;  // bytes of buffer_ that are already processed
  bool ended_ = false, too_long_ = false;
  std::size_t number_ = 0;  // of the last line read, from 1
};

}  // namespace tandem
