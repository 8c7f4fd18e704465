#include <algorithm>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/csv.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/installation.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/plots.hpp>
#include <tandem/studies/support/private_folder.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Returns whether the picture is complete. gnuplot does not report a full disk.
bool complete(const std::string& picture, PlotFormat format) {
  return picture.find(format == PlotFormat::svg   ? "</svg>"
                      : format == PlotFormat::png ? "IEND"
                                                  : "%%EOF",
                      picture.size() - std::min<std::size_t>(picture.size(), 64)) != std::string::npos;
}

/// Returns a CSV text with tabs between the cells and without quotes or control characters. gnuplot cuts quoted cells
/// at commas, which occur in names of models.
std::string tab_separated(const std::string& csv) {
  std::string text;
  for (const std::string_view line : split(trimmed(csv), '\n')) {
    std::string cells;
    for (const std::string& cell : csv_cells(trimmed(line))) cells += printable(cell) + "\t";
    std::erase(cells, '"');
    text += cells.substr(0, cells.size() - 1) + "\n";
  }
  return text;
}

/// Copies the files that scripts draw.
void copy_data(const std::filesystem::path& results, const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(results)) {
    const std::filesystem::path &file = entry.path(), type = file.extension();
    if (!std::filesystem::is_regular_file(entry.symlink_status())) continue;
    if (type == ".csv") write_file(folder / file.filename(), tab_separated(read_state(file)));
    if (type == ".tum" || type == ".json") write_file(folder / file.filename(), read_state(file));
  }
}

/// Runs one script on `data` and writes its picture to `folder`. Returns an empty string, or the reason why the picture
/// was not drawn.
std::string draw(const std::filesystem::path& script, PlotFormat format, const std::filesystem::path& data,
                 const std::filesystem::path& folder) {
  const std::string type(extension(format)), name = script.stem().string() + "." + type;
  const GnuplotRun run = draw_picture(script, {data.string(), type, "-"}, format);
  if (!run.warning.empty()) return run.started ? fmt::format("{} was not drawn: {}", name, run.warning) : run.warning;
  if (run.output.empty()) return "";  // the script found nothing to draw
  try {
    write_file(folder / name, run.output);
  } catch (const Error& error) {
    std::error_code ignored;
    std::filesystem::remove(folder / name, ignored);
    return fmt::format("{} was not drawn: {}", name, error.what());
  }
  return "";
}

}  // namespace

std::string_view extension(PlotFormat format) {
  return format == PlotFormat::svg ? "svg" : format == PlotFormat::png ? "png" : "pdf";
}

GnuplotRun draw_picture(const std::filesystem::path& script, const std::vector<std::string>& arguments,
                        PlotFormat format) {
  GnuplotRun run = run_gnuplot(script, arguments);
  if (run.warning.empty() && !run.output.empty() && !complete(run.output, format))
    run.warning = "the output of gnuplot is incomplete";
  return run;
}

std::filesystem::path plot_scripts() { return share_folder() / "plots"; }

std::vector<PlotScript> plots_in(const std::filesystem::path& scripts) {
  std::vector<PlotScript> plots;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(scripts, error)) {
    if (entry.path().extension() != ".gp") continue;
    PlotScript plot{entry.path(), {}, {}};
    InputFile stream(entry.path());
    for (std::string line; std::getline(stream, line) && line.starts_with("#");)
      for (auto& [key, list] : {std::pair{std::string("# of:"), &plot.commands}, {"# needs:", &plot.needs}})
        if (line.starts_with(key))
          for (const std::string_view word : words(std::string_view(line).substr(key.size()))) list->emplace_back(word);
    if (!plot.commands.empty()) plots.push_back(std::move(plot));
  }
  std::sort(plots.begin(), plots.end(), [](const PlotScript& a, const PlotScript& b) { return a.file < b.file; });
  return plots;
}

std::string draw_plots(const std::string& command, PlotFormat format, const std::filesystem::path& folder,
                       const std::filesystem::path& scripts) try {
  const std::vector<PlotScript> plots = plots_in(scripts);
  if (plots.empty()) return fmt::format("no plots were drawn: found no plot scripts in {}", scripts.string());
  const PrivateFolder data("plots");
  copy_data(folder, data.path());
  for (const PlotScript& plot : plots) {
    const auto exists = [&](const std::string& file) { return std::filesystem::exists(folder / file); };
    if (std::find(plot.commands.begin(), plot.commands.end(), command) == plot.commands.end()) continue;
    if (!std::all_of(plot.needs.begin(), plot.needs.end(), exists)) continue;
    const std::string warning = draw(plot.file, format, data.path(), folder);
    if (!warning.empty()) return warning;
  }
  return "";
} catch (const std::exception& error) {
  return fmt::format("no plots were drawn: {}", error.what());
}

}  // namespace tandem
