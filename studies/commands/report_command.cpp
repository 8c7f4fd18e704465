#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/commands/output.hpp>
#include <tandem/studies/report/html_page.hpp>
#include <tandem/studies/report/report_page.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/json_fields.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

struct ReportRequest {
  std::string folder, out;
  Output output;
};

/// A written page.
struct Page {
  std::string folder, file;
};

JsonFields<Page> page_fields() {
  return JsonFields<Page>()
      .add("folder", "folder of the run or study", [](const Page& p) { return p.folder; })
      .add("page", "path of the written page", [](const Page& p) { return p.file; });
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

int run_report(const ReportRequest& request) {
  const std::filesystem::path file =
      request.out.empty() ? file_in(request.folder, "report.html") : std::filesystem::path(request.out);
  if (!request.output.force) check_own_page(file);
  replace_file(file, report_page(request.folder));
  Results results;
  results.table = [&] { return fmt::format("Written to {}\n", file.string()); };
  results.json = [&] { return json_text(json_document("report", page_fields(), Page{request.folder, file.string()})); };
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
            option.flag("--force", "Overwrite a file that tandem did not write", request->output.force);
            add_printing(option, request->output, false);
            return [request] { return run_report(*request); };
          },
          false, [] { return std::vector{describe_json("--json", "report", page_fields())}; }};
}

TANDEM_COMMAND(report, "Studies", "Write an HTML report of a run or a study")

}  // namespace tandem
