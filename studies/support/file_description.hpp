#pragma once

#include <string>
#include <utility>
#include <vector>

namespace tandem {

/// The contents of a result file: the columns of a CSV file or the keys of a JSON document, with their descriptions.
/// docs/file_formats.md is generated from it.
struct FileDescription {
  std::string file;                                          ///< file name, or several names separated by commas
  std::string kind;                                          ///< "column" or "key"
  std::vector<std::pair<std::string, std::string>> columns;  ///< names and descriptions
};

}  // namespace tandem
