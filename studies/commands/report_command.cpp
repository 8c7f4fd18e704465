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

struct Picture {
  std::filesystem::path file;
  std::string content;
};

JsonFields<Page> page_fields() {
  return JsonFields<Page>()
      .add("folder", "folder of the run or study", [](const Page& p) { return p.folder; })
      .add("page", "path of the written page", [](const Page& p) { return p.file; })
      .add("pictures", "paths of the written pictures", [](const Page& p) { return p.pictures; });
}

[[noreturn]] void refuse_to_overwrite(const std::filesystem::path& file) {
  throw Error(fmt::format("tandem did not write {}; name another file with --page, or add --force to overwrite it",
                          file.string()));
}

/// Throws Error if the file exists and is not a page that Tandem wrote.
void check_own_page(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return;
  InputFile page(file);
  std::string line;
  for (int i = 0; i < 10 && std::getline(page, line); ++i)
    if (line == HtmlPage::mark) return;
  refuse_to_overwrite(file);
}

/// Draws the figures of a run for files beside the page. Without `force`, throws Error if such a file exists but the
/// page does not, so that Tandem cannot have written it.
std::vector<Picture> draw_pictures(const std::string& folder, const std::filesystem::path& page, PlotFormat format,
                                   bool force) {
  std::vector<Picture> pictures;
  const bool is_new = !force && !std::filesystem::exists(page);
  for (const HtmlFigure& figure : report_figures(folder)) {
    const std::filesystem::path file =
        page.parent_path() / fmt::format("{}_{}.{}", page.stem().string(), figure_name(figure), extension(format));
    if (is_new && std::filesystem::exists(file)) refuse_to_overwrite(file);
    pictures.push_back({file, draw_figure(figure, format)});
  }
  return pictures;
}

int run_report(const ReportRequest& request) {
  const std::filesystem::path file =
      request.out.empty() ? file_in(request.folder, "report.html") : std::filesystem::path(request.out);
  if (!request.output.force) check_own_page(file);
  Page page{request.folder, file.string(), {}};
  std::vector<Picture> pictures;
  if (request.plots) pictures = draw_pictures(request.folder, file, *request.plots, request.output.force);
  replace_file(file, report_page(request.folder));
  for (const Picture& picture : pictures) {
    replace_file(picture.file, picture.content);
    page.pictures.push_back(picture.file.string());
  }
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
