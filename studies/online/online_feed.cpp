#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/online/online_feed.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/csv.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kLongestLine = 4096;
constexpr int kPollTimeout = 100;                            // ms between checks for a stop while waiting
constexpr double kMaxImuPeriod = 1, kMaxOdometryPeriod = 5;  // s
const std::string kWrongClock = "time jumps away from all other streams", kBackwards = "time runs backwards";

using Kind = FeedStream::Kind;

bool is_motion(const FeedStream& s) { return s.kind == Kind::odometry || s.kind == Kind::imu; }

std::vector<StreamClocks::Stream> clock_streams(const FeedStreams& streams) {
  const auto& all = streams.all();
  const bool moves = std::any_of(all.begin(), all.end(), is_motion);
  std::vector<StreamClocks::Stream> result;
  for (const FeedStream& s : all) {
    const bool motion = is_motion(s) || (!moves && s.kind == Kind::ego);
    result.push_back({s.name, s.may_repeat, motion, s.kind == Kind::imu ? kMaxImuPeriod : kMaxOdometryPeriod});
  }
  return result;
}

/// Returns a source that waits for input from a file descriptor.
StreamFeed::Source reader(int descriptor, const std::string& name, const std::atomic<bool>& stop) {
  return [descriptor, name, &stop](std::string& to) {
    std::array<char, 65536> chunk;
    while (!stop) {
      pollfd ready{descriptor, POLLIN, 0};
      const int n = poll(&ready, 1, kPollTimeout);
      if (n == 0 || (n < 0 && errno == EINTR)) continue;
      const ssize_t got = ::read(descriptor, chunk.data(), chunk.size());
      if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
      if (got < 0) throw Error(fmt::format("cannot read {}: {}", name, std::strerror(errno)));
      to.append(chunk.data(), std::size_t(got));
      return got > 0;
    }
    return false;
  };
}

/// Returns the smaller and the larger of a file's first and last stamps; nothing if it is empty or its first line
/// malformed.
std::optional<std::pair<double, double>> span_of(const FeedStream& stream) try {
  RowFile rows(stream.file, stream.of_file, TimeOrder::any);
  if (!rows.next()) return {};
  const double first = rows.row().front();
  double last = first;
  InputFile file(stream.file);
  file.seekg(0, std::ios::end);
  file.seekg(std::max(std::streamoff(0), std::streamoff(file.tellg()) - std::streamoff(kLongestLine)));
  RowFormat format = stream.of_file;
  for (std::string line; std::getline(file, line);) {
    try {
      last = format.parse(trimmed(line)).front();
    } catch (const Error&) {  // a header, or a line of which only the end was read
    }
  }
  return std::minmax({first, last});
} catch (const Error&) {  // the feed reports it when it reads the file
  return {};
}

std::string text_of(const std::pair<double, double>& span) {
  const bool few = std::max(std::abs(span.first), std::abs(span.second)) < 1e12;
  return few ? fmt::format("{:.3f} to {:.3f}", span.first, span.second)
             : fmt::format("{:.9g} to {:.9g}", span.first, span.second);
}

}  // namespace

std::string timestamp_overlap_warning(const Scenario& settings) {
  const FeedStreams streams(settings);
  if (streams.all().empty()) return "";
  const FeedStream& motion = streams.all().front();
  const auto moved = span_of(motion);
  for (const FeedStream& stream : streams.all()) {
    const auto span = moved ? span_of(stream) : std::nullopt;
    if (!span || (span->first <= moved->second && moved->first <= span->second)) continue;
    return fmt::format(
        "{}: its stamps ({}) do not overlap those of {} ({}); check that both use the same clock and unit",
        printable(stream.name), text_of(*span), printable(motion.name), text_of(*moved));
  }
  return "";
}

FeedStreams::FeedStreams(const Scenario& settings) : frame_(settings.frame), planar_(settings.data.planar) {
  const auto add = [&](Kind kind, std::size_t sensor, const std::string& name, const std::filesystem::path& file,
                       const std::string& columns, bool may_repeat, const std::vector<double>& missing = {}) {
    const RowFormat csv = RowFormat::csv(columns).with_missing_values();
    const RowFormat in_file = kind == Kind::odometry ? RowFormat::tum().with_missing_values() : csv;
    streams_.push_back({kind, sensor, name, file, in_file, csv, may_repeat, missing});
  };
  if (settings.files.odometry) add(Kind::odometry, 0, "odometry", *settings.files.odometry, pose_columns, false);
  if (settings.navigation) {
    const NavigationData& own = *settings.navigation;
    if (own.imu) add(Kind::imu, 0, own.imu->name, settings.files.imu.value(), imu_columns, false, own.imu->missing);
    for (std::size_t i = 0; i < own.sensors.size(); ++i) {
      ego_.push_back(own.sensors[i].type);
      add(Kind::ego, i, own.sensors[i].name, settings.files.ego[i], columns(ego_[i]), false, own.sensors[i].missing);
    }
  }
  for (const TargetSensor& sensor : settings.data.sensors) target_.push_back(sensor.type);
  for (const bool poses : {true, false})
    for (std::size_t i = 0; i < target_.size(); ++i)
      if (poses == (target_[i] == SensorType::pose))
        add(Kind::target, i, settings.data.sensors[i].name, settings.files.target[i], columns(target_[i], planar_),
            may_repeat_times(target_[i]), settings.data.sensors[i].missing);
}

FeedLine FeedStreams::line(std::size_t stream, const std::vector<double>& row) const {
  const FeedStream& from = streams_[stream];
  FeedLine line{row.front(), stream, false, {}};
  switch (from.kind) {
    case Kind::odometry:
      line.data = world_pose(row.data(), frame_, planar_);
      break;
    case Kind::imu:
      line.data = imu_sample(row.data(), frame_, from.missing);
      break;
    case Kind::ego:
      line.data = ego_measurement(ego_[from.sensor], row.data(), frame_, from.missing);
      break;
    case Kind::target:
      line.data = target_measurement(target_[from.sensor], row.data(), frame_, planar_, from.missing);
      break;
  }
  return line;
}

OnlineFeed::OnlineFeed(const Scenario& settings)
    : streams_(settings),
      clocks_(clock_streams(streams_)),
      held_(streams_.all().size()),
      disordered_(held_.size()),
      recent_(held_.size()) {
  clocks_.on_notice = [this](const std::string& sentence) {
    if (on_notice) on_notice(sentence);
  };
}

std::optional<FeedLine> OnlineFeed::next() {
  if (settling_.delay() == 0) return next_accepted();
  while (!settling_.is_ready()) {
    std::optional<FeedLine> line = next_accepted();
    if (!line) break;
    const FeedStream& from = streams_.all()[line->stream];
    if (!settling_.add(std::move(*line), is_motion(from))) rejected_.add(from.name, kBackwards);
  }
  return settling_.take();
}

std::optional<FeedLine> OnlineFeed::next_accepted() {
  while (ready_.empty()) {
    std::optional<FeedLine> line = read();
    if (line) {
      judge(std::move(*line));
    } else {
      clocks_.finish();
      if (waiting_.empty()) {
        for (auto& buffer : disordered_)
          while (auto late = buffer.take(true)) ready_.push_back(std::move(*late));
        if (!ready_.empty()) break;
        for (std::size_t i = 0; i < held_.size(); ++i) {
          if (!held_[i].empty()) rejected_.add(streams_.all()[i].name, kWrongClock, held_[i].size());
          held_[i].clear();
        }
        return {};
      }
    }
    while (clocks_.is_ready() && !waiting_.empty()) {
      FeedLine next = std::move(waiting_.front());
      waiting_.pop_front();
      judge(std::move(next));
    }
  }
  FeedLine line = std::move(ready_.front());
  ready_.pop_front();
  return line;
}

std::optional<FeedCheckpoint> OnlineFeed::checkpoint() const {
  if (!ready_.empty() || !waiting_.empty() || !settling_.empty() || !clocks_.is_ready()) return {};
  FeedCheckpoint checkpoint{{}, clocks_.checkpoint(), rejected_.counts()};
  for (std::size_t i = 0; i < held_.size(); ++i)
    checkpoint.rows.push_back(rows(i, held_[i].size() + disordered_[i].since_oldest()));
  return checkpoint;
}

void OnlineFeed::restore(const FeedCheckpoint& checkpoint) {
  for (std::size_t i = 0; i < checkpoint.rows.size(); ++i) skip(i, checkpoint.rows[i]);
  clocks_.restore(checkpoint.clocks);
  rejected_.restore(checkpoint.rejected_lines);
}

void OnlineFeed::judge(FeedLine line) {
  const std::size_t stream = line.stream;
  const std::string& name = streams_.all()[stream].name;
  const StreamClocks::Verdict verdict = clocks_.classify(stream, line.t);
  switch (verdict) {
    case StreamClocks::Verdict::wait:
      waiting_.push_back(std::move(line));
      return;
    case StreamClocks::Verdict::hold:
      held_[stream].push_back(std::move(line));
      break;
    case StreamClocks::Verdict::repeated:
      return rejected_.add(name, "repeats a time");
    case StreamClocks::Verdict::invalid:
      return rejected_.add(name, kWrongClock);
    case StreamClocks::Verdict::use:
      break;
  }
  for (const auto& [of, lines] : clocks_.dropped()) {
    held_[of].erase(held_[of].begin(), held_[of].begin() + std::ptrdiff_t(lines));
    rejected_.add(streams_.all()[of].name, kWrongClock, lines);
  }
  bool time_reset = clocks_.time_was_reset();
  if (verdict == StreamClocks::Verdict::use) make_ready(stream, std::move(line), std::exchange(time_reset, false));
  for (const std::size_t of : clocks_.released()) {
    for (FeedLine& held : held_[of]) make_ready(of, std::move(held), std::exchange(time_reset, false));
    held_[of].clear();
  }
}

void OnlineFeed::make_ready(std::size_t stream, FeedLine line, bool time_reset) {
  const FeedStream& from = streams_.all()[stream];
  line.t = clocks_.time(stream, line.t);
  line.time_reset = time_reset;
  std::visit([&](auto& data) { data.t = line.t; }, line.data);
  if (time_reset) {
    for (auto& buffer : disordered_) buffer = {};
    for (auto& recent : recent_) recent.clear();
  }
  const double t = line.t;
  if (!is_motion(from)) {
    if (is_repeated(stream, line)) return rejected_.add(from.name, "repeats an earlier line");
    ready_.push_back(std::move(line));
    return;
  }
  if (settling_.delay() > 0) return ready_.push_back(std::move(line));
  ReorderBuffer<FeedLine>& buffer = disordered_[stream];
  if (!buffer.add(t, std::move(line))) return rejected_.add(from.name, kBackwards);
  while (auto next = buffer.take()) ready_.push_back(std::move(*next));
}

/// Returns whether an earlier line had the same time and, if the times of the stream may repeat, the same numbers.
bool OnlineFeed::is_repeated(std::size_t stream, const FeedLine& line) {
  constexpr std::size_t kMostRecent = 4096;
  const FeedStream& from = streams_.all()[stream];
  std::size_t hash = 0;
  if (from.may_repeat) {
    const auto& m = std::get<Measurement>(line.data);
    for (const double x : {m.position.x(), m.position.y(), m.position.z(), m.range, m.azimuth, m.elevation, m.height})
      hash = 31 * hash + std::hash<double>()(x);
  }
  auto& recent = recent_[stream];
  const auto [first, last] = recent.equal_range(line.t);
  if (std::any_of(first, last, [&](const auto& known) { return known.second == hash; })) return true;
  recent.emplace(line.t, hash);
  if (recent.size() > kMostRecent) recent.erase(recent.begin());
  return false;
}

FolderFeed::FolderFeed(const Scenario& settings) : OnlineFeed(settings) {
  for (const FeedStream& stream : streams_.all())
    files_.push_back(std::make_unique<RowFile>(stream.file, stream.of_file, TimeOrder::any));
  heads_.resize(files_.size());
  rows_.resize(files_.size());
  for (std::size_t i = 0; i < files_.size(); ++i) advance(i);
}

void FolderFeed::advance(std::size_t stream) {
  RowFile& file = *files_[stream];
  heads_[stream].reset();
  if (!file.next()) return;
  heads_[stream] = with_location([&] { return file.where(); }, [&] { return streams_.line(stream, file.row()); });
}

std::optional<FeedLine> FolderFeed::read() {
  std::size_t first = heads_.size();
  for (std::size_t i = 0; i < heads_.size(); ++i)
    if (heads_[i] && (first == heads_.size() || heads_[i]->t < heads_[first]->t)) first = i;
  if (first == heads_.size()) return {};
  std::optional<FeedLine> line = std::move(heads_[first]);
  ++rows_[first];
  advance(first);
  return line;
}

void FolderFeed::skip(std::size_t stream, std::size_t rows) {
  for (; rows_[stream] < rows; ++rows_[stream]) {
    Stop(&interrupted()).check("reading " + files_[stream]->file().string());
    if (!heads_[stream])
      throw Error(fmt::format(
          "{} has only {} rows, but the snapshot was written after row {}; restore the file or remove the snapshot",
          files_[stream]->file().string(), rows_[stream], rows));
    advance(stream);
  }
}

StreamFeed::StreamFeed(const Scenario& settings, int descriptor, std::string name, const std::atomic<bool>& stop,
                       std::function<void(const std::string&)> warn)
    : StreamFeed(settings, reader(descriptor, name, stop), name, stop, std::move(warn)) {}

StreamFeed::StreamFeed(const Scenario& settings, Source more, std::string name, const std::atomic<bool>& stop,
                       std::function<void(const std::string&)> warn)
    : OnlineFeed(settings), more_(std::move(more)), name_(std::move(name)), stop_(stop), warn_(std::move(warn)) {
  for (std::size_t i = 0; i < streams_.all().size(); ++i) {
    const FeedStream& stream = streams_.all()[i];
    if (!by_name_.emplace(stream.name, i).second)
      throw Error(fmt::format("two sensors are named {}; sensors of a stream need distinct names", stream.name));
  }
}

bool StreamFeed::fill() {
  buffer_.erase(0, std::exchange(taken_, 0));
  return more_(buffer_);
}

/// Reads the next line into line_, cut after kLongestLine characters; returns false at the end of the input.
bool StreamFeed::read_line() {
  line_.clear();
  too_long_ = false;
  while (!stop_) {
    const std::size_t end = buffer_.find('\n', taken_);
    const std::size_t to = std::min(end, buffer_.size());
    line_.append(buffer_, taken_, std::min(to - taken_, kLongestLine - line_.size()));
    too_long_ |= line_.size() == kLongestLine;
    taken_ = end == std::string::npos ? to : end + 1;
    if (end != std::string::npos) {
      ++number_;
      return true;
    }
    if (!ended_) ended_ = !fill();
    if (ended_ && taken_ >= buffer_.size()) {
      ++number_;
      return !line_.empty();
    }
  }
  return false;
}

std::optional<FeedLine> StreamFeed::parsed(std::string_view line) {
  const auto [name, row] = csv_first_cell(line);
  std::string sensor = "unknown";
  try {
    const auto stream = by_name_.find(name);
    if (stream == by_name_.end()) {
      std::vector<std::string> known;
      for (const auto& [word, i] : by_name_) known.push_back(word);
      throw Error(fmt::format("unknown sensor {}{} (the scenario has {})", quote(name), did_you_mean(name, known),
                              listed(known)));
    }
    sensor = stream->first;
    if (too_long_) throw Error(fmt::format("the line is longer than {} characters", kLongestLine));
    RowFormat& format = streams_.all()[stream->second].of_stream;
    return streams_.line(stream->second, format.parse(row.value_or(std::string_view())));
  } catch (const Error& error) {
    warn_(fmt::format("{}:{}: {}", name_, number_, error.what()));
    rejected_.add(sensor, "malformed");
    return {};
  }
}

std::optional<FeedLine> StreamFeed::read() {
  while (read_line()) {
    const std::string_view line = trimmed(line_);
    if (line.empty() || line.front() == '#') continue;
    if (auto parsed_line = parsed(line)) return parsed_line;
  }
  return {};
}

}  // namespace tandem
