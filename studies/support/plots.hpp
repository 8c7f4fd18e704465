#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <tandem/studies/support/gnuplot.hpp>

namespace tandem {

enum class PlotFormat { svg, png, pdf };
/// Returns the extension of a file of this format: "svg".
std::string_view extension(PlotFormat format);

/// Runs a gnuplot script that writes a picture to its standard output. An incomplete picture has a warning.
GnuplotRun draw_picture(const std::filesystem::path& script, const std::vector<std::string>& arguments,
                        PlotFormat format);

/// Returns the folder of the gnuplot scripts, share/tandem/plots.
std::filesystem::path plot_scripts();

/// A gnuplot script, with the metadata in the comments of its first lines.
struct PlotScript {
  std::filesystem::path file;
  std::vector<std::string> commands;  ///< "# of: estimate track": the commands whose output folders it draws
  std::vector<std::string> needs;     ///< "# needs: errors.csv": files that must exist in the output folder
};

/// Returns the scripts of a folder in order of their names. Omits scripts without a "# of:" line, which other scripts
/// include.
std::vector<PlotScript> plots_in(const std::filesystem::path& scripts);

/// Runs all scripts of `command` on private copies of the files in the output folder `folder`. Each writes one picture
/// named after the script. A script is skipped if a needed file is missing; it writes no picture if the files have no
/// data. Returns an empty string, or one sentence with the reason for missing pictures. Does not throw.
std::string draw_plots(const std::string& command, PlotFormat format, const std::filesystem::path& folder,
                       const std::filesystem::path& scripts = plot_scripts());

}  // namespace tandem
