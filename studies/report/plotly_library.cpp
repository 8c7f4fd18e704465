#include <filesystem>

#include <tandem/lie/error.hpp>
#include <tandem/studies/report/plotly_library.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/installation.hpp>

namespace tandem {

std::string plotly_library() {
  for (const std::filesystem::path& file :
       {share_folder() / "report" / "plotly.min.js",
        std::filesystem::path("/usr/lib/python3/dist-packages/plotly/package_data/plotly.min.js"),  // Debian 12
        std::filesystem::path("/usr/share/python3-plotly/plotly.js")}) {                            // Debian 13
    std::error_code error;
    if (std::filesystem::exists(file, error)) return read_text(file);
  }
  throw Error(
      "a report needs plotly.js, which is missing: run scripts/setup and rebuild, or install Debian's "
      "python3-plotly");
}

}  // namespace tandem
