#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/report/figure_picture.hpp>
#include <tandem/studies/report/report_page.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

struct ReportRequest {
  std::string folder, out;
  std::optional<PlotFormat> plots;
  Output output;
};

/// A written page.
struct Page {
  std::string folder, file;
  std::vector<std::string> pictures;
};

JsonFields<Page> page_fields() {
  return JsonFields<Page>()
      .add("folder", "folder of the run or study", [](const Page& p) { return p.folder; })
      .add("page", "path of the written page", [](const Page& p) { return p.file; })
      .add("pictures", "paths of the written pictures", [](const Page& p) { return p.pictures; });
}

/// Throws Error if the file exists and is not a page that Tandem wrote.
void check_own_page(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return;
  InputFile page(file);
  std::string line;
  for (int i = 0; i < 10 && std::getline(page, line); ++i)
    if (line == HtmlPage::mark) return;
  throw Error(fmt::format("tandem did not write {}; name another file with --page, or add --force to overwrite it",
                          file.string()));
}

/// Writes the figures of a run beside the page. Returns the paths.
std::vector<std::string> write_pictures(const std::string& folder, std::filesystem::path page, PlotFormat format) {
  const std::string extension = format == PlotFormat::svg ? "svg" : format == PlotFormat::png ? "png" : "pdf";
  std::vector<std::string> files;
  for (const HtmlFigure& figure : report_figures(folder)) {
    const std::string name = fmt::format("{}_{}.{}", page.stem().string(), figure_name(figure), extension);
    const std::filesystem::path file = page.parent_path() / name;
    replace_file(file, draw_figure(figure, format));
    files.push_back(file.string());
  }
  return files;
}

int run_report(const ReportRequest& request) {
  const std::filesystem::path file =
      request.out.empty() ? file_in(request.folder, "report.html") : std::filesystem::path(request.out);
  if (!request.output.force) check_own_page(file);
  replace_file(file, report_page(request.folder));
  Page page{request.folder, file.string(), {}};
  if (request.plots) page.pictures = write_pictures(request.folder, file, *request.plots);
  Results results;
  results.table = [&] {
    std::string text = fmt::format("Written to {}\n", page.file);
    for (const std::string& picture : page.pictures) text += fmt::format("Written to {}\n", picture);
    return text;
  };
  results.json = [&] { return json_text(json_document("report", page_fields(), page)); };
  return finish(request.output, results);
}

}  // namespace

Command report_command() {
  return {[](CommandOptions& option) {
            const auto request = std::make_shared<ReportRequest>();
            option.footer("The page is self-contained and needs no network.");
            option.exit_status("Exit status: 0 written, 1 invalid input or usage.");
            option.argument("folder", "DIR",
                            "Folder of a study, or output folder of tandem estimate, navigate or track",
                            request->folder);
            option.group("Output");
            option("--page", "FILE", "Write the page to FILE (default DIR/report.html)", request->out,
                   [](const std::string&, const std::string& text) { return text; });
            option("--plots", "svg|png|pdf|off",
                   "Also write the figures of a run beside the page, as wide as a column of a paper (default off)",
                   request->plots, parse_plots);
            option.flag("--force", "Overwrite a file that tandem did not write", request->output.force);
            add_printing(option, request->output, false);
            return [request] { return run_report(*request); };
          },
          false, [] { return std::vector{describe_json("--json", "report", page_fields())}; }};
}

TANDEM_COMMAND(report, "Studies", "Write an HTML report of a run or a study")

}  // namespace tandem
