#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/support/json_fields.hpp>

namespace tandem {
namespace {

using testing::ElementsAre;
using testing::Pair;

struct Part {
  int n = 0;
  std::optional<double> size{};
};

struct Whole {
  std::string name;
  std::optional<Part> first{};
  std::vector<Part> parts{};
  std::vector<std::pair<std::string, Part>> named{};
};

JsonFields<Part> part_fields() {
  return JsonFields<Part>()
      .add("n", "number", [](const Part& p) { return p.n; })
      .add("size", "size [m]", [](const Part& p) { return p.size; });
}

JsonFields<Whole> whole_fields() {
  return JsonFields<Whole>()
      .add("name", "name", [](const Whole& w) { return w.name; })
      .add_object("first", "first part", part_fields(), [](const Whole& w) { return w.first; })
      .add_list("parts", "all parts", part_fields(), [](const Whole& w) -> const std::vector<Part>& { return w.parts; })
      .add_map("named", "NAME", "named parts", part_fields(), [](const Whole& w) { return w.named; });
}

TEST(JsonFields, WritesKeysInOrder) {
  const Whole whole{"w", Part{1, 2.5}, {{2}, {3, 4.5}}, {{"b", {5}}, {"a", {6}}}};
  EXPECT_EQ(whole_fields()(whole).dump(),
            R"({"name":"w","first":{"n":1,"size":2.5},"parts":[{"n":2},{"n":3,"size":4.5}],)"
            R"("named":{"b":{"n":5},"a":{"n":6}}})");
}

TEST(JsonFields, OmitsAbsentValues) {
  EXPECT_EQ(whole_fields()(Whole{"w"}).dump(), R"({"name":"w","parts":[]})")
      << "lists are present, absent objects and empty maps are not";
}

TEST(JsonFields, DescribesNestedKeys) {
  EXPECT_THAT(whole_fields().documented(),
              ElementsAre(Pair("name", "name"), Pair("first", "first part"), Pair("first.n", "number"),
                          Pair("first.size", "size [m]"), Pair("parts", "all parts"), Pair("parts[].n", "number"),
                          Pair("parts[].size", "size [m]"), Pair("named", "named parts"),
                          Pair("named.NAME.n", "number"), Pair("named.NAME.size", "size [m]")));
}

TEST(JsonFields, AddsFieldsOfMember) {
  const auto fields = JsonFields<Whole>().add_all(part_fields(), [](const Whole& w) { return *w.first; });
  EXPECT_EQ(fields(Whole{"w", Part{1}}).dump(), R"({"n":1})");
  EXPECT_THAT(fields.documented(), ElementsAre(Pair("n", "number"), Pair("size", "size [m]")));
}

TEST(JsonFields, DocumentStartsWithSchema) {
  EXPECT_EQ(json_document("probe", part_fields(), Part{1}).dump(), R"({"schema":"tandem.probe/1","n":1})");
  const FileDescription file = describe_json("summary.json", "probe", part_fields());
  EXPECT_EQ(file.kind, "key");
  EXPECT_EQ(file.columns.front().first, "schema");
  EXPECT_EQ(file.columns.size(), 3u);
}

}  // namespace
}  // namespace tandem
