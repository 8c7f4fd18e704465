#include <cmath>
#include <sstream>

#include <tandem/studies/scenario/sensor_rows.hpp>
#include <tandem/studies/scenario/table.hpp>

#include "fuzz/input.hpp"

// A trajectory in the TUM format.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tandem;
  fuzz::Input input(data, size);
  fuzz::accepts([&] {
    RowFile rows(std::make_unique<std::istringstream>(input.text()), "chaser_odometry.tum", RowFormat::tum(),
                 TimeOrder::repeating);
    const Table table = read_table(rows);
    for (const double value : table.values) fuzz::expect(std::isfinite(value), "numbers are finite");
    const auto trajectory = poses(table);
    fuzz::expect(trajectory.size() <= table.rows(), "a line has at most one pose");
    for (std::size_t i = 0; i < trajectory.size(); ++i) {
      fuzz::expect(i == 0 || trajectory[i - 1].t < trajectory[i].t, "times increase");
      fuzz::expect(std::abs(trajectory[i].value.rotation().matrix().determinant() - 1) < 1e-6,
                   "rotations have determinant 1");
      for (const bool planar : {false, true}) internal_pose(trajectory[i].value, Frame::ned_frd(), planar);
    }
  });
  return 0;
}
