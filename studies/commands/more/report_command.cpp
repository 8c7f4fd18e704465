#include <fmt/format.h>

#include <tandem/studies/commands/command.hpp>
#include <tandem/studies/report/report_page.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

struct ReportRequest {
  std::string folder, out;
};

int run_report(const ReportRequest& request) {
  const std::filesystem::path file =
      request.out.empty() ? std::filesystem::path(request.folder) / "report.html" : std::filesystem::path(request.out);
  const std::string page = report_page(request.folder);
  // Complete, or not at all.
  std::filesystem::path fresh = file;
  fresh += ".new";
  try {
    write_file(fresh, page);
    std::filesystem::rename(fresh, file);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(fresh, ignored);
    throw;
  }
  fmt::print("Written to {}\n", printable(file.string()));
  return kDone;
}

}  // namespace

Command report_command() {
  return {[](CommandOptions& option) {
    const auto request = std::make_shared<ReportRequest>();
    option.footer("Self-contained: it needs no network. Exit status: 0 written, 1 wrong input or usage.");
    option.argument("folder", "DIR", "A study's folder, or what tandem estimate, navigate or track --out has written",
                    request->folder);
    option("--out", "FILE", "The page (default DIR/report.html)", request->out,
           [](const std::string&, const std::string& text) { return text; });
    return [request] { return run_report(*request); };
  }};
}

}  // namespace tandem
