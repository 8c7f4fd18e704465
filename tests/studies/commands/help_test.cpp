#include <algorithm>
#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/support/text.hpp>
#include <tandem/studies/support/text_table.hpp>

#include "run_here.hpp"
#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

/// Returns the help of a command, which must succeed.
std::string help_of(const std::string& command, const std::string& option = "--help") {
  const Outcome run = run_tandem({command, option});
  EXPECT_EQ(run.status, 0) << run.errors;
  EXPECT_EQ(run.errors, "");
  return run.output;
}

std::vector<std::string> nonempty_lines(const std::string& text) {
  std::vector<std::string> result;
  for (const std::string_view line : split(text, '\n'))
    if (!line.empty()) result.emplace_back(line);
  return result;
}

std::vector<std::string> commands() { return nonempty_lines(run_tandem({"--reference", "words"}).output); }

TEST(Help, EverydayOptionsFitOneScreen) {
  const std::string help = help_of("estimate");
  EXPECT_LE(std::count(help.begin(), help.end(), '\n'), 40) << help;
  for (const char* option :
       {"--mode",        "--model",   "--non-holonomic", "--roll-pitch", "--surge",    "--yaw-rate",
        "--robust",      "--noise",   "--loss",          "--delay",      "--hold-out", "--solver",
        "--time-limit",  "--threads", "-o, --out",       "--plots",      "--json",     "-q, --quiet",
        "-v, --verbose", "--config",  "--print-config",  "-h, --help",   "--help-all", "Exit status"})
    EXPECT_THAT(help, HasSubstr(std::string(option))) << option;
  EXPECT_THAT(help, AllOf(Not(HasSubstr("--junction")), Not(HasSubstr("--ipopt")), Not(HasSubstr("--error"))));
}

TEST(Help, AllOptionsAreInHelpAll) {
  for (const std::string& command : commands()) {
    SCOPED_TRACE(command);
    const std::string everyday = help_of(command), all = help_of(command, "--help-all");
    for (const std::string& option : nonempty_lines(run_tandem({command, "--reference", "words"}).output))
      if (option != "--help-all") EXPECT_THAT(all, HasSubstr(option));
    EXPECT_LE(everyday.size(), all.size());
    for (const std::string* text : {&everyday, &all}) EXPECT_THAT(*text, HasSubstr("Exit status: 0 "));
    EXPECT_EQ(run_tandem({"help", command}).output, everyday);
    EXPECT_EQ(run_tandem({command, "-h"}).output, everyday);
  }
}

TEST(Help, LinesFitTheTerminal) {
  for (const std::size_t columns : {70u, 100u}) {
    setenv("COLUMNS", std::to_string(columns).c_str(), 1);
    for (const std::string& command : commands())
      for (const char* option : {"--help", "--help-all"}) {
        const std::string help = help_of(command, option);
        for (const std::string& line : nonempty_lines(help))
          EXPECT_LE(width(line), columns) << command << " " << option << ": " << line;
      }
    unsetenv("COLUMNS");
  }
}

TEST(Help, FirstSentenceIsShortHelp) {
  EXPECT_EQ(first_sentence("Use a file (default: none). It overrides --noise"), "Use a file (default: none)");
  EXPECT_EQ(first_sentence("Set an option, e.g. tol=1e-9"), "Set an option, e.g. tol=1e-9");
  EXPECT_EQ(first_sentence(""), "");
  const auto help = [](const char* option) {
    return run_here(
               [](CommandOptions& options) {
                 static std::vector<double> numbers;
                 options.repeatable("--number", "X", "A number. Numbers may be negative", numbers,
                                    [](const std::string&, const std::string&) { return 0.0; });
                 options.details("More.");
                 return [] { return 0; };
               },
               {option})
        .output;
  };
  EXPECT_THAT(help("--help"), ContainsRegex("--number X +A number; repeatable\n"));
  EXPECT_THAT(help("--help"), Not(HasSubstr("More.")));
  EXPECT_THAT(help("--help-all"), ContainsRegex("--number X +A number; repeatable. Numbers may be negative\n"));
  EXPECT_THAT(help("--help-all"), HasSubstr("More."));
}

TEST(Help, ReferenceHasManPagesAndTables) {
  for (const std::string& command : commands()) {
    const std::string page = run_tandem({command, "--reference", "man"}).output;
    EXPECT_THAT(page, ContainsRegex("^\\.TH TANDEM-[A-Z]+ 1 .*\n\\.SH NAME\ntandem-" + command + " "));
    EXPECT_THAT(run_tandem({command, "--reference", "markdown"}).output, HasSubstr("    tandem " + command));
  }
  EXPECT_THAT(run_tandem({"--reference", "man"}).output, HasSubstr(".BR tandem\\-estimate (1)\n"));
  EXPECT_THAT(run_tandem({"compare", "--reference", "files", "compare.csv"}).output,
              HasSubstr("| `solver` | name of the solver |\n"));
  EXPECT_THAT(rejection_as_given({"compare", "--reference", "files", "none.csv"}), HasSubstr("describes no file"));
}

}  // namespace
}  // namespace tandem
