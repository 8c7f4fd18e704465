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
#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/scenario/table.hpp>

namespace tandem {

/// Lines that are of no use, counted by sensor and reason.
class RefusedLines {
 public:
  using Counts = std::map<std::pair<std::string, std::string>, std::size_t>;

  void add(const std::string& sensor, const std::string& reason, std::size_t n = 1) { counts_[{sensor, reason}] += n; }
  void go_on_from(const Counts& counts) { counts_ = counts; }
  const Counts& counts() const { return counts_; }

 private:
  Counts counts_;
};

/// One of the streams that a scenario's data come in.
struct FeedStream {
  enum class Kind { odometry, imu, ego, target };
  Kind kind;
  std::size_t sensor;  ///< in the scenario's navigation or tracking data
  std::string name;    ///< "odometry" or the sensor's
  std::filesystem::path file;
  RowFormat of_file, of_stream;  ///< of the file's lines; of a live line, less its name
  bool may_repeat;               ///< times
};

/// One line as it arrives, in ENU-FLU.
struct FeedLine {
  double t;            ///< s, in the streams' common time: as stamped, but where a clock is wrong (see StreamClocks)
  std::size_t stream;  ///< in FeedStreams
  bool anew = false;   ///< the common time begins anew with this line, and may run backwards
  std::variant<Stamped<SE3>, ImuSample, EgoMeasurement, Measurement> data;
};

/// The streams of a scenario: of one instant, the chaser's own motion comes first, then what it sees of the target, poses
/// before positions.
class FeedStreams {
 public:
  explicit FeedStreams(const Scenario& settings);

  const std::vector<FeedStream>& all() const { return streams_; }
  std::vector<FeedStream>& all() { return streams_; }
  /// What a row says. Throws Error that says what is wrong with it, but not where.
  FeedLine line(std::size_t stream, const std::vector<double>& row) const;

 private:
  Frame frame_;
  bool planar_;
  std::vector<SensorType> target_;
  std::vector<EgoSensorType> ego_;
  std::vector<FeedStream> streams_;
};

/// How far a LiveFeed has come.
struct FeedPlace {
  std::vector<std::size_t> rows{};  ///< of each stream's file, where there are files
  StreamClocks::Memory clocks{};
  RefusedLines::Counts refused{};
};

/// A scenario's data line by line in the order in which they arrive: a line stamped t arrives at t. Memory does not grow
/// with the number of lines. StreamClocks say at which time a line is used; those whose time runs backwards, repeats one
/// that may not be repeated, or leaps away from all others for that line alone are counted and left out.
class LiveFeed {
 public:
  explicit LiveFeed(const Scenario& settings);
  virtual ~LiveFeed() = default;
  LiveFeed(const LiveFeed&) = delete;

  /// Told what is found out about the streams' clocks, a sentence.
  std::function<void(const std::string&)> on_notice;

  /// One stamp is so many seconds; without it, seconds to nanoseconds are told apart.
  void set_unit(double seconds) { clocks_.set_unit(seconds); }

  /// The next line; nothing at the end.
  std::optional<FeedLine> next();
  const FeedStreams& streams() const { return streams_; }
  const RefusedLines& refused() const { return refused_; }

  /// Where it is, when next() has given all that it has taken for good; nothing until then.
  std::optional<FeedPlace> place() const;
  /// Goes on from there, before the first line of this one was asked for. Throws Error where files end before it.
  void go_on_from(const FeedPlace& place);

 protected:
  virtual std::optional<FeedLine> read() = 0;
  /// Of a stream's lines that read() has given so many are `held` back.
  virtual std::size_t rows(std::size_t /*stream*/, std::size_t /*held*/) const { return 0; }
  virtual void skip(std::size_t /*stream*/, std::size_t /*rows*/) {}

  FeedStreams streams_;
  RefusedLines refused_;

 private:
  void judge(FeedLine line);
  void make_ready(std::size_t stream, FeedLine line, bool anew);

  StreamClocks clocks_;
  std::deque<FeedLine> waiting_;            // until the unit of stamps is known
  std::vector<std::deque<FeedLine>> held_;  // of each stream
  std::deque<FeedLine> ready_;
};

/// The files of a scenario's folder, merged by time. A malformed line is an Error naming file, line and reason.
class FolderFeed : public LiveFeed {
 public:
  /// Throws Error when a file is not there.
  explicit FolderFeed(const Scenario& settings);

 protected:
  std::optional<FeedLine> read() override;
  std::size_t rows(std::size_t stream, std::size_t held) const override { return rows_[stream] - held; }
  void skip(std::size_t stream, std::size_t rows) override;

 private:
  void advance(std::size_t stream);

  std::vector<std::unique_ptr<RowFile>> files_;
  std::vector<std::optional<FeedLine>> heads_;  // the next line of each
  std::vector<std::size_t> rows_;               // of each that read() has given
};

/// A sensor of a scenario's folder all of whose stamps, by the first and the last line of its file, are before or after those
/// of what the chaser moves by: a sentence, or nothing. Takes no longer for long files.
std::string spans_apart(const Scenario& settings);

/// Lines "NAME,<the row of that sensor's csv>" out of a file descriptor, as they come; chaser poses are
/// "odometry,t,x,y,z,qx,qy,qz,qw". Empty lines and those that begin with # are passed over. A malformed line is told to
/// `complain` (one sentence with its number), counted and left out.
class StreamFeed : public LiveFeed {
 public:
  /// `stop`, once set, ends the feed, also while it waits.
  StreamFeed(const Scenario& settings, int descriptor, std::string name, const std::atomic<bool>& stop,
             std::function<void(const std::string&)> complain);
  /// The same out of whatever `more` appends to what it is given, until it returns false.
  using Source = std::function<bool(std::string&)>;
  StreamFeed(const Scenario& settings, Source more, std::string name, const std::atomic<bool>& stop,
             std::function<void(const std::string&)> complain);

 protected:
  std::optional<FeedLine> read() override;

 private:
  bool read_line();
  bool fill();
  std::optional<FeedLine> parsed(std::string_view line);

  Source more_;
  std::string name_;
  const std::atomic<bool>& stop_;
  std::function<void(const std::string&)> complain_;
  std::map<std::string, std::size_t, std::less<>> by_name_;
  std::string buffer_, line_;
  std::size_t taken_ = 0;  // of the buffer
  bool ended_ = false, too_long_ = false;
  std::size_t number_ = 0;
};

}  // namespace tandem
