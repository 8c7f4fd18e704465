#include <memory>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/stamps.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {

bool Output::shows_progress() const { return !quiet && (verbose || isatty(STDERR_FILENO)); }

void add_output(CommandOptions& option, Output& output, const OutputOptions& options) {
  option.group("Output");
  const auto open = [&output](const std::string&, const std::string& text) {
    output.folder_name = text;
    return OutputFolder(text);
  };
  if (options.required)
    option.required(options.folder, "DIR", options.writes, output.folder, open);
  else
    option(options.folder, "DIR", options.writes, output.folder, open);
  if (!options.force) option.flag("--force", "Overwrite files in DIR that tandem did not write", output.force);
  option.after_reading([&output, &option, force = options.force ? options.force : &output.force] {
    if (!output.folder) return;
    if (*force) output.folder->force();
    output.folder->check(option.result_files());
  });
  if (options.plots)
    option("--plots", "svg|png|pdf|off", "Format of the plots in DIR (default svg)", output.plots, parse_plots);
  if (options.judges) option.flag("--strict", "Exit with status 3 if the data do not fit the model", output.strict);
  if (options.prints) add_printing(option, output);
}

void add_printing(CommandOptions& option, Output& output, bool shows_progress) {
  option.group("Output");
  option.flag("--json", "Print JSON instead of tables", output.json);
  option.flag("-q,--quiet", "Print no tables, progress or notes", output.quiet);
  if (shows_progress)
    option.flag("-v,--verbose", "Show progress even if standard error is not a terminal", output.verbose);
}

void add_at(CommandOptions& option, std::vector<double>& at, const Output& output) {
  option.group("Output");
  option("--at", "FILE", "Also write the states at the times in FILE [s] to DIR", at,
         [](const std::string&, const std::string& text) { return read_stamps(text); });
  option.after_reading([&at, &output] {
    if (!at.empty() && !output.folder) throw Error("--at needs --out DIR, where it writes the states");
  });
}

int finish(const Output& output, const Results& results) {
  std::string note;
  if (output.folder)
    output.folder->fill([&](const std::filesystem::path& folder) {
      results.write(folder);
      if (output.plots && !results.plots_command.empty())
        note = draw_plots(results.plots_command, *output.plots, folder);
    });
  if (output.json) {
    print(results.json());
  } else if (!output.quiet) {
    const std::string table = results.table ? results.table() : "";
    print(printable_lines(table));
    if (output.folder && results.announces_folder)
      print(fmt::format("{}Written to {}\n", table.empty() ? "" : "\n", printable(output.folder_name)));
  }
  flush_output();
  if (!note.empty() && !output.quiet) warn(note);
  if (!results.incomplete_reason.empty()) {
    warn(results.incomplete_reason);
    return kIncomplete;
  }
  if (results.misfit.empty() || !output.strict) return kSuccess;
  warn(results.misfit);
  return kMisfit;
}

std::string why_not_converged(const Summary& summary) {
  if (summary.converged()) return "";
  return fmt::format("{} did not converge ({}): {}", summary.solver, name(summary.status), summary.message);
}

std::function<void(const std::string&)> progress_shown(const Output& output) {
  if (!output.shows_progress()) return {};
  return [line = std::make_shared<ProgressLine>()](const std::string& text) { line->show(text); };
}

WatchedSolve::WatchedSolve(SolverOptions& options, const Output& output, std::string prefix)
    : options_(options), line_(std::move(prefix)) {
  options_.stop = &interrupted();
  if (output.shows_progress()) options_.progress = [this](const Progress& progress) { line_.show(progress); };
}

WatchedSolve::~WatchedSolve() { options_.progress = nullptr; }

}  // namespace tandem
