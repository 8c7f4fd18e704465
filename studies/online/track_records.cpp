#include <cmath>
#include <limits>

#include <tandem/lie/error.hpp>
#include <tandem/studies/online/track_records.hpp>
#include <tandem/studies/support/input_file.hpp>

namespace tandem {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Appends values to a buffer; an absent value becomes NaN.
class Writer {
 public:
  explicit Writer(std::vector<double>& out) : out_(out) { out_.clear(); }
  void operator()(double value) { out_.push_back(value); }
  void operator()(const Vector<3>& v) { out_.insert(out_.end(), v.data(), v.data() + 3); }
  void operator()(const SO3& R) {
    const auto q = R.quaternion().coeffs();
    out_.insert(out_.end(), q.data(), q.data() + 4);
  }
  void operator()(const Matrix<3, 3>& M) { out_.insert(out_.end(), M.data(), M.data() + 9); }
  void operator()(const std::optional<Matrix<3, 3>>& M) { (*this)(M.value_or(Matrix<3, 3>::Constant(kNone))); }
  void operator()(const std::optional<RelativeTarget>& r) {
    (*this)(r ? std::optional(r->position) : std::nullopt);
    (*this)(r ? r->covariance : std::nullopt);
  }
  void operator()(const std::optional<double>& value) { (*this)(value.value_or(kNone)); }
  void operator()(const std::optional<Vector<3>>& v) { (*this)(v.value_or(Vector<3>::Constant(kNone))); }
  void operator()(const std::optional<SO3>& R) {
    if (R)
      (*this)(*R);
    else
      out_.insert(out_.end(), 4, kNone);
  }

 private:
  std::vector<double>& out_;
};

class Reader {
 public:
  explicit Reader(const std::vector<double>& in) : in_(in.data()) {}
  void operator()(double& value) { value = *in_++; }
  void operator()(Vector<3>& v) {
    v = Vector<3>(in_);
    in_ += 3;
  }
  void operator()(SO3& R) {
    R = SO3(SO3::Quaternion(Eigen::Vector4d(in_)));
    in_ += 4;
  }
  void operator()(Matrix<3, 3>& M) {
    M = Matrix<3, 3>(in_);
    in_ += 9;
  }
  void operator()(RelativeTarget& r) {
    (*this)(r.position);
    (*this)(r.covariance);
  }
  template <class T>
  void operator()(std::optional<T>& value) {
    constexpr int n = std::same_as<T, double>           ? 1
                      : std::same_as<T, SO3>            ? 4
                      : std::same_as<T, Matrix<3, 3>>   ? 9
                      : std::same_as<T, RelativeTarget> ? 12
                                                        : 3;
    if (std::isnan(*in_)) {
      value.reset();
      in_ += n;
    } else {
      (*this)(value.emplace());
    }
  }

 private:
  const double* in_;
};

/// Visits the fields that Writer and Reader handle alike, in the order of the file.
template <class Fields, class Record>
void each_field(Fields& f, Record& r) {
  f(r.t);
  f(r.seconds);
  f(r.processor_seconds);
  f(r.memory);
  f(r.chaser_velocity);
  f(r.chaser_sigma);
  f(r.chaser_rotation_sigma);
  f(r.target_velocity);
  f(r.covariance);
  f(r.measured);
  f(r.measured_rotation);
  for (auto& position : r.ahead) f(position);
}

void pack(const TrackRecord& r, std::vector<double>& buffer) {
  Writer write(buffer);
  each_field(write, r);
  write(double(r.type));
  write(double(r.new_keyframe));
  write(double(r.keyframes));
  write(double(r.health.converged));
  write(double(r.health.resets));
  write(double(r.health.suspensions));
  for (const OutputHealth& output : {r.health.chaser, r.health.target}) {
    write(double(output.state));
    write(output.age);
    write(double(output.confirmed));
  }
  for (const SensorRecord& sensor : r.health.sensors) {
    write(double(sensor.used));
    write(double(sensor.rejected));
    write(sensor.sigmas);
    write(sensor.age);
  }
  write(r.chaser.rotation());
  write(r.chaser.translation());
  write(r.target ? std::optional(r.target->position) : std::nullopt);
  write(r.target ? r.target->rotation : std::nullopt);
}

}  // namespace

std::vector<std::string> sensor_names(const TrackHealth& health) {
  std::vector<std::string> names;
  for (const SensorHealth& sensor : health.sensors) names.push_back(sensor.name);
  return names;
}

std::string bytes_of(const TrackRecord& record) {
  std::vector<double> buffer;
  pack(record, buffer);
  return {reinterpret_cast<const char*>(buffer.data()), buffer.size() * sizeof(double)};
}

std::size_t record_bytes(std::size_t ahead, std::size_t sensors) {
  TrackRecord record{};
  record.ahead.resize(ahead);
  record.health.sensors.resize(sensors);
  return bytes_of(record).size();
}

TrackRecords::TrackRecords(std::size_t ahead) : ahead_(ahead), file_(std::tmpfile()) {
  if (!file_) throw Error("cannot create a temporary file for the records of the track; is the disk full?");
}

void TrackRecords::add(const TrackRecord& r) {
  pack(r, buffer_);
  write();
  sensors_ = r.health.sensors.size();
}

void TrackRecords::write() {
  if (std::fwrite(buffer_.data(), sizeof(double), buffer_.size(), file_.get()) != buffer_.size())
    throw Error("cannot write the temporary file of the track's records; is the disk full?");
  ++size_;
}

void TrackRecords::load(const std::filesystem::path& file, std::size_t n, std::size_t sensors) {
  InputFile stream(file);
  buffer_.resize(record_bytes(ahead_, sensors) / sizeof(double));
  sensors_ = sensors;
  for (std::size_t i = 0; i < n; ++i) {
    const auto bytes = std::streamsize(buffer_.size() * sizeof(double));
    if (!stream.read(reinterpret_cast<char*>(buffer_.data()), bytes))
      throw Error(file.string() + " has fewer records than the snapshot states; remove the snapshot to start afresh");
    write();
  }
}

void TrackRecords::each(const std::function<void(const TrackRecord&)>& f) const {
  std::rewind(file_.get());
  std::vector<double> buffer(buffer_.size());
  TrackRecord r{};
  for (std::size_t i = 0; i < size_; ++i) {
    if (std::fread(buffer.data(), sizeof(double), buffer.size(), file_.get()) != buffer.size())
      throw Error("cannot read the temporary file of the track's records");
    Reader read(buffer);
    r.ahead.resize(ahead_);
    each_field(read, r);
    const auto number = [&] {
      double value = 0;
      read(value);
      return value;
    };
    /// Returns an integer from 0 to `most`. The records of an earlier track come from a file.
    const auto whole = [&](double most) {
      const double value = number();
      if (!(value >= 0 && value <= most)) throw Error("the records of the track are damaged; remove the snapshot");
      return std::size_t(value);
    };
    constexpr double kMaxCount = 1e15;
    r.type = KeyframeType(whole(double(keyframe_types.size() - 1)));
    r.new_keyframe = number() != 0;
    r.keyframes = whole(kMaxCount);
    r.health.converged = number() != 0;
    r.health.resets = whole(kMaxCount);
    r.health.suspensions = whole(kMaxCount);
    for (OutputHealth* output : {&r.health.chaser, &r.health.target})
      *output = {OutputState(whole(double(OutputState::unconfirmed))), number(), number() != 0};
    r.health.sensors.resize(sensors_);
    for (SensorRecord& sensor : r.health.sensors) {
      sensor.used = whole(kMaxCount);
      sensor.rejected = whole(kMaxCount);
      read(sensor.sigmas);
      read(sensor.age);
    }
    SO3 rotation;
    Vector<3> translation;
    read(rotation);
    read(translation);
    r.chaser = SE3(rotation, translation);
    std::optional<Vector<3>> position;
    std::optional<SO3> facing;
    read(position);
    read(facing);
    r.target.reset();
    if (position) {
      r.target.emplace(*position);
      r.target->rotation = facing;
    }
    f(r);
  }
}

}  // namespace tandem
