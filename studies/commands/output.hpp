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

/// Where a command's results go: --out, --plots, --json, --quiet.
struct Output {
  std::optional<OutputFolder> folder;
  std::string folder_name;  ///< as typed
  std::optional<PlotFormat> plots = PlotFormat::svg;
  bool json = false, quiet = false;

  /// Whether somebody watches what goes on: standard error is a terminal.
  bool shows_progress() const;
};

/// What of it a command has.
struct OutputKinds {
  std::string writes;  ///< for --out: "Write … to DIR"
  bool required = false;
  bool plots = true;
  bool prints = true;            ///< with --json and --quiet
  std::string folder = "--out";  ///< the option that names DIR
};
void add_output(CommandOptions& option, Output& output, const OutputKinds& kinds);

/// What a command has found out.
struct Results {
  std::function<std::string()> table, json;
  std::function<void(const std::filesystem::path& folder)> write;  ///< fills the folder
  std::string plots_of{};  ///< the command whose plots (studies/plots) are drawn there, or none
  std::string not_done{};  ///< why the exit status is kNotDone, a sentence; empty: it is kDone
};

/// Writes, prints and returns the exit status. Throws Error when the folder cannot be written.
int finish(const Output& output, const Results& results);

/// "gauss-newton did not converge (time-limit): …"; empty when it did.
std::string why_not_converged(const Summary& summary);

/// While it lives, a solve ends on an interrupt, is followed by a line on standard error where that is shown, and what
/// libraries print goes to standard error.
class WatchedSolve {
 public:
  /// `what` begins the line. The options must live as long.
  WatchedSolve(SolverOptions& options, const Output& output, std::string what = {});
  ~WatchedSolve();
  WatchedSolve(const WatchedSolve&) = delete;

 private:
  SolverOptions& options_;
  ProgressLine line_;
  LibrariesPrintToStderr redirection_;
};

}  // namespace tandem
