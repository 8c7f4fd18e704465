#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem {

enum class PlotFormat { svg, png };

/// Where the gnuplot scripts of plots are: in share/tandem/plots, beside the executable's folder.
std::filesystem::path plot_scripts();

/// A script and what its first lines, comments, say of it.
struct PlotScript {
  std::filesystem::path file;
  std::vector<std::string> of;     ///< "# of: estimate track", the commands whose runs it draws
  std::vector<std::string> needs;  ///< "# needs: errors.csv", the files without which there is nothing to draw
};

/// The scripts in a folder, by name; those that draw no command's runs, as what others call, are none.
std::vector<PlotScript> plots_in(const std::filesystem::path& scripts);

/// Draws what a run of `command` has written into `folder`, by gnuplot, a picture of each script's name: a script whose files
/// are not there, or that finds nothing in them, gives none. Never throws: returns nothing, or one sentence that says why
/// pictures are missing.
std::string draw_plots(const std::string& command, PlotFormat format, const std::filesystem::path& folder,
                       const std::filesystem::path& scripts = plot_scripts());

}  // namespace tandem
