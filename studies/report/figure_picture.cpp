#include <cctype>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/report/figure_picture.hpp>
#include <tandem/studies/report/figure_script.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/private_folder.hpp>

namespace tandem {

std::string draw_figure(const HtmlFigure& figure, PlotFormat format) {
  const PrivateFolder folder("figure");
  const std::filesystem::path script = folder.path() / "figure.gp";
  write_file(script, figure_script(figure, format));
  GnuplotRun run = draw_picture(script, {}, format);
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
