#include <cctype>
#include <cstdlib>

#include <fmt/format.h>
#include <unistd.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/report/figure_picture.hpp>
#include <tandem/studies/report/figure_script.hpp>
#include <tandem/studies/support/gnuplot.hpp>
#include <tandem/studies/support/output_file.hpp>

namespace tandem {
namespace {

/// A file that only this user can read, removed by the destructor.
class TemporaryScript {
 public:
  explicit TemporaryScript(const std::string& text) {
    std::string name = (std::filesystem::temp_directory_path() / "tandem-figure-XXXXXX").string();
    const int file = mkstemp(name.data());
    if (file < 0) throw Error(fmt::format("cannot create {}", name));
    close(file);
    path_ = name;
    write_file(path_, text);
  }
  ~TemporaryScript() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  TemporaryScript(const TemporaryScript&) = delete;
  TemporaryScript& operator=(const TemporaryScript&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace

std::string draw_figure(const HtmlFigure& figure, PlotFormat format) {
  const TemporaryScript script(figure_script(figure, format));
  GnuplotRun run = run_gnuplot(script.path(), {});
  if (!run.warning.empty() || run.output.empty())
    throw Error(run.started ? fmt::format("the figure '{}' was not drawn: {}", figure.title, run.warning)
                            : run.warning);
  return std::move(run.output);
}

std::string figure_name(const HtmlFigure& figure) {
  std::string name = figure.title;
  for (char& c : name)
    c = std::isalnum(static_cast<unsigned char>(c)) ? static_cast<char>(std::tolower(static_cast<unsigned char>(c)))
                                                    : '_';
  return name;
}

}  // namespace tandem
