#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/studies/report/html_page.hpp>

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(HtmlPage, EscapesTexts) {
  HtmlPage page("a <b> & \"c\"");
  page.heading("<script>alert(1)</script>");
  page.paragraph("1 < 2");
  page.table({"<i>"}, {{"x & y"}});
  const std::string text = page.text("/* library */");
  EXPECT_THAT(text, HasSubstr("<title>a &lt;b&gt; &amp; &quot;c&quot;</title>"));
  EXPECT_THAT(text, HasSubstr("<h2>&lt;script&gt;alert(1)&lt;/script&gt;</h2>"));
  EXPECT_THAT(text, HasSubstr("<p>1 &lt; 2</p>"));
  EXPECT_THAT(text, HasSubstr("<th>&lt;i&gt;</th>"));
  EXPECT_THAT(text, HasSubstr("<td>x &amp; y</td>"));
}

/// Figure data is valid JSON for any bytes and cannot end its script element.
TEST(HtmlPage, FigureDataIsEscaped) {
  HtmlPage page("p");
  page.figure(
      {"title", "caption", {{{"name", "</script><!--<script><b>\xff"}}}, nlohmann::ordered_json::object(), 300});
  const std::string text = page.text("");
  const std::size_t begin = text.find("id=\"figure-1-data\">") + 19, end = text.find("</script>", begin);
  const nlohmann::json figure = nlohmann::json::parse(text.substr(begin, end - begin));
  EXPECT_EQ(figure["traces"][0]["name"], "&lt;/script&gt;&lt;!--&lt;script&gt;&lt;b&gt;\uFFFD")
      << "Plotly reads markup";
  EXPECT_THAT(text, HasSubstr("<figcaption><b>title.</b> caption</figcaption>"));
}

TEST(HtmlPage, HasNoExternalResources) {
  HtmlPage page("p");
  page.figure({"title", "caption", nlohmann::ordered_json::array(), nlohmann::ordered_json::object(), 300});
  const std::string text = page.text("");
  for (const char* outside : {"http:", "https:", "src=", "@import", "url("}) EXPECT_THAT(text, Not(HasSubstr(outside)));
}

}  // namespace
}  // namespace tandem
