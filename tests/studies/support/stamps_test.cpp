#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/support/stamps.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(Stamps, AreReadFromListsAndTables) {
  const ScratchFolder scratch;
  const auto read = [&](const std::string& text) { return read_stamps(scratch.write("stamps.csv", text)); };
  EXPECT_THAT(read("1\n3\n\n# a comment\n2\n2\n"), ElementsAre(1, 3, 2, 2));
  EXPECT_THAT(read("\xEF\xBB\xBFt\r\n1.5\r\n2.5\r\n"), ElementsAre(1.5, 2.5));
  EXPECT_THAT(read("image,stamp\n\"a,b.png\",4\nc.png,5\n"), ElementsAre(4, 5));
  EXPECT_THAT(read("frame\n4\n"), ElementsAre(4));
  EXPECT_THAT(read("4;a.png\n5;b.png\n"), ElementsAre(4, 5));
  EXPECT_THAT(read("4.5 1 2 3 0 0 0 1\n"), ElementsAre(4.5));
}

TEST(Stamps, ErrorsNameFileAndLine) {
  const ScratchFolder scratch;
  const auto error = [&](const std::string& text) {
    return error_of([&] { read_stamps(scratch.write("stamps.csv", text)); });
  };
  EXPECT_THAT(error("1\nnan\n"), HasSubstr("stamps.csv:2: 'nan' is not a time"));
  EXPECT_THAT(error("1\ninf\n"), HasSubstr("stamps.csv:2: 'inf' is not a time"));
  EXPECT_THAT(error("image,t\na.png,1\nb.png\n"), HasSubstr("stamps.csv:3: '' is not a time"));
  EXPECT_THAT(error("image,when\na.png,1\n"),
              HasSubstr("stamps.csv:1: none of the columns image, when is t, time, stamp or timestamp"));
  EXPECT_THAT(error("t\n"), HasSubstr("stamps.csv: there are no times"));
  EXPECT_THAT(error(""), HasSubstr("stamps.csv: there are no times"));
}

}  // namespace
}  // namespace tandem
