#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <concepts>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/lie/error.hpp>
#include <tandem/studies/online/track.hpp>
#include <tandem/studies/online/track_snapshot.hpp>
#include <tandem/studies/online/watched_sensors.hpp>
#include <tandem/studies/support/fnv1a.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

using Packed = nlohmann::json;

// A file consists of a line with this text and the version, a line with the checksum of the rest, and a CBOR document.
constexpr std::string_view kKind = "tandem track snapshot ";
constexpr std::string_view kVersion = "7\n";
constexpr std::size_t kDigits = 16;  // hexadecimal digits of the checksum; a line end follows

// The checksum detects truncation and bit errors, not deliberate changes.
std::string header(std::string_view bytes) { return fmt::format("{}{}{:016x}\n", kKind, kVersion, fnv1a(bytes)); }

// The functions below visit the fields of a type. The visitor `Write` packs them, `Read` unpacks them.

class Write {
 public:
  explicit Write(Packed& out) : out_(out) { out_ = Packed::array(); }
  template <class T>
  void operator()(const T& value) {
    out_.push_back(value);
  }
  void operator()(const std::optional<double>& value) { out_.push_back(value ? Packed(*value) : Packed()); }
  template <int N>
  void operator()(const Vector<N>& v) {
    out_.push_back(std::vector<double>(v.data(), v.data() + N));
  }
  void operator()(const SO3& R) { (*this)(Vector<4>(R.quaternion().coeffs())); }
  /// Packs a list whose items have fields.
  template <class T, class F>
  void each(const std::vector<T>& list, F fields) {
    Packed all = Packed::array();
    for (const T& item : list) {
      Write write(all.emplace_back());
      fields(write, item);
    }
    out_.push_back(std::move(all));
  }

 private:
  Packed& out_;
};

class Read {
 public:
  explicit Read(const Packed& in) : in_(in) {}
  template <class T>
  void operator()(T& value) {
    get(next(), value);
  }
  void operator()(std::optional<double>& value) {
    const Packed& packed = next();
    if (packed.is_null())
      value.reset();
    else
      get(packed, value.emplace());
  }
  template <int N>
  void operator()(Vector<N>& v) {
    std::array<double, std::size_t(N)> numbers;
    get(next(), numbers);
    v = Vector<N>(numbers.data());
    if (!v.allFinite()) throw invalid();
  }
  void operator()(SO3& R) {
    constexpr double kRounding = 1e-9;
    Vector<4> q;
    (*this)(q);
    if (!(std::abs(q.squaredNorm() - 1) < kRounding)) throw invalid();
    R = SO3(SO3::Quaternion(q));
  }
  template <class T, class F>
  void each(std::vector<T>& list, F fields) {
    for (const Packed& item : next()) {
      Read read(item);
      fields(read, list.emplace_back());
    }
  }

 private:
  const Packed& next() { return in_.at(n_++); }
  static Error invalid() { return Error("a value is out of range"); }

  // The functions below convert a value. The library converts any number and truth value to any other number; the
  // conversion of a number that is out of range is undefined.
  static void get(const Packed& packed, std::string& value) { value = packed.get<std::string>(); }
  static void get(const Packed& packed, bool& value) { value = packed.get<bool>(); }
  static void get(const Packed& packed, double& value) {
    if (!packed.is_number()) throw invalid();
    value = packed.get<double>();
    if (std::isnan(value)) throw invalid();
  }
  template <std::integral T>
  static void get(const Packed& packed, T& value) {
    if (!packed.is_number_unsigned() || packed.get<std::uint64_t>() > std::uint64_t(std::numeric_limits<T>::max()))
      throw invalid();
    value = packed.get<T>();
  }
  template <class T>
  static void get(const Packed& packed, std::vector<T>& list) {
    if (!packed.is_array()) throw invalid();
    for (const Packed& item : packed) get(item, list.emplace_back());
  }
  template <class T, std::size_t N>
  static void get(const Packed& packed, std::array<T, N>& list) {
    if (!packed.is_array() || packed.size() != N) throw invalid();
    for (std::size_t i = 0; i < N; ++i) get(packed[i], list[i]);
  }
  static void get(const Packed& packed, RejectedLines::Counts& counts) {
    for (const Packed& item : packed) {
      std::pair<std::string, std::string> key;
      get(item.at(0).at(0), key.first);
      get(item.at(0).at(1), key.second);
      get(item.at(1), counts[key]);
    }
  }

  const Packed& in_;
  std::size_t n_ = 0;
};

template <class F, class Pose>
void pose_fields(F& f, Pose& pose) {
  SO3 rotation = pose.rotation();
  Vector<3> translation = pose.translation();
  f(rotation);
  f(translation);
  if constexpr (!std::is_const_v<Pose>) pose = SE3(rotation, translation);
}

template <class F, class Line>
void line_fields(F& f, Line& line) {
  f(line.t);
  f(line.stream);
  f(line.time_reset);
  std::size_t kind = line.data.index();
  f(kind);
  if constexpr (!std::is_const_v<Line>) {
    if (kind == 0)
      line.data.template emplace<0>();
    else if (kind == 1)
      line.data.template emplace<1>();
    else if (kind == 2)
      line.data.template emplace<2>();
    else
      line.data.template emplace<3>();
  }
  std::visit(
      [&]<class D>(D& data) {
        using Data = std::remove_const_t<D>;
        if constexpr (!std::is_const_v<D>) data.t = line.t;
        if constexpr (std::same_as<Data, Stamped<SE3>>) {
          pose_fields(f, data.value);
        } else if constexpr (std::same_as<Data, ImuSample>) {
          f(data.specific_force);
          f(data.angular_rate);
        } else if constexpr (std::same_as<Data, EgoMeasurement>) {
          f(data.value);
          f(data.rotation);
        } else {
          f(data.position);
          f(data.rotation);
          f(data.range);
          f(data.azimuth);
          f(data.elevation);
          f(data.height);
        }
      },
      line.data);
}

/// Visits an optional value as a list of one or no item.
template <class F, class T, class Fields>
void optional_field(F& f, T& value, Fields fields) {
  using Value = typename std::remove_const_t<T>::value_type;
  std::vector<Value> list;
  if constexpr (std::is_const_v<T>) {
    if (value) list.push_back(*value);
    f.each(std::as_const(list), fields);
  } else {
    f.each(list, fields);
    if (!list.empty()) value = list.front();
  }
}

template <class F, class Start>
void start_fields(F& f, Start& start) {
  f(start.t);
  pose_fields(f, start.state.pose);
  f(start.state.velocity);
  f(start.state.bias);
  f(start.sigmas.position);
  f(start.sigmas.rotation);
  f(start.sigmas.velocity);
  optional_field(f, start.sigmas.bias, [](auto& g, auto& bias) { g(bias); });
}

template <class F, class Clock>
void clock_fields(F& f, Clock& clock) {
  f(clock.unit);
  f(clock.offset);
  f(clock.last);
  f(clock.period);
  f(clock.lag);
  f(clock.agreeing);
}

template <class F, class Sensor>
void sensor_fields(F& f, Sensor& sensor) {
  f(sensor.name);
  f(sensor.used);
  f(sensor.rejected);
  f(sensor.rejected_in_a_row);
  f(sensor.last_received);
  f(sensor.last_used);
  f(sensor.sigmas);
  f(sensor.nis);
  f(sensor.nis_rows);
  f(sensor.down_weighted);
  f(sensor.expected_down_weighted);
  f.each(sensor.innovations, [](auto& g, auto& moments) {
    g(moments.n);
    for (auto* value : {&moments.sum, &moments.squares, &moments.products, &moments.first, &moments.last}) g(*value);
  });
  f.each(sensor.worst, [](auto& g, auto& worst) {
    g(worst.t);
    g(worst.component);
    g(worst.residual);
  });
}

template <class F, class Health>
void health_fields(F& f, Health& health) {
  f.each(health.sensors, [](auto& g, auto& sensor) { sensor_fields(g, sensor); });
  f(health.resets);
  f(health.suspensions);
  f(health.converged);
  f(health.unconverged_since);
}

template <class F, class Interval>
void interval_fields(F& f, Interval& interval) {
  f(interval.since);
  f(interval.until);
  f(interval.ongoing);
}

template <class F, class Snapshot>
void snapshot_fields(F& f, Snapshot& s) {
  f(s.scenario);
  f(s.streams);
  f(s.t);
  pose_fields(f, s.chaser);
  optional_field(f, s.start, [](auto& g, auto& start) { start_fields(g, start); });
  f.each(s.lines, [](auto& g, auto& line) { line_fields(g, line); });
  f(s.feed.rows);
  f(s.feed.clocks.clock);
  f(s.feed.clocks.base);
  f.each(s.feed.clocks.streams, [](auto& g, auto& clock) { clock_fields(g, clock); });
  health_fields(f, s.health);
  optional_field(f, s.hypotheses, [](auto& g, auto& memory) {
    g(memory.t);
    g(memory.numbers);
  });
  f(s.faulty_intervals.used);
  f(s.faulty_intervals.rejected);
  f(s.faulty_intervals.rejecting);
  optional_field(f, s.faulty_intervals.now, [](auto& g, auto& interval) { interval_fields(g, interval); });
  optional_field(f, s.faulty_intervals.longest, [](auto& g, auto& interval) { interval_fields(g, interval); });
  f(s.num_lines);
  f(s.not_converged);
  f(s.first);
  f(s.last);
  f(s.seconds);
  f(s.rejected_lines);
  f(s.feed.rejected_lines);
  f(s.partial.run);
  f(s.partial.sizes);
  f(s.partial.records);
}

/// Returns whether the values are in the ranges that a track writes, as far as these do not depend on the scenario.
bool has_valid_values(const TrackSnapshot& s) {
  constexpr std::uintmax_t kMaxBytes = std::uintmax_t(1) << 50;
  const auto is_hexadecimal = [](char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; };
  for (const double t : {s.t, s.first, s.last, s.seconds})
    if (!std::isfinite(t)) return false;
  if (s.start && !std::isfinite(s.start->t)) return false;
  for (const FeedLine& line : s.lines)
    if (!std::isfinite(line.t)) return false;
  for (const StreamClocks::Clock& clock : s.feed.clocks.streams) {
    if (!(clock.unit > 0 && clock.period >= 0) || (clock.last && !std::isfinite(*clock.last))) return false;
    for (const double value : {clock.unit, clock.offset, clock.period, clock.lag})
      if (!std::isfinite(value)) return false;
  }
  // The name of the run is part of a file name.
  if (s.partial.run.size() > 16 || !std::all_of(s.partial.run.begin(), s.partial.run.end(), is_hexadecimal))
    return false;
  return s.partial.records <= kMaxBytes && std::all_of(s.partial.sizes.begin(), s.partial.sizes.end(),
                                                       [](std::uintmax_t size) { return size <= kMaxBytes; });
}

/// Returns whether lines and counts suit the streams of a scenario.
bool suits(const TrackSnapshot& s, const std::vector<FeedStream>& streams, const std::vector<std::string>& sensors) {
  if (s.feed.rows.size() != streams.size() || s.feed.clocks.streams.size() != streams.size()) return false;
  for (const FeedLine& line : s.lines)  // the kinds of streams are in the order of the kinds of lines
    if (line.stream >= streams.size() || line.data.index() != std::size_t(streams[line.stream].kind)) return false;
  return sensor_names(s.health) == sensors;
}

}  // namespace

std::vector<std::string> streams_of(const Scenario& settings, const FeedStreams& streams) {
  std::vector<std::string> all = {settings.frame.name()};
  for (const FeedStream& stream : streams.all())
    all.push_back(fmt::format("{} ({} columns)", stream.name, stream.of_stream.columns()));
  return all;
}

std::string bytes_of(const TrackSnapshot& snapshot) {
  Packed packed;
  Write write(packed);
  snapshot_fields(write, snapshot);
  std::string bytes;
  Packed::to_cbor(packed, bytes);
  return header(bytes) + bytes;
}

TrackSnapshot parse_snapshot(std::string_view bytes, const std::string& file) {
  if (!bytes.starts_with(kKind)) throw Error(file + " is not a snapshot of tandem track");
  const auto invalid = [&](const char* why) {
    return Error(file + ": " + why + "; move the file away to start a new track");
  };
  if (!bytes.substr(kKind.size()).starts_with(kVersion))
    throw invalid("the snapshot was written by another version of tandem");
  const std::string_view packed = bytes.substr(std::min(bytes.size(), kKind.size() + kVersion.size() + kDigits + 1));
  if (!bytes.starts_with(header(packed))) throw invalid("the snapshot is damaged (wrong checksum)");
  TrackSnapshot snapshot;
  try {
    const Packed contents = Packed::from_cbor(packed);
    Read read(contents);
    snapshot_fields(read, snapshot);
  } catch (const Packed::exception&) {
    throw invalid("the snapshot has invalid contents");
  } catch (const Error&) {
    throw invalid("the snapshot has invalid contents");
  }
  if (!has_valid_values(snapshot)) throw invalid("the snapshot has invalid contents");
  return snapshot;
}

std::optional<TrackSnapshot> read_snapshot(const std::filesystem::path& file, const Scenario& settings) {
  std::error_code error;
  if (!std::filesystem::exists(std::filesystem::symlink_status(file, error))) return {};
  TrackSnapshot snapshot = parse_snapshot(read_state(file), file.string());
  const FeedStreams streams(settings);
  const std::vector<std::string> here = streams_of(settings, streams);
  if (snapshot.scenario != settings.name || snapshot.streams != here)
    throw Error(fmt::format("{} is a snapshot of {} with {}, not of {} with {}; use the scenario of the snapshot",
                            file.string(), quote(snapshot.scenario), listed(snapshot.streams), quote(settings.name),
                            listed(here)));
  if (!suits(snapshot, streams.all(), names_of_watched_sensors(settings)))
    throw Error(file.string() + ": the snapshot has invalid contents; move the file away to start a new track");
  return snapshot;
}

}  // namespace tandem
