#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/recording/recording.hpp>

#include "studies/recording/read_rows.hpp"
#include "studies/recording/written_recordings.hpp"
#include "studies/scratch.hpp"

/// Reads bags that the tests write: the same five messages in each format and compression.
namespace tandem {
namespace {

using namespace written;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

const std::vector<std::string> kFields = {"header.stamp", "quality", "range", "beams[1]", "beams[5]", "mode", "count"};
constexpr double kStart = 1700000000.25;
constexpr int kMessages = 5;

std::vector<std::string> compressions() {
  std::vector<std::string> all = {""};
#ifdef TANDEM_HAS_LZ4
  all.push_back("lz4");
#endif
#ifdef TANDEM_HAS_ZSTD
  all.push_back("zstd");
#endif
  return all;
}

std::string mcap_messages(int first, int last) {
  std::string records;
  for (int i = first; i < last; ++i) records += Mcap::message(7, kStart + i + 0.5, fix_cdr(kStart + i, 10.5 + i));
  return records;
}
std::string mcap_topics() { return Mcap::schema(2, "test_msgs/msg/Fix", kFixDefinition) + Mcap::channel(7, 2, "/fix"); }

std::string bag_messages() {
  std::string records = Bag::connection(4, "/fix", "test_msgs/Fix", kFixDefinitionRos1);
  for (int i = 0; i < kMessages; ++i) records += Bag::message(4, kStart + i + 0.5, fix_ros1(kStart + i, 10.5 + i));
  return records;
}

void expect_messages(Recording& recording, std::size_t count = kMessages) {
  ASSERT_THAT(recording.streams(), SizeIs(1));
  const RecordedStream& stream = recording.streams().front();
  EXPECT_EQ(stream.name, "/fix");
  EXPECT_EQ(stream.type, "test_msgs/Fix");
  EXPECT_EQ(stream.time_field, "header.stamp");
  EXPECT_EQ(stream.rows, count);
  EXPECT_NEAR(stream.first, kStart + 0.5, 1e-6);
  const auto rows = read_rows(recording, "/fix", kFields);
  ASSERT_THAT(rows, SizeIs(count));
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_NEAR(rows[i].received, kStart + double(i) + 0.5, 1e-6);
    EXPECT_NEAR(rows[i].numbers[0], kStart + double(i), 1e-6);
    EXPECT_EQ(rows[i].numbers[1], 3);
    EXPECT_EQ(rows[i].numbers[2], 10.5 + double(i));
    EXPECT_EQ(rows[i].numbers[3], 2.5);
    EXPECT_TRUE(std::isnan(rows[i].numbers[4])) << "an element beyond the end of a sequence";
    EXPECT_EQ(rows[i].texts[5], "auto");
    EXPECT_EQ(rows[i].numbers[6], -7);
  }
}

TEST(Bags, ReadMcapOfAllCompressions) {
  const ScratchFolder scratch;
  for (const std::string& compression : compressions()) {
    const auto file = scratch.write(
        "a.mcap", Mcap::start() + Mcap::chunk(compression, mcap_topics() + mcap_messages(0, 5)) + Mcap::end());
    const auto recording = open_recording(file);
    EXPECT_THAT(recording->defects(), IsEmpty()) << compression;
    expect_messages(*recording);
  }
}

TEST(Bags, ReadRos1OfAllCompressions) {
  const ScratchFolder scratch;
  for (const std::string compression : {"none", "lz4", "bz2"}) {
    const auto file = scratch.write("a.bag", Bag::start(0) + Bag::chunk(compression, bag_messages()));
    const auto recording = open_recording(file);
#if defined(TANDEM_HAS_LZ4) && defined(TANDEM_HAS_BZIP2)
    EXPECT_THAT(recording->defects(), IsEmpty()) << compression;
    expect_messages(*recording);
#endif
  }
}

TEST(Bags, ReadRos2DatabasesWithEmbeddedAndBuiltInDefinitions) {
  const ScratchFolder scratch;
  std::vector<std::pair<double, std::string>> messages;
  for (int i = 0; i < kMessages; ++i) messages.emplace_back(kStart + i + 0.5, fix_cdr(kStart + i, 10.5 + i));
  write_db3((scratch.path() / "a.db3").string(), "test_msgs/msg/Fix", kFixDefinition, messages);
  const auto recording = open_recording(scratch.path() / "a.db3");
  expect_messages(*recording);

  Cdr depth;
  depth.add(std::int32_t(12)).add(std::uint32_t(500000000)).text("p").add(101325.0).add(4.0);
  write_db3((scratch.path() / "b.db3").string(), "sensor_msgs/msg/FluidPressure", "", {{13, depth.str()}});
  const auto built_in = open_recording(scratch.path() / "b.db3");
  const auto rows = read_rows(*built_in, "/fix", {"header.stamp", "fluid_pressure", "variance"});
  ASSERT_THAT(rows, SizeIs(1));
  EXPECT_THAT(rows[0].numbers, ElementsAre(12.5, 101325, 4));

  write_db3((scratch.path() / "c.db3").string(), "my_msgs/msg/Odd", "", {{13, depth.str()}});
  EXPECT_THAT(open_recording(scratch.path() / "c.db3")->streams()[0].unreadable, HasSubstr("not built in"));
}

#ifdef TANDEM_HAS_ZSTD
TEST(Bags, ReadMessagesCompressedOneByOne) {
  const ScratchFolder scratch;
  const auto file = scratch.path() / "messages.db3";
  std::vector<std::pair<double, std::string>> messages;
  for (int i = 0; i < kMessages; ++i)
    messages.emplace_back(kStart + i + 0.5, compressed("zstd", fix_cdr(kStart + i, 10.5 + i)));
  write_db3(file.string(), "test_msgs/msg/Fix", kFixDefinition, messages);
  const auto recording = open_recording(file);
  expect_messages(*recording);
  EXPECT_THAT(recording->defects(), IsEmpty());
  const auto damaged = scratch.path() / "damaged.db3";
  messages[1].second.resize(12);
  write_db3(damaged.string(), "test_msgs/msg/Fix", kFixDefinition, messages);
  const auto rest = open_recording(damaged);
  EXPECT_THAT(read_rows(*rest, "/fix", {"range"}), SizeIs(kMessages - 1));
  EXPECT_THAT(rest->defects(), ElementsAre(HasSubstr("/fix: a message is dropped: the zstd data are corrupted")));
}
#endif

TEST(Bags, CompressedFilesNameTheirCompression) {
  const ScratchFolder scratch;
  std::filesystem::create_directory(scratch.path() / "bag");
  const std::string zstd("\x28\xB5\x2F\xFD\x04\0\0\0", 8), gzip("\x1F\x8B\x08\0\0\0\0\0", 8);
  EXPECT_THAT(error_of([&] { open_recording(scratch.write("bag/bag_0.db3.zstd", zstd)); }),
              HasSubstr("bag_0.db3.zstd: the file is compressed with zstd; decompress it (unzstd FILE)"));
  EXPECT_THAT(error_of([&] { open_recording(scratch.path() / "bag"); }), HasSubstr("is compressed with zstd"));
  EXPECT_THAT(error_of([&] { open_recording(scratch.write("a.csv.gz", gzip)); }), HasSubstr("is compressed with gzip"));
}

TEST(Bags, OtherVersionsAndCutFilesAreNamed) {
  const ScratchFolder scratch;
  for (const auto& [content, why] :
       {std::pair{"#ROSBAG V1.2\n# 3 lines\n", "a ROS 1 bag of version 1.2 is not supported"},
        {"\x89MCAP", "the file is cut after 5 bytes (format: MCAP)"},
        {"\x89MCAP1\r\n", "this version of MCAP is not supported"}}) {
    const auto file = scratch.write("a.bag", content);
    EXPECT_THAT(error_of([&] { open_recording(file); }), HasSubstr(why));
  }
}

TEST(Bags, JoinTheTopicsOfSeveralFiles) {
  const ScratchFolder scratch;
  scratch.write("a_0.mcap", Mcap::start() + mcap_topics() + mcap_messages(0, 2) + Mcap::end());
  scratch.write("a_1.mcap", Mcap::start() + mcap_topics() + mcap_messages(2, 5) + Mcap::end());
  scratch.write("metadata.yaml", "not read");
  expect_messages(*open_recording(scratch.path()));
}

TEST(Bags, UseWhatComesBeforeATruncation) {
  const ScratchFolder scratch;
  const std::string whole = Mcap::start() + mcap_topics() + mcap_messages(0, 3);
  const auto file = scratch.write("a.mcap", whole + Mcap::message(7, 0, fix_cdr(0, 1)).substr(0, 40));
  const auto recording = open_recording(file);
  EXPECT_THAT(recording->defects(),
              ElementsAre(AllOf(HasSubstr("truncated"), HasSubstr("byte " + std::to_string(whole.size())))));
  expect_messages(*recording, 3);

  const auto between = open_recording(scratch.write("b.mcap", whole));
  EXPECT_THAT(between->defects(), ElementsAre(HasSubstr("no end record after byte " + std::to_string(whole.size()))));
  expect_messages(*between, 3);

  const std::string bag = Bag::start(0) + bag_messages();
  const auto cut = open_recording(scratch.write("a.bag", bag.substr(0, bag.size() - 5)));
  EXPECT_THAT(cut->defects(), ElementsAre(HasSubstr("truncated")));
  expect_messages(*cut, 4);
}

TEST(Bags, UseTheMessagesOfATruncatedDatabase) {
  const ScratchFolder scratch;
  std::vector<std::pair<double, std::string>> messages;
  for (int i = 0; i < 3000; ++i) messages.emplace_back(kStart + i + 0.5, fix_cdr(kStart + i, 10.5 + i));
  const std::filesystem::path file = scratch.path() / "a.db3";
  write_db3(file.string(), "test_msgs/msg/Fix", kFixDefinition, messages);
  const auto size = std::filesystem::file_size(file);
  std::filesystem::resize_file(file, size / 2);
  const auto recording = open_recording(file);
  EXPECT_THAT(recording->defects(),
              testing::Contains(
                  HasSubstr("truncated: it ends at byte " + std::to_string(size / 2) + " of " + std::to_string(size))));
  const auto rows = read_rows(*recording, "/fix", kFields);
  EXPECT_GT(rows.size(), 1000u);
  EXPECT_LT(rows.size(), 3000u);
}

TEST(Bags, UseTheFirstPartOfADamagedChunk) {
  const ScratchFolder scratch;
  const std::string records = mcap_topics() + mcap_messages(0, 5);
  std::string chunk = Mcap::chunk("", records);
  const auto cut = open_recording(scratch.write("a.mcap", Mcap::start() + chunk.substr(0, chunk.size() - 10)));
  EXPECT_THAT(cut->defects(), testing::Contains(HasSubstr("truncated")));
  expect_messages(*cut, 4);
}

TEST(Bags, SkipChunksOfUnknownCompressionAndNameTheByte) {
  const ScratchFolder scratch;
  const std::string before = Mcap::start() + mcap_topics() + mcap_messages(0, 2);
  const auto recording =
      open_recording(scratch.write("a.mcap", before + Mcap::chunk("brotli", mcap_messages(2, 5)) + Mcap::end()));
  EXPECT_THAT(recording->defects(), ElementsAre(AllOf(HasSubstr("the chunk at byte " + std::to_string(before.size())),
                                                      HasSubstr("unknown compression 'brotli'"))));
  expect_messages(*recording, 2);
}

/// Returns three chunks with messages 0, 1 to 3, and 4.
std::array<std::string, 3> bag_chunks(const std::string& compression) {
  std::array<std::string, 3> chunks;
  const int first[] = {0, 1, 4, 5};
  for (std::size_t c = 0; c < 3; ++c) {
    std::string records = Bag::connection(4, "/fix", "test_msgs/Fix", kFixDefinitionRos1);
    for (int i = first[c]; i < first[c + 1]; ++i)
      records += Bag::message(4, kStart + i + 0.5, fix_ros1(kStart + i, 10.5 + i));
    chunks[c] = Bag::chunk(compression, records);
  }
  return chunks;
}

/// Expects that the messages `expected` (by their number) are read, and that the places are named.
void expect_beside_damage(const std::filesystem::path& file, const std::vector<int>& expected, std::size_t damaged,
                          std::size_t next) {
  const auto recording = open_recording(file);
  ASSERT_THAT(recording->streams(), SizeIs(1));
  EXPECT_EQ(recording->streams()[0].rows, expected.size());
  std::vector<int> read;
  for (const TestRow& row : read_rows(*recording, "/fix", {"range"})) read.push_back(int(row.numbers[0] - 10));
  EXPECT_EQ(read, expected);
  EXPECT_THAT(recording->defects(),
              testing::Contains(HasSubstr("the record at byte " + std::to_string(damaged) +
                                          " is damaged; reading goes on at byte " + std::to_string(next))));
}

TEST(Bags, ReadRos1BesideDamage) {
  const ScratchFolder scratch;
#ifdef TANDEM_HAS_LZ4
  const std::string compression = "lz4";
#else
  const std::string compression = "none";
#endif
  auto chunks = bag_chunks(compression);
  const std::string connection = Bag::connection(4, "/fix", "test_msgs/Fix", kFixDefinitionRos1);
  const std::size_t second = Bag::start(0).size() + chunks[0].size(), third = second + chunks[1].size();
  const auto write = [&](std::uint64_t index) {
    return scratch.write("a.bag", Bag::start(index) + chunks[0] + chunks[1] + chunks[2] + connection);
  };
  const std::string whole = chunks[1];
  for (const std::uint64_t index : {std::uint64_t(0), std::uint64_t(third + chunks[2].size())}) {
    chunks[1] = whole;
    chunks[1].replace(0, 4, "\xFF\xFF\x12\x34");  // the length of the header
#ifdef TANDEM_HAS_LZ4
    expect_beside_damage(write(index), {0, 4}, second, third);
#endif
    const std::size_t length = 4 + Bag::fields({{"op", "."}, {"compression", compression}, {"size", "...."}}).size();
    for (const std::uint32_t wrong : {0xFFFFFF00u, std::uint32_t(whole.size() + 20)}) {  // the length of the chunk
      chunks[1] = whole;
      chunks[1].replace(length, 4, bytes(wrong));
      expect_beside_damage(write(index), {0, 1, 2, 3, 4}, second, third);
    }
  }
  // Messages of a chunk that is not compressed are found without its header.
  chunks = bag_chunks("none");
  chunks[1].replace(0, 4, "\xFF\xFF\x12\x34");
  const auto recording = open_recording(write(0));
  EXPECT_THAT(read_rows(*recording, "/fix", {"range"}), SizeIs(5));
}

TEST(Bags, ReadMcapBesideDamage) {
  const ScratchFolder scratch;
  for (const std::string& compression : compressions()) {
    const std::string before = Mcap::start() + mcap_topics() + Mcap::chunk(compression, mcap_messages(0, 1));
    const std::string whole = Mcap::chunk(compression, mcap_messages(1, 4));
    const std::string after = Mcap::chunk(compression, mcap_messages(4, 5)) + Mcap::end();
    const std::size_t second = before.size(), third = second + whole.size();
    std::string chunk = whole;
    if (!compression.empty()) {
      chunk.replace(0, 9, std::string(9, '\0'));
      expect_beside_damage(scratch.write("a.mcap", before + chunk + after), {0, 4}, second, third);
    }
    for (const std::uint64_t wrong : {std::uint64_t(1) << 40, std::uint64_t(whole.size() + 20)}) {
      chunk = whole;
      chunk.replace(1, 8, bytes(wrong));
      expect_beside_damage(scratch.write("a.mcap", before + chunk + after), {0, 1, 2, 3, 4}, second, third);
    }
    expect_beside_damage(scratch.write("a.mcap", before + "\6" + std::string(8, '\xFF') + whole + after),
                         {0, 1, 2, 3, 4}, second, second + 9);
  }
}

TEST(Bags, DamagedBytesNeverCrash) {
  const ScratchFolder scratch;
  const std::string mcap = Mcap::start() + Mcap::chunk("", mcap_topics() + mcap_messages(0, 5)) + Mcap::end();
  const std::string bag = Bag::start(0) + Bag::chunk("none", bag_messages());
  for (const std::string& whole : {mcap, bag})
    for (std::size_t at = 13; at < whole.size(); at += 3) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
      const auto recording = open_recording(scratch.write("damaged.bin", damaged));
      for (const RecordedStream& stream : recording->streams()) {
        std::vector<std::string> fields;
        for (const RecordedField& field : stream.fields) fields.push_back(field.name);
        if (stream.unreadable.empty()) read_rows(*recording, stream.name, fields);
      }
    }
}

}  // namespace
}  // namespace tandem
