#include <fmt/format.h>

#include <tandem/studies/support/figure.hpp>
#include <tandem/studies/support/gnuplot.hpp>

namespace tandem {

std::string figure_style(PlotFormat format, int height, const std::string& title) {
  return fmt::format(
      "set terminal {} size {},{} font 'Helvetica,13' background rgb 'white'\n"
      "set label 1 {} at screen 0.02,screen {} noenhanced\n"
      "set key at screen 0.015,screen {} left top horizontal maxrows 1 reverse Left samplen 1.5 font ',12'\n"
      "set lmargin at screen 0.11\nset rmargin at screen 0.97\n"
      "set border 3 lc rgb '#555555'\nset tics nomirror tc rgb '#333333'\nset grid lc rgb '#e8e8e8' lt 1\n",
      format == PlotFormat::svg ? "svg" : "pngcairo", kFigureWidth, height, gnuplot_string(title), 1.0 - 20.0 / height,
      1.0 - 32.0 / height);
}

std::string points_block(const std::string& name, const std::string& lines) {
  return fmt::format("${} << EOD\n{}EOD\n", name, lines.empty() ? "NaN NaN NaN\n" : lines);
}

}  // namespace tandem
