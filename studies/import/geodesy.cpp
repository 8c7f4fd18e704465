#include <cmath>
#include <exception>

#include <fmt/format.h>
#ifdef TANDEM_HAS_GEOGRAPHICLIB
#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/MagneticModel.hpp>
#endif

#include <tandem/lie/error.hpp>
#include <tandem/studies/import/geodesy.hpp>

namespace tandem {

#ifdef TANDEM_HAS_GEOGRAPHICLIB

struct LocalFrame::Projection {
  GeographicLib::LocalCartesian cartesian;
};

LocalFrame::LocalFrame(const GeographicPoint& origin) : origin_(origin) {
  if (!(std::abs(origin.latitude) <= 90))
    throw Error(fmt::format("the latitude {:g} of the origin is outside [-90, 90] degrees", origin.latitude));
  projection_ = std::make_unique<Projection>(
      Projection{GeographicLib::LocalCartesian(origin.latitude, origin.longitude, origin.height)});
}

std::array<double, 3> LocalFrame::local(const GeographicPoint& point) const {
  std::array<double, 3> p{};
  projection_->cartesian.Forward(point.latitude, point.longitude, point.height, p[0], p[1], p[2]);
  return p;
}

GeographicPoint LocalFrame::geographic(const std::array<double, 3>& p) const {
  GeographicPoint point;
  projection_->cartesian.Reverse(p[0], p[1], p[2], point.latitude, point.longitude, point.height);
  return point;
}

double magnetic_declination(const std::filesystem::path& file, const GeographicPoint& point, double t) {
  const double year = 1970 + t / (365.2425 * 86400);
  try {
    const GeographicLib::MagneticModel model(file.stem().string(), file.parent_path().string());
    if (year < model.MinTime() || year > model.MaxTime())
      throw Error(fmt::format("{}: the model is valid from {:g} to {:g}, not in {:.1f}; use another model",
                              file.string(), model.MinTime(), model.MaxTime(), year));
    double east = 0, north = 0, up = 0, horizontal = 0, total = 0, declination = 0, inclination = 0;
    model(year, point.latitude, point.longitude, point.height, east, north, up);
    GeographicLib::MagneticModel::FieldComponents(east, north, up, horizontal, total, declination, inclination);
    return declination;
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(fmt::format("{}: cannot read the magnetic model ({}); give the path of a .wmm file, or `declination`",
                            file.string(), error.what()));
  }
}

#else

namespace {

[[noreturn]] void not_built() {
  throw Error(
      "latitudes, longitudes and magnetic models need GeographicLib, but Tandem was built without it: install "
      "libgeographiclib-dev (Debian 12 and 13) and build again");
}

}  // namespace

struct LocalFrame::Projection {};
LocalFrame::LocalFrame(const GeographicPoint&) { not_built(); }
std::array<double, 3> LocalFrame::local(const GeographicPoint&) const { not_built(); }
GeographicPoint LocalFrame::geographic(const std::array<double, 3>&) const { not_built(); }
double magnetic_declination(const std::filesystem::path&, const GeographicPoint&, double) { not_built(); }

#endif

LocalFrame::~LocalFrame() = default;
LocalFrame::LocalFrame(LocalFrame&&) noexcept = default;

}  // namespace tandem
