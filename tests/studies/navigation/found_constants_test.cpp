#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/navigation/found_constants.hpp>

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(FoundConstants, AreFoundOrNotToldOrAtOddsWithWhatWasGiven) {
  const FoundConstant found{"usbl.scale", 0.02, 0.05, 0.003}, untold{"camera.delay", 0.1, 0.3, 0.29},
      at_odds{"optical.delay", -5.7, 0.3, 0.2};
  EXPECT_TRUE(found.determined() && !found.at_odds());
  EXPECT_TRUE(!untold.determined() && !untold.at_odds());
  EXPECT_TRUE(at_odds.at_odds());
  const std::string text = constants_text({found, untold, at_odds});
  EXPECT_THAT(text, HasSubstr("The data do not tell camera.delay apart"));
  EXPECT_THAT(text, HasSubstr("optical.delay is more than two of its standard deviations from none"));
  EXPECT_THAT(constants_text({found}), Not(HasSubstr("none")));
}

}  // namespace
}  // namespace tandem
