#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/import/import.hpp>
#include <tandem/studies/import/import_report.hpp>
#include <tandem/studies/recording/recording.hpp>

namespace tandem {
namespace {

struct ImportRequest {
  std::string source;
  std::optional<std::filesystem::path> map;
  bool list = false, force = false;
  Output output;
};

std::filesystem::path parse_map(const std::string&, const std::string& text) { return text; }

int run_list(const ImportRequest& request, const Recording& recording) {
  if (!request.output.folder_name.empty()) throw Error("--list writes no files; remove --out");
  Results results;
  results.table = [&] { return stream_list(recording); };
  results.json = [&] { return stream_list_json(recording); };
  return finish(request.output, results);
}

/// Throws Error if the output folder has files of another origin.
void check_folder(const ImportRequest& request) {
  if (!request.output.folder) throw Error("import needs --out DIR for the scenario, or --list");
  const std::string& folder = request.output.folder_name;
  std::error_code none;
  if (request.force || !std::filesystem::is_directory(folder, none) || std::filesystem::is_empty(folder)) return;
  throw Error(fmt::format("--out {}: the folder is not empty; use --force to write to it", folder));
}

int run_import(const ImportRequest& request) {
  if (!request.list) check_folder(request);
  const TableSettings tables = request.map ? read_table_settings(*request.map) : TableSettings();
  const auto recording = open_recording(request.source, tables);
  if (request.list) return run_list(request, *recording);
  ImportMap map = request.map ? read_import_map(*request.map, *recording) : known_import_map(*recording);
  const Stop stop(&interrupted());
  const Import import = import_recording(*recording, std::move(map), [&] { stop.check("reading " + request.source); });
  Results results;
  results.table = [&] { return import_report(import); };
  results.json = [&] { return import_json(import, request.output.folder_name); };
  results.write = [&](const std::filesystem::path& folder) { write_import(import, folder); };
  return finish(request.output, results);
}

}  // namespace

Command import_command() {
  return {
      [](CommandOptions& option) {
        const auto request = std::make_shared<ImportRequest>();
        option.exit_status("Exit status: 0 written or listed, 1 invalid input or usage.");
        option.footer("Formats: ROS 2 bags (.db3, .mcap), ROS 1 bags, ArduPilot and PX4 logs, NMEA, JSON lines, CSV.");
        option.argument("source", "SOURCE", "Recording: a file, or a folder with several", request->source);
        option("--map", "FILE",
               "YAML file that names streams, fields, units and axes (default: only messages of known meaning)",
               request->map, parse_map);
        option.flag("--list", "List the streams of the recording with their fields, rates and spans", request->list);
        add_output(
            option, request->output,
            {.writes = "Write the scenario folder to DIR", .plots = false, .prints = false, .force = &request->force});
        add_printing(option, request->output, false);
        option.flag("--force", "Write to DIR even if it is not empty, and overwrite files that tandem did not write",
                    request->force);
        return [request] { return run_import(*request); };
      },
      true,
      [] {
        return std::vector{import_json_keys(), stream_list_json_keys()};
      }};
}

TANDEM_COMMAND(import, "Files", "Convert a recording (bag, log, NMEA, CSV) to a scenario folder")

}  // namespace tandem
