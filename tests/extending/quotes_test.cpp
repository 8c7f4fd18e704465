// Checks that docs/contributing.md quotes the examples in this folder: the code between each pair of lines "// [name]".

#include <filesystem>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "paths.hpp"

namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return (std::ostringstream() << in.rdbuf()).str();
}

TEST(Extending, PageQuotesTheCode) {
  const std::filesystem::path source = tandem::paths::source;
  const std::string text = text_of(source / "docs/contributing.md");
  ASSERT_FALSE(text.empty());
  int quotes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(source / "tests/extending")) {
    std::istringstream lines(text_of(entry.path()));
    std::string line, mark, quote;
    while (std::getline(lines, line)) {
      if (line.starts_with("// [") && line.ends_with("]")) {
        if (mark.empty()) {
          mark = line;
          continue;
        }
        EXPECT_EQ(line, mark) << entry.path();
        EXPECT_NE(text.find("```cpp\n" + quote + "```"), std::string::npos)
            << entry.path() << " " << mark << ": docs/contributing.md must quote\n"
            << quote;
        ++quotes;
        mark.clear();
        quote.clear();
      } else if (!mark.empty()) {
        quote += line + "\n";
      }
    }
    EXPECT_TRUE(mark.empty()) << entry.path() << " " << mark << " has no closing mark";
  }
  EXPECT_GT(quotes, 5);
}

}  // namespace
