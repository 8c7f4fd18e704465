#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {

bool Output::shows_progress() const { return !quiet && isatty(STDERR_FILENO); }

void add_output(CommandOptions& option, Output& output, const OutputKinds& kinds) {
  option.group("Output");
  const auto open = [&output](const std::string&, const std::string& text) {
    output.folder_name = text;
    return OutputFolder(text);
  };
  if (kinds.required)
    option.required(kinds.folder, "DIR", kinds.writes, output.folder, open);
  else
    option(kinds.folder, "DIR", kinds.writes, output.folder, open);
  if (kinds.plots)
    option("--plots", "svg|png|off", "Format of the plots in DIR (default svg)", output.plots, parse_plots);
  if (!kinds.prints) return;
  option.flag("--json", "Print JSON in place of tables, and nothing else", output.json);
  option.flag("--quiet", "Print no table, progress or notes", output.quiet);
}

int finish(const Output& output, const Results& results) {
  std::string note;
  if (output.folder)
    output.folder->fill([&](const std::filesystem::path& folder) {
      results.write(folder);
      if (output.plots && !results.plots_of.empty()) note = draw_plots(results.plots_of, *output.plots, folder);
    });
  if (output.json) {
    fmt::print("{}", results.json());
  } else if (!output.quiet) {
    const std::string table = results.table ? results.table() : "";
    fmt::print("{}", printable_lines(table));
    if (output.folder) fmt::print("{}Written to {}\n", table.empty() ? "" : "\n", printable(output.folder_name));
  }
  std::fflush(stdout);
  if (!note.empty() && !output.quiet) complain(note);
  if (results.not_done.empty()) return kDone;
  complain(results.not_done);
  return kNotDone;
}

std::string why_not_converged(const Summary& summary) {
  if (summary.converged()) return "";
  return fmt::format("{} did not converge ({}): {}", summary.solver, name(summary.status), summary.message);
}

WatchedSolve::WatchedSolve(SolverOptions& options, const Output& output, std::string what)
    : options_(options), line_(std::move(what)) {
  options_.stop = &interrupted();
  if (output.shows_progress()) options_.progress = [this](const Progress& progress) { line_.show(progress); };
}

WatchedSolve::~WatchedSolve() { options_.progress = nullptr; }

}  // namespace tandem
