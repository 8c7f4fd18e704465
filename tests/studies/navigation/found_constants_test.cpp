#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/navigation/found_constants.hpp>

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::Not;

/// One vocabulary: that of text(ConstantVerdict), in every line.
TEST(FoundConstants, AreFoundOrNotToldOrAtOddsWithWhatWasGiven) {
  const FoundConstant found{"usbl.scale", 0.02, 0.05, 0.003}, untold{"camera.delay", 0.1, 0.3, 0.29},
      at_odds{"optical.delay", -5.7, 0.3, 0.2};
  const FoundConstant without_errors{"dvl.scale", 0.02, 0.05};
  EXPECT_EQ((FoundConstant{"usbl.scale", 0.02, 0.05, 0.04}.verdict()), ConstantVerdict::untold)
      << "its prior tells more";
  EXPECT_EQ(found.verdict(), ConstantVerdict::found);
  EXPECT_EQ(untold.verdict(), ConstantVerdict::untold);
  EXPECT_EQ(at_odds.verdict(), ConstantVerdict::at_odds);
  EXPECT_EQ(without_errors.verdict(), ConstantVerdict::unknown);
  const std::string all = constants_text({found, untold, at_odds, without_errors});
  for (const FoundConstant& c : {found, untold, at_odds, without_errors})
    EXPECT_THAT(all, HasSubstr(c.text() + ": " + std::string(text(c.verdict())) + "\n"));
  EXPECT_THAT(all, HasSubstr("more than two of its given standard deviations from none"));
  EXPECT_THAT(constants_text({found, untold}), Not(HasSubstr("from none"))) << "no advice that nobody needs";
}

TEST(FoundConstants, AreRecommendedWhereHeldOutDataArePredictedBetter) {
  FoundConstant c{"usbl.scale", 0.02, 0.05, 0.003};
  c.held_out = {3.0, 1.0};
  EXPECT_EQ(c.verdict(), ConstantVerdict::predicts_better);
  c.held_out = {3.0, 1.6};
  EXPECT_EQ(c.verdict(), ConstantVerdict::predicts_no_better) << "within two standard errors of nothing";
  c.held_out = {0.9, 0.1};
  EXPECT_EQ(c.verdict(), ConstantVerdict::predicts_no_better);
  c.value = 0.2;
  EXPECT_EQ(c.verdict(), ConstantVerdict::at_odds);
  c.held_out = {3.0, 1.0};
  EXPECT_EQ(c.verdict(), ConstantVerdict::at_odds_yet_better) << "held-out data side with it, not with what was given";
  c.value = 0.02, c.deviation = 0.05;
  EXPECT_EQ(c.verdict(), ConstantVerdict::untold) << "what the data do not tell is not found";
}

}  // namespace
}  // namespace tandem
