#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/scenario/noise_file.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(NoiseFile, RoundTrips) {
  const ScratchFolder scratch;
  const std::string text = noise_file_text({{"usbl", {1.5, 0.25, 1e-3}}, {"depth", {0.1}}}, "two\nlines");
  EXPECT_THAT(text, testing::StartsWith("# two\n# lines\nnoise:\n"));
  const auto entries = read_noise_file(scratch.write("noise.yaml", text));
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].name, "usbl");
  EXPECT_THAT(entries[0].sigmas, ElementsAre(1.5, 0.25, 1e-3));
  EXPECT_EQ(entries[1].name, "depth");
  EXPECT_THAT(entries[1].sigmas, ElementsAre(0.1));
}

TEST(NoiseFile, QuotesNames) {
  const ScratchFolder scratch;
  for (const std::string name :
       {"a: b", "a #b", "[a",   "{a",  "*a", "&a",  "!a",    "|",   ">",      "@a", "- a", "-", "~",
        "null", "Null", "true", "? a", "%s", "'a'", "\"a\\", "a,b", "\u00e9", "1",  "a b", ":", ""}) {
    const auto entries = read_noise_file(scratch.write("noise.yaml", noise_file_text({{name, {1.5}}}, "")));
    ASSERT_EQ(entries.size(), 1u);
    EXPECT_EQ(entries[0].name, name);
  }
}

TEST(NoiseFile, RejectsInvalidFiles) {
  const ScratchFolder scratch;
  const auto rejection = [&](const std::string& text) -> std::string {
    try {
      read_noise_file(scratch.write("noise.yaml", text));
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(rejection("noise:\n  usbl: [1, 0, 1]\n"), HasSubstr("noise.yaml:2"));
  EXPECT_THAT(rejection("noise:\n  usbl: [1, -1]\n"), HasSubstr("above zero"));
  EXPECT_THAT(rejection("noise:\n  usbl: fine\n"), HasSubstr("noise.yaml:2"));
  EXPECT_THAT(rejection("usbl: [1]\n"), HasSubstr("usbl"));
  EXPECT_THAT(rejection("noise: {}\n"), HasSubstr("noise is empty"));
  EXPECT_THROW(read_noise_file(scratch.path() / "nowhere.yaml"), Error);
}

}  // namespace
}  // namespace tandem
