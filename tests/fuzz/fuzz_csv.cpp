#include <array>
#include <cmath>
#include <sstream>

#include <tandem/studies/scenario/sensor_rows.hpp>
#include <tandem/studies/scenario/table.hpp>

#include "fuzz/input.hpp"

namespace {

using namespace tandem;

const auto kTarget = sensor_types();
const auto kEgo = ego_sensor_types();
const std::size_t kImu = kTarget.size() + kEgo.size(), kKinds = kImu + 1;

std::string columns_of(std::size_t kind, bool planar) {
  if (kind < kTarget.size()) return columns(kTarget[kind], planar);
  return kind < kImu ? columns(kEgo[kind - kTarget.size()]) : imu_columns;
}

/// Returns whether all numbers are finite, or all are NaN, which marks a missing row.
bool is_finite_or_missing(const Vector<3>& x) { return x.allFinite() || x.array().isNaN().all(); }

/// Converts a row of any type of sensor to a measurement.
void read_row(std::size_t kind, const double* row, const Frame& frame, bool planar) {
  if (kind < kTarget.size()) {
    const Measurement m = target_measurement(kTarget[kind], row, frame, planar);
    fuzz::expect(m.t == row[0] && is_finite_or_missing(m.position), "a measurement is finite or missing");
  } else if (kind < kImu) {
    const EgoMeasurement m = ego_measurement(kEgo[kind - kTarget.size()], row, frame);
    fuzz::expect(m.t == row[0] && is_finite_or_missing(m.value),
                 "a measurement of a chaser sensor is finite or missing");
  } else {
    const ImuSample sample = imu_sample(row, frame);
    fuzz::expect(sample.t == row[0], "a sample has the time of its row");
  }
}

}  // namespace

// A sensor file. The first byte selects the sensor, the second one the order of times, the frame and the header.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const std::size_t kind = input.below(kKinds);
  const std::uint8_t flags = input.byte();
  // Scenarios of group SE2 reject sensors that exist only in 3D.
  const bool planar = flags & 1 && (kind >= kTarget.size() || kTarget[kind].place.in_plane), with_header = flags & 4;
  const Frame frame = flags & 2 ? Frame::ned_frd() : Frame::enu_flu();
  const auto order = std::array{TimeOrder::increasing, TimeOrder::repeating, TimeOrder::any}[flags / 8 % 3];
  const std::string names = columns_of(kind, planar);
  fuzz::accepts([&] {
    RowFile rows(std::make_unique<std::istringstream>((with_header ? names + "\n" : "") + input.text()), "sensor.csv",
                 RowFormat::csv(names), order);
    const Table table = read_table(rows);
    fuzz::expect(table.values.size() == table.rows() * table.columns, "a table is complete");
    for (std::size_t i = 0; i < table.rows(); ++i) {
      fuzz::expect(order == TimeOrder::any || i == 0 || table.t(i - 1) <= table.t(i), "times do not decrease");
      with_location([&] { return table.where(i); }, [&] { return read_row(kind, table.row(i), frame, planar), 0; });
    }
  });
  return 0;
}
