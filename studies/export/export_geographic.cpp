#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/export/export_formats.hpp>
#include <tandem/studies/recording/recorded_time.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/utc_stamps.hpp>

namespace tandem {
namespace {

/// Converts positions to latitude, longitude and height.
class GeographicExport {
 public:
  GeographicExport(const ExportedRun& run, const char* format)
      : ned_(run.ned),
        frame_(run.origin ? *run.origin
                          : throw Error(fmt::format("{} needs the place of the local frame; give --origin "
                                                    "LATITUDE,LONGITUDE, or `origin` in scenario.yaml",
                                                    format))) {}
  GeographicPoint operator()(const ExportedPose& pose) const {
    const auto& p = pose.position;
    return frame_.geographic(ned_ ? std::array{p[1], p[0], -p[2]} : p);
  }

 private:
  bool ned_;
  LocalFrame frame_;
};

}  // namespace

std::vector<std::string> export_geojson(const ExportedRun& run, const std::filesystem::path& folder) {
  const GeographicExport geographic(run, "geojson");
  for (const ExportedTrajectory& trajectory : run.trajectories) {
    std::string points, times;
    for (const ExportedPose& pose : trajectory.poses) {
      const GeographicPoint g = geographic(pose);
      points += fmt::format("{}[{:.9f},{:.9f},{:.3f}]", points.empty() ? "" : ",\n", g.longitude, g.latitude, g.height);
      times += fmt::format("{}{}", times.empty() ? "" : ",", pose.t);
    }
    write_file(folder / (trajectory.name + ".geojson"),
               fmt::format("{{\"type\":\"Feature\",\"properties\":{{\"name\":\"{}\",\"times\":[{}]}},\"geometry\":"
                           "{{\"type\":\"LineString\",\"coordinates\":[\n{}\n]}}}}\n",
                           trajectory.name, times, points));
  }
  return {};
}

std::vector<std::string> export_kml(const ExportedRun& run, const std::filesystem::path& folder) {
  const GeographicExport geographic(run, "kml");
  for (const ExportedTrajectory& trajectory : run.trajectories) {
    std::string text = fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\" "
        "xmlns:gx=\"http://www.google.com/kml/ext/2.2\">\n<Document><name>{0}</name><Placemark><name>{0}</name>\n"
        "<gx:Track><altitudeMode>absolute</altitudeMode>\n",
        trajectory.name);
    for (const ExportedPose& pose : trajectory.poses)
      text += fmt::format("<when>{}</when>\n", utc_text(pose.t > kSince1970 ? pose.t : pose.t + kGpsEpoch));
    for (const ExportedPose& pose : trajectory.poses) {
      const GeographicPoint g = geographic(pose);
      text += fmt::format("<gx:coord>{:.9f} {:.9f} {:.3f}</gx:coord>\n", g.longitude, g.latitude, g.height);
    }
    write_file(folder / (trajectory.name + ".kml"), text + "</gx:Track></Placemark></Document></kml>\n");
  }
  return {};
}

}  // namespace tandem
