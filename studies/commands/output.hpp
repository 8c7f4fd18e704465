#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <tandem/studies/commands/command_options.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/output_folder.hpp>
#include <tandem/studies/support/plots.hpp>
#include <tandem/studies/support/progress_line.hpp>

namespace tandem {

/// Values of the output options --out, --force, --plots, --json and --quiet.
struct Output {
  std::optional<OutputFolder> folder;
  std::string folder_name;  ///< as typed
  bool force = false;       ///< overwrites files in the folder that Tandem did not write
  std::optional<PlotFormat> plots = PlotFormat::svg;
  bool json = false, quiet = false, verbose = false;
  bool strict = false;  ///< a misfit makes the exit status kMisfit

  /// Returns whether to show progress: standard error is a terminal or --verbose is given, and --quiet is not.
  bool shows_progress() const;
};

/// The output options that a command has.
struct OutputOptions {
  std::string writes;  ///< help text of --out, "Write … to DIR"
  bool required = false;
  bool plots = true;
  bool prints = true;               ///< adds the options of add_printing()
  bool judges = false;              ///< adds --strict
  std::string folder = "-o,--out";  ///< name of the option for DIR
  const bool* force = nullptr;      ///< value of the command's own --force, if it has one
};
/// Adds the output options to a command.
void add_output(CommandOptions& option, Output& output, const OutputOptions& options);
/// Adds --json, --quiet and, for commands that show progress, --verbose.
void add_printing(CommandOptions& option, Output& output, bool shows_progress = true);

/// Adds --at, the file of times for chaser_at.csv and target_at.csv.
void add_at(CommandOptions& option, std::vector<double>& at, const Output& output);

/// The results of a command.
struct Results {
  bool announces_folder = true;  ///< whether to print the name of the output folder after the tables
  std::function<std::string()> table, json;
  std::function<void(const std::filesystem::path& folder)> write;  ///< Writes the files to the output folder.
  std::string plots_command{};      ///< Draws the plots of this command (see draw_plots()); empty for none.
  std::string incomplete_reason{};  ///< One sentence if the exit status is kIncomplete; empty for kSuccess.
  std::string misfit{};             ///< The verdict if the data do not fit the model; makes --strict exit with kMisfit.
};

/// Writes and prints the results, and returns the exit status. Throws Error if the output folder cannot be written.
int finish(const Output& output, const Results& results);

/// Returns "gauss-newton did not converge (time-limit): …", or an empty string if the solve converged.
std::string why_not_converged(const Summary& summary);

/// Returns a function that shows texts in a progress line, until its last copy is destroyed, or an empty function if
/// `output` shows no progress.
std::function<void(const std::string&)> progress_shown(const Output& output);

/// Watches a solve during its lifetime: an interrupt ends the solve, a progress line shows its iterations, and the
/// output of libraries goes to standard error.
class WatchedSolve {
 public:
  /// `prefix` starts the progress line. `options` must exist as long as this object.
  WatchedSolve(SolverOptions& options, const Output& output, std::string prefix = {});
  ~WatchedSolve();
  WatchedSolve(const WatchedSolve&) = delete;

 private:
  SolverOptions& options_;
  ProgressLine line_;
  StdoutToStderr redirection_;
};

}  // namespace tandem
