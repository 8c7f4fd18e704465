#include <optional>

#include <gmock/gmock.h>

#include <tandem/studies/support/option_values.hpp>

#include "run_here.hpp"

namespace tandem {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// Option values as read by a command.
struct Read {
  std::string place, hidden;
  std::optional<int> count;
  double scale = 1;
  std::vector<double> numbers;
  std::vector<std::string> order, given, words;
  bool flag = false, ran = false;
};

RunHere run(const std::vector<std::string>& words, Read& read) {
  return run_here(
      [&read](CommandOptions& option) {
        option.footer("The end.");
        option.argument("place", "PLACE", "Where", read.place);
        option.group("Numbers");
        option("--count", "N", "How many", read.count, [&read](const std::string& name, const std::string& text) {
          read.order.push_back(name);
          return parse_count(name, text);
        });
        option.repeatable("--number", "X", "A number", read.numbers, parse_finite);
        option.required("--scale", "X", "Times", read.scale, parse_positive);
        option.group("Others");
        option.flag("--flag", "Or not", [&read] {
          read.order.emplace_back("--flag");
          read.flag = true;
        });
        option.hidden("--hidden", read.hidden);
        return [&read, &option] {
          read.ran = true;
          read.given = option.given("Numbers");
          read.words = option.words();
          return 5;
        };
      },
      words);
}

TEST(CommandOptions, ReadsValuesIntoVariables) {
  Read read;
  const RunHere result =
      run({"--flag", "here", "--number", "1", "--scale", "2", "--number", "-3", "--count=4", "--hidden", "x"}, read);
  EXPECT_EQ(result.errors, "");
  EXPECT_EQ(result.status, 5);
  EXPECT_EQ(read.place, "here");
  EXPECT_EQ(read.count, 4);
  EXPECT_EQ(read.scale, 2);
  EXPECT_THAT(read.numbers, ElementsAre(1, -3));
  EXPECT_EQ(read.hidden, "x");
  EXPECT_THAT(read.order, ElementsAre("--count", "--flag")) << "in the order of registration";
  EXPECT_THAT(read.given, ElementsAre("--count", "--number", "--scale"));
  EXPECT_EQ(read.words.front(), "--flag");
  EXPECT_EQ(read.words.back(), "x");
}

TEST(CommandOptions, HelpGroupsOptionsUnderHeadings) {
  Read read;
  const RunHere help = run({"--count", "nonsense", "--help"}, read);
  EXPECT_EQ(help.status, 0) << help.errors;
  EXPECT_FALSE(read.ran);
  const std::string& text = help.output;
  const auto at = [&](const char* what) {
    EXPECT_THAT(text, HasSubstr(what));
    return text.find(what);
  };
  EXPECT_LT(at("PLACE"), at("Numbers:"));
  EXPECT_LT(at("Numbers:"), at("--count"));
  EXPECT_LT(at("--count"), at("Others:"));
  EXPECT_LT(at("Others:"), at("--flag"));
  EXPECT_LT(at("--flag"), at("The end."));
  EXPECT_THAT(text, Not(HasSubstr("--hidden")));
}

TEST(CommandOptions, InvalidUsagePrintsOneSentenceAndRunsNothing) {
  const auto error = [](const std::vector<std::string>& words) {
    Read read;
    const RunHere result = run(words, read);
    EXPECT_EQ(result.status, kInvalidInput);
    EXPECT_EQ(result.output, "");
    EXPECT_FALSE(read.ran);
    EXPECT_THAT(result.errors, testing::ContainsRegex("^tandem: [^\n]+\n$"));
    return result.errors;
  };
  EXPECT_THAT(error({"here", "--scale", "1", "--cuont", "2"}),
              HasSubstr("unknown option '--cuont'; did you mean --count?"));
  EXPECT_THAT(error({"here", "--scale", "0", "--cuont", "2"}), HasSubstr("unknown option"))
      << "reported before invalid values";
  EXPECT_THAT(error({"here", "--scale", "1", "--hiden", "2"}), Not(HasSubstr("--hidden")));
  EXPECT_THAT(error({"here", "--scale", "0"}), HasSubstr("--scale takes a positive number, not '0'"));
  EXPECT_THAT(error({"here"}), HasSubstr("--scale is required (see tandem probe --help)"));
  EXPECT_THAT(error({"--scale", "1"}), HasSubstr("place is required"));
  EXPECT_THAT(error({"here", "--scale", "1", "--scale", "1"}), HasSubstr("--scale is given twice"));
  EXPECT_THAT(error({"here", "--scale"}), HasSubstr("--scale needs a value"));
  EXPECT_THAT(error({"here", "--scale", "\x1b[2J"}), HasSubstr("'\\x1b[2J' is not a number"));
}

TEST(CommandOptions, PrintsErrorsOfRunEscaped) {
  const RunHere result =
      run_here([](CommandOptions&) { return []() -> int { throw std::runtime_error("a\x1b]0;title\x07"); }; }, {});
  EXPECT_EQ(result.status, kInvalidInput);
  EXPECT_EQ(result.errors, "tandem: a\\x1b]0;title\\x07\n");
}

}  // namespace
}  // namespace tandem
