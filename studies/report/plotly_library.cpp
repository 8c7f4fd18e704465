#include <filesystem>
#include <fstream>
#include <iterator>

#include <tandem/lie/error.hpp>
#include <tandem/studies/report/plotly_library.hpp>
#include <tandem/studies/support/installation.hpp>

namespace tandem {

std::string plotly_library() {
  for (const std::filesystem::path& file :
       {share_folder() / "report" / "plotly.min.js",
        std::filesystem::path("/usr/lib/python3/dist-packages/plotly/package_data/plotly.min.js")}) {
    std::ifstream stream(file, std::ios::binary);
    if (stream) return {std::istreambuf_iterator<char>(stream), {}};
  }
  throw Error(
      "a report needs plotly.js, which is missing: run scripts/setup and rebuild, or install Debian's "
      "python3-plotly");
}

}  // namespace tandem
