#include <tandem/residuals/bearing.hpp>
#include <tandem/residuals/log_range.hpp>
#include <tandem/residuals/range.hpp>
#include <tandem/residuals/range_bearing.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/residuals/usbl_spherical.hpp>

#include "residual_family.hpp"

namespace tandem::python {

void bind_sightings(py::module_& m) {
  declare<UsblPosition<SE3, SE3>, UsblPosition<SE3, R3>, UsblPosition<SE2, SE2>, UsblPosition<SE2, R2>>(
      m, "UsblPosition", {"z", "B", "beacon"}, 1,
      "UsblPosition(z, B=identity, beacon=0)\n\nMeasured position of the target in the sensor's frame [m]: "
      "t((C B)^-1 (T F)) - z. States: chaser pose, target pose or point.");
  declare<UsblSpherical<SE3, SE3>, UsblSpherical<SE3, R3>>(
      m, "UsblSpherical", {"range", "azimuth", "elevation", "B", "beacon"}, 3,
      "UsblSpherical(range, azimuth, elevation, B=identity, beacon=0)\n\nMeasured range [m], azimuth and elevation "
      "[rad] of the target. States: chaser pose, target pose or point.");
  declare<Range<SE3, SE3>, Range<SE3, R3>, Range<SE2, SE2>, Range<SE2, R2>, Range<R3, R3>, Range<R2, R2>>(
      m, "Range", {"range", "B", "beacon"}, 1,
      "Range(range, B=identity, beacon=0)\n\nMeasured distance to the target [m]. States: chaser pose or point, target "
      "pose or point.");
  declare<LogRange<SE3, SE3>, LogRange<SE3, R3>, LogRange<SE2, SE2>, LogRange<SE2, R2>>(
      m, "LogRange", {"range", "B", "beacon"}, 1,
      "LogRange(range, B=identity, beacon=0)\n\nLogarithm of the distance to the target relative to `range` [m]: a "
      "prior for a distance of unknown size. States: chaser pose, target pose or point.");
  declare<Bearing<SE3, SE3>, Bearing<SE3, R3>, Bearing<SE2, SE2>, Bearing<SE2, R2>>(
      m, "Bearing", {"bearing", "B", "beacon"}, 1,
      "Bearing(bearing, B=identity, beacon=0)\n\nMeasured direction to the target as a vector of any length, in the "
      "sensor's frame [rad]. States: chaser pose, target pose or point.");
  declare<RangeBearing<SE3, SE3>, RangeBearing<SE3, R3>, RangeBearing<SE2, SE2>, RangeBearing<SE2, R2>>(
      m, "RangeBearing", {"range", "bearing", "B", "beacon"}, 2,
      "RangeBearing(range, bearing, B=identity, beacon=0)\n\nMeasured distance [m] and direction [rad] to the target. "
      "States: chaser pose, target pose or point.");
}

}  // namespace tandem::python
