#pragma once

#include <array>
#include <filesystem>
#include <memory>

namespace tandem {

/// A point on the Earth (WGS 84): latitude and longitude [deg], height above the ellipsoid [m].
struct GeographicPoint {
  double latitude = 0, longitude = 0, height = 0;
};

/// A local frame whose origin is a point on the Earth: east, north and up along the axes at the origin.
class LocalFrame {
 public:
  /// Throws Error if Tandem was built without GeographicLib.
  explicit LocalFrame(const GeographicPoint& origin);
  ~LocalFrame();
  LocalFrame(LocalFrame&&) noexcept;

  /// Return east, north, up [m] of a point, and the point of such coordinates.
  std::array<double, 3> local(const GeographicPoint& point) const;
  GeographicPoint geographic(const std::array<double, 3>& east_north_up) const;
  const GeographicPoint& origin() const { return origin_; }

 private:
  struct Projection;
  GeographicPoint origin_;
  std::unique_ptr<Projection> projection_;
};

/// Returns the magnetic declination [deg], east positive, by a model file of GeographicLib (for example
/// /usr/share/GeographicLib/magnetic/wmm2020.wmm) at a point and a time [s since 1970]. Throws Error if the model
/// cannot be read, is not valid at that time, or if Tandem was built without GeographicLib.
double magnetic_declination(const std::filesystem::path& model, const GeographicPoint& point, double t);

}  // namespace tandem
