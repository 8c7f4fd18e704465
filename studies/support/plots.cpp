#include <algorithm>
#include <fstream>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/support/gnuplot.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/plots.hpp>
#include <tandem/studies/support/share_folder.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Whether gnuplot came to the picture's end: where a disk is full it does not notice.
bool complete(const std::string& picture, PlotFormat format) {
  return picture.find(format == PlotFormat::svg ? "</svg>" : "IEND",
                      picture.size() - std::min<std::size_t>(picture.size(), 64)) != std::string::npos;
}

/// Nothing, or why there is no picture.
std::string draw(const std::filesystem::path& script, PlotFormat format, const std::filesystem::path& folder) {
  const std::string extension = format == PlotFormat::svg ? "svg" : "png";
  const std::string name = script.stem().string() + "." + extension;
  const GnuplotRun run = run_gnuplot(script, {folder.string(), extension, "-"});
  if (!run.complaint.empty())
    return run.started ? fmt::format("{} is not drawn: {}", name, run.complaint) : run.complaint;
  if (run.output.empty()) return "";  // there is nothing to draw
  if (!complete(run.output, format)) return fmt::format("{} is not drawn: gnuplot ended in the middle of it", name);
  try {
    write_file(folder / name, run.output);
  } catch (const Error& error) {
    std::error_code ignored;
    std::filesystem::remove(folder / name, ignored);
    return fmt::format("{} is not drawn: {}", name, error.what());
  }
  return "";
}

}  // namespace

std::filesystem::path plot_scripts() { return share_folder() / "plots"; }

std::vector<PlotScript> plots_in(const std::filesystem::path& scripts) {
  std::vector<PlotScript> plots;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(scripts, error)) {
    if (entry.path().extension() != ".gp") continue;
    PlotScript plot{entry.path(), {}, {}};
    std::ifstream stream(entry.path());
    for (std::string line; std::getline(stream, line) && line.starts_with("#");)
      for (auto& [key, list] : {std::pair{std::string("# of:"), &plot.of}, {"# needs:", &plot.needs}})
        if (line.starts_with(key))
          for (const std::string_view word : words(std::string_view(line).substr(key.size()))) list->emplace_back(word);
    if (!plot.of.empty()) plots.push_back(std::move(plot));
  }
  std::sort(plots.begin(), plots.end(), [](const PlotScript& a, const PlotScript& b) { return a.file < b.file; });
  return plots;
}

std::string draw_plots(const std::string& command, PlotFormat format, const std::filesystem::path& folder,
                       const std::filesystem::path& scripts) try {
  const std::vector<PlotScript> plots = plots_in(scripts);
  if (plots.empty()) return fmt::format("no plots were drawn: their scripts are not in {}", scripts.string());
  for (const PlotScript& plot : plots) {
    const auto there = [&](const std::string& file) { return std::filesystem::exists(folder / file); };
    if (std::find(plot.of.begin(), plot.of.end(), command) == plot.of.end()) continue;
    if (!std::all_of(plot.needs.begin(), plot.needs.end(), there)) continue;
    const std::string complaint = draw(plot.file, format, std::filesystem::absolute(folder));
    if (!complaint.empty()) return complaint;
  }
  return "";
} catch (const std::exception& error) {
  return fmt::format("no plots were drawn: {}", error.what());
}

}  // namespace tandem
