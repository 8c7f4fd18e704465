#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/export/export_formats.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

struct ExportRequest {
  std::string run;
  const ExportFormat* format = nullptr;
  std::optional<GeographicPoint> origin;
  Output output;
};

const ExportFormat* parse_format(const std::string& option, const std::string& text) {
  std::vector<std::string> names;
  for (const ExportFormat& format : export_formats()) {
    if (format.name == text) return &format;
    names.push_back(format.name);
  }
  throw Error(
      fmt::format("{} takes {}, not {}{}", option, listed(names, "or"), quote(text), did_you_mean(text, names)));
}

GeographicPoint parse_origin(const std::string& option, const std::string& text) {
  const std::vector<double> numbers = parse_numbers(option, text);
  if ((numbers.size() != 2 && numbers.size() != 3) || !(std::abs(numbers[0]) <= 90))
    throw Error(fmt::format("{} takes LATITUDE,LONGITUDE or LATITUDE,LONGITUDE,HEIGHT in degrees and metres, not {}",
                            option, quote(text)));
  return {numbers[0], numbers[1], numbers.size() == 3 ? numbers[2] : 0};
}

/// An export with the notes of its format.
struct WrittenExport {
  const ExportRequest& request;
  const ExportedRun& run;
  std::vector<std::string> notes;
};

JsonFields<WrittenExport> export_fields() {
  using W = WrittenExport;
  using T = ExportedTrajectory;
  return JsonFields<W>()
      .add("run", "folder that was read", [](const W& w) { return w.request.run; })
      .add("format", "format", [](const W& w) { return w.request.format->name; })
      .add("folder", "folder with the written files", [](const W& w) { return w.request.output.folder_name; })
      .add_list("trajectories", "exported trajectories",
                JsonFields<T>()
                    .add("name", "name", [](const T& t) { return t.name; })
                    .add("poses", "number of poses", [](const T& t) { return t.poses.size(); }),
                [](const W& w) -> const std::vector<T>& { return w.run.trajectories; })
      .add("notes", "states that the format cannot hold", [](const W& w) { return w.notes; });
}

int run_export(const ExportRequest& request) {
  ExportedRun run = read_exported_run(request.run);
  if (request.origin) run.origin = request.origin;
  WrittenExport written{request, run, {}};
  Results results;
  results.table = [&] {
    std::string text;
    for (const ExportedTrajectory& trajectory : run.trajectories)
      text += fmt::format("{}: {} poses\n", trajectory.name, trajectory.poses.size());
    for (const std::string& note : written.notes) text += note + "\n";
    return text;
  };
  results.json = [&] { return json_text(json_document("export", export_fields(), written)); };
  results.write = [&](const std::filesystem::path& folder) { written.notes = request.format->write(run, folder); };
  return finish(request.output, results);
}

}  // namespace

Command export_command() {
  std::string formats;
  for (const ExportFormat& format : export_formats())
    formats += fmt::format("{}{}: {}", formats.empty() ? "" : "; ", format.name, format.help);
  return {[formats](CommandOptions& option) {
            const auto request = std::make_shared<ExportRequest>();
            option.exit_status("Exit status: 0 written, 1 invalid input or usage.");
            option.footer("Poses stay in the axes of the run, except for geojson and kml, and for mcap (ENU, FLU).");
            option.argument("run", "DIR", "Output folder of tandem estimate, navigate or track, or a scenario folder",
                            request->run);
            option.required("--format", "NAME", "Format: " + formats, request->format, parse_format);
            option("--origin", "LAT,LON[,HEIGHT]",
                   "Origin of the local frame [deg, m], for geojson and kml (default: `origin` of the scenario)",
                   request->origin, parse_origin);
            add_output(option, request->output,
                       {.writes = "Write the files to DIR", .required = true, .plots = false, .prints = false});
            add_printing(option, request->output, false);
            return [request] { return run_export(*request); };
          },
          false, [] { return std::vector{describe_json("--json", "export", export_fields())}; }};
}

TANDEM_COMMAND(export, "Files", "Convert trajectories to TUM, KITTI, CSV, GeoJSON, KML, MCAP or g2o")

}  // namespace tandem
