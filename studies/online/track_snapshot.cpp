#include <bit>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/lie/error.hpp>
#include <tandem/studies/online/track_snapshot.hpp>
#include <tandem/studies/support/fnv1a.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

using Packed = nlohmann::json;

// A file consists of a line with this text and the version, a line with the checksum of the rest, and a CBOR document.
constexpr std::string_view kKind = "tandem track snapshot ";
constexpr std::string_view kVersion = "4\n";
constexpr std::size_t kDigits = 16;  // hexadecimal digits of the checksum; a line end follows

// The checksum detects truncation and bit errors, not deliberate changes.
std::string header(std::string_view bytes) { return fmt::format("{}{}{:016x}\n", kKind, kVersion, fnv1a(bytes)); }

// The functions below visit the fields of a type. The visitor `Write` packs them, `Read` unpacks them.

class Write {
 public:
  explicit Write(Packed& out) : out_(out) { out_ = Packed::array(); }
  template <class T>
  void operator()(const T& value) {
    if constexpr (std::is_enum_v<T>)
      out_.push_back(int(value));
    else
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
    if constexpr (std::is_enum_v<T>)
      value = T(next().get<int>());
    else
      value = next().get<T>();
  }
  void operator()(std::optional<double>& value) {
    const Packed& packed = next();
    value = packed.is_null() ? std::nullopt : std::optional(packed.get<double>());
  }
  template <int N>
  void operator()(Vector<N>& v) {
    const auto numbers = next().get<std::array<double, std::size_t(N)>>();
    v = Vector<N>(numbers.data());
  }
  void operator()(SO3& R) {
    Vector<4> q;
    (*this)(q);
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
  }
  return snapshot;
}

std::optional<TrackSnapshot> read_snapshot(const std::filesystem::path& file, const Scenario& settings) {
  std::error_code error;
  if (!std::filesystem::exists(std::filesystem::symlink_status(file, error))) return {};
  TrackSnapshot snapshot = parse_snapshot(read_text(file), file.string());
  const std::vector<std::string> here = streams_of(settings, FeedStreams(settings));
  if (snapshot.scenario != settings.name || snapshot.streams != here)
    throw Error(fmt::format("{} is a snapshot of {} with {}, not of {} with {}; use the scenario of the snapshot",
                            file.string(), quote(snapshot.scenario), listed(snapshot.streams), quote(settings.name),
                            listed(here)));
  return snapshot;
}

}  // namespace tandem
