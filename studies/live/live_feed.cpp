#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/live/live_feed.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>
#include <tandem/studies/support/csv.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kLongestLine = 4096;
constexpr int kPatience = 100;  // ms between looks at whether to stop

using Kind = FeedStream::Kind;

/// Waits for more of a descriptor; false at its end.
StreamFeed::Source reader(int descriptor, const std::string& name, const std::atomic<bool>& stop) {
  return [descriptor, name, &stop](std::string& to) {
    std::array<char, 65536> chunk;
    while (!stop) {
      pollfd ready{descriptor, POLLIN, 0};
      const int n = poll(&ready, 1, kPatience);
      if (n == 0 || (n < 0 && errno == EINTR)) continue;
      const ssize_t got = ::read(descriptor, chunk.data(), chunk.size());
      if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
      if (got < 0) throw Error(fmt::format("{} cannot be read: {}", name, std::strerror(errno)));
      to.append(chunk.data(), std::size_t(got));
      return got > 0;
    }
    return false;
  };
}

}  // namespace

FeedStreams::FeedStreams(const Scenario& settings) : frame_(settings.frame), planar_(settings.data.planar) {
  const auto add = [&](Kind kind, std::size_t sensor, const std::string& name, const std::filesystem::path& file,
                       const std::string& columns, bool may_repeat) {
    const RowFormat csv = RowFormat::csv(columns);
    streams_.push_back({kind, sensor, name, file, kind == Kind::odometry ? RowFormat::tum() : csv, csv, may_repeat});
  };
  if (settings.files.odometry) add(Kind::odometry, 0, "odometry", *settings.files.odometry, pose_columns, false);
  if (settings.navigation) {
    const NavigationData& own = *settings.navigation;
    if (own.imu) add(Kind::imu, 0, own.imu->name, settings.files.imu.value(), imu_columns, false);
    for (std::size_t i = 0; i < own.sensors.size(); ++i) {
      ego_.push_back(own.sensors[i].type);
      add(Kind::ego, i, own.sensors[i].name, settings.files.ego[i], columns(ego_[i]), false);
    }
  }
  for (const TargetSensor& sensor : settings.data.sensors) target_.push_back(sensor.type);
  for (const bool poses : {true, false})
    for (std::size_t i = 0; i < target_.size(); ++i)
      if (poses == (target_[i] == SensorType::pose))
        add(Kind::target, i, settings.data.sensors[i].name, settings.files.target[i], columns(target_[i], planar_),
            may_repeat_times(target_[i]));
}

FeedLine FeedStreams::line(std::size_t stream, const std::vector<double>& row) const {
  const FeedStream& from = streams_[stream];
  FeedLine line{row.front(), stream, {}};
  switch (from.kind) {
    case Kind::odometry:
      line.data = world_pose(row.data(), frame_, planar_);
      break;
    case Kind::imu:
      line.data = imu_sample(row.data(), frame_);
      break;
    case Kind::ego:
      line.data = ego_measurement(ego_[from.sensor], row.data(), frame_);
      break;
    case Kind::target:
      line.data = target_measurement(target_[from.sensor], row.data(), frame_, planar_);
      break;
  }
  return line;
}

std::optional<FeedLine> LiveFeed::next() {
  while (auto line = read())
    if (in_order(*line)) return line;
  return {};
}

bool LiveFeed::in_order(const FeedLine& line) {
  const FeedStream& stream = streams_.all()[line.stream];
  std::optional<double>& last = last_[line.stream];
  if (last && line.t < *last) {
    refused_.add(stream.name, "time runs backwards");
    return false;
  }
  if (last && line.t == *last && !stream.may_repeat) {
    refused_.add(stream.name, "repeats a time");
    return false;
  }
  if (newest_ && line.t > *newest_ + kFarAhead && !(far_ahead_ && std::abs(line.t - *far_ahead_) < kFarAhead)) {
    far_ahead_ = line.t;  // a clock that jumped for one line, unless the next one says so too
    refused_.add(stream.name, "time is far ahead of all others");
    return false;
  }
  last = line.t;
  newest_ = std::max(newest_.value_or(line.t), line.t);
  return true;
}

FolderFeed::FolderFeed(const Scenario& settings) : LiveFeed(settings) {
  for (const FeedStream& stream : streams_.all())
    files_.push_back(std::make_unique<RowFile>(stream.file, stream.of_file, TimeOrder::any));
  heads_.resize(files_.size());
  for (std::size_t i = 0; i < files_.size(); ++i) advance(i);
}

void FolderFeed::advance(std::size_t stream) {
  RowFile& file = *files_[stream];
  heads_[stream].reset();
  if (!file.next()) return;
  heads_[stream] = located([&] { return file.where(); }, [&] { return streams_.line(stream, file.row()); });
}

std::optional<FeedLine> FolderFeed::read() {
  std::size_t first = heads_.size();
  for (std::size_t i = 0; i < heads_.size(); ++i)
    if (heads_[i] && (first == heads_.size() || heads_[i]->t < heads_[first]->t)) first = i;
  if (first == heads_.size()) return {};
  std::optional<FeedLine> line = std::move(heads_[first]);
  advance(first);
  return line;
}

StreamFeed::StreamFeed(const Scenario& settings, int descriptor, std::string name, const std::atomic<bool>& stop,
                       std::function<void(const std::string&)> complain)
    : StreamFeed(settings, reader(descriptor, name, stop), name, stop, std::move(complain)) {}

StreamFeed::StreamFeed(const Scenario& settings, Source more, std::string name, const std::atomic<bool>& stop,
                       std::function<void(const std::string&)> complain)
    : LiveFeed(settings), more_(std::move(more)), name_(std::move(name)), stop_(stop), complain_(std::move(complain)) {
  for (std::size_t i = 0; i < streams_.all().size(); ++i) {
    const FeedStream& stream = streams_.all()[i];
    if (!by_name_.emplace(stream.name, i).second)
      throw Error(fmt::format("two sensors are called {}: lines of a stream could not be told apart", stream.name));
  }
}

bool StreamFeed::fill() {
  buffer_.erase(0, std::exchange(taken_, 0));
  return more_(buffer_);
}

/// The next line into line_, cut where it is too long to be one.
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
      throw Error(fmt::format("unknown sensor {}{} (here: {})", quote(name), did_you_mean(name, known), listed(known)));
    }
    sensor = stream->first;
    if (too_long_) throw Error(fmt::format("the line is longer than {} characters", kLongestLine));
    RowFormat& format = streams_.all()[stream->second].of_stream;
    return streams_.line(stream->second, format.parse(row.value_or(std::string_view())));
  } catch (const Error& error) {
    complain_(fmt::format("{}:{}: {}", name_, number_, error.what()));
    refused_.add(sensor, "malformed");
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
