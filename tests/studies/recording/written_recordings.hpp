#pragma once

#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <sqlite3.h>
#ifdef TANDEM_HAS_BZIP2
#include <bzlib.h>
#endif
#ifdef TANDEM_HAS_LZ4
#include <lz4frame.h>
#endif
#ifdef TANDEM_HAS_ZSTD
#include <zstd.h>
#endif

/// Writers of small recordings for tests, independent of the readers.
namespace tandem::written {

template <class T>
std::string bytes(T value) {
  std::string raw(sizeof(T), '\0');
  std::memcpy(raw.data(), &value, sizeof(T));
  return raw;
}
inline std::string text32(const std::string& text) { return bytes(std::uint32_t(text.size())) + text; }
inline std::string padded(std::string text, std::size_t size) {
  text.resize(size);
  return text;
}

/// Compresses with "lz4", "zstd" or "bz2"; returns the text itself for "" and unknown names.
inline std::string compressed(const std::string& name, const std::string& data) {
  std::string out(data.size() + 1024, '\0');
#ifdef TANDEM_HAS_LZ4
  if (name == "lz4") {
    out.resize(LZ4F_compressFrameBound(data.size(), nullptr));
    out.resize(LZ4F_compressFrame(out.data(), out.size(), data.data(), data.size(), nullptr));
    return out;
  }
#endif
#ifdef TANDEM_HAS_ZSTD
  if (name == "zstd") {
    out.resize(ZSTD_compress(out.data(), out.size(), data.data(), data.size(), 3));
    return out;
  }
#endif
#ifdef TANDEM_HAS_BZIP2
  if (name == "bz2") {
    auto size = static_cast<unsigned>(out.size());
    std::string input = data;
    BZ2_bzBuffToBuffCompress(out.data(), &size, input.data(), static_cast<unsigned>(input.size()), 9, 0, 0);
    out.resize(size);
    return out;
  }
#endif
  return data;
}

/// Definition of a message with members of several alignments, and its content for a time.
inline const std::string kFixDefinition =
    "# a comment\nint8 LIMIT=5\nstd_msgs/Header header\nuint8 quality\nfloat64 range\nfloat32[] beams\nstring mode\n"
    "int16 count\n================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";
inline const std::string kFixDefinitionRos1 =
    "Header header\nuint8 quality\nfloat64 range\nfloat32[] beams\nstring mode\nint16 count\n================\n"
    "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

/// Little-endian CDR with its alignment.
class Cdr {
 public:
  template <class T>
  Cdr& add(T value) {
    while (body_.size() % sizeof(T) != 0) body_ += '\0';
    body_ += bytes(value);
    return *this;
  }
  Cdr& text(const std::string& text) {
    add(std::uint32_t(text.size() + 1));
    body_ += text + '\0';
    return *this;
  }
  std::string str() const { return std::string("\0\1\0\0", 4) + body_; }

 private:
  std::string body_;
};

inline std::string fix_cdr(double stamp, double range, const std::string& mode = "auto") {
  const auto seconds = static_cast<std::int32_t>(stamp);
  Cdr cdr;
  cdr.add(seconds).add(static_cast<std::uint32_t>((stamp - seconds) * 1e9 + 0.5)).text("base");
  cdr.add(std::uint8_t(3)).add(range).add(std::uint32_t(2)).add(1.5f).add(2.5f).text(mode).add(std::int16_t(-7));
  return cdr.str();
}
inline std::string fix_ros1(double stamp, double range, const std::string& mode = "auto") {
  const auto seconds = static_cast<std::uint32_t>(stamp);
  return bytes(std::uint32_t(0)) + bytes(seconds) + bytes(std::uint32_t((stamp - seconds) * 1e9 + 0.5)) +
         text32("base") + bytes(std::uint8_t(3)) + bytes(range) + bytes(std::uint32_t(2)) + bytes(1.5f) + bytes(2.5f) +
         text32(mode) + bytes(std::int16_t(-7));
}

/// Writes an MCAP file with one chunk of each group of messages.
class Mcap {
 public:
  static std::string record(unsigned char opcode, const std::string& content) {
    return bytes(opcode) + bytes(std::uint64_t(content.size())) + content;
  }
  static std::string start() { return std::string("\x89MCAP0\r\n", 8) + record(1, text32("ros2") + text32("test")); }
  static std::string schema(std::uint16_t id, const std::string& name, const std::string& definition) {
    return record(3, bytes(id) + text32(name) + text32("ros2msg") + text32(definition));
  }
  static std::string channel(std::uint16_t id, std::uint16_t schema, const std::string& topic) {
    return record(4, bytes(id) + bytes(schema) + text32(topic) + text32("cdr") + bytes(std::uint32_t(0)));
  }
  static std::string message(std::uint16_t channel, double t, const std::string& data) {
    const auto ns = static_cast<std::uint64_t>(t * 1e9 + 0.5);
    return record(5, bytes(channel) + bytes(std::uint32_t(0)) + bytes(ns) + bytes(ns) + data);
  }
  static std::string chunk(const std::string& compression, const std::string& records) {
    const std::string data = compressed(compression, records);
    return record(6, bytes(std::uint64_t(0)) + bytes(std::uint64_t(0)) + bytes(std::uint64_t(records.size())) +
                         bytes(std::uint32_t(0)) + text32(compression) + bytes(std::uint64_t(data.size())) + data);
  }
  static std::string end() {
    return record(15, bytes(std::uint32_t(0))) + record(2, std::string(20, '\0')) + start().substr(0, 8);
  }
};

/// Writes records of a ROS 1 bag.
class Bag {
 public:
  using Fields = std::vector<std::pair<std::string, std::string>>;
  static std::string fields(const Fields& all) {
    std::string text;
    for (const auto& [name, value] : all) text += text32(name + "=" + value);
    return text;
  }
  static std::string record(const Fields& header, const std::string& data) {
    return text32(fields(header)) + text32(data);
  }
  static std::string op(unsigned char code) { return bytes(code); }
  /// `index`: byte of the index; 0 for a bag without one.
  static std::string start(std::uint64_t index) {
    return "#ROSBAG V2.0\n" + record({{"op", op(3)},
                                      {"index_pos", bytes(index)},
                                      {"conn_count", bytes(std::uint32_t(1))},
                                      {"chunk_count", bytes(std::uint32_t(1))}},
                                     "");
  }
  static std::string connection(std::uint32_t id, const std::string& topic, const std::string& type,
                                const std::string& definition) {
    return record({{"op", op(7)}, {"conn", bytes(id)}, {"topic", topic}},
                  fields({{"topic", topic}, {"type", type}, {"message_definition", definition}}));
  }
  static std::string time(double t) {
    const auto seconds = static_cast<std::uint32_t>(t);
    return bytes(seconds) + bytes(std::uint32_t((t - seconds) * 1e9 + 0.5));
  }
  static std::string message(std::uint32_t connection, double t, const std::string& data) {
    return record({{"op", op(2)}, {"conn", bytes(connection)}, {"time", time(t)}}, data);
  }
  static std::string chunk(const std::string& compression, const std::string& records) {
    return record({{"op", op(5)}, {"compression", compression}, {"size", bytes(std::uint32_t(records.size()))}},
                  compressed(compression, records));
  }
};

/// Writes a ROS 2 bag of SQLite.
inline void write_db3(const std::string& file, const std::string& type, const std::string& definition,
                      const std::vector<std::pair<double, std::string>>& messages) {
  sqlite3* db = nullptr;
  sqlite3_open(file.c_str(), &db);
  const auto run = [&](const std::string& sql) { sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr); };
  run("BEGIN");  // one transaction; each would wait for the disk
  run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, "
      "offered_qos_profiles TEXT)");
  run("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)");
  if (!definition.empty()) {
    run("CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT, "
        "encoded_message_definition TEXT, type_description_hash TEXT)");
    run("INSERT INTO message_definitions VALUES(1,'" + type + "','ros2msg','" + definition + "','')");
  }
  run("INSERT INTO topics VALUES(1,'/fix','" + type + "','cdr','')");
  sqlite3_stmt* insert = nullptr;
  sqlite3_prepare_v2(db, "INSERT INTO messages(topic_id,timestamp,data) VALUES(1,?,?)", -1, &insert, nullptr);
  for (const auto& [t, data] : messages) {
    sqlite3_bind_int64(insert, 1, static_cast<sqlite3_int64>(t * 1e9));
    sqlite3_bind_blob(insert, 2, data.data(), static_cast<int>(data.size()), SQLITE_TRANSIENT);
    sqlite3_step(insert);
    sqlite3_reset(insert);
  }
  sqlite3_finalize(insert);
  run("COMMIT");
  sqlite3_close(db);
}

/// Messages of an ArduPilot log.
inline std::string dataflash_format(unsigned char id, std::size_t size, const std::string& name,
                                    const std::string& format, const std::string& columns) {
  return std::string("\xA3\x95\x80", 3) + bytes(id) + bytes(static_cast<unsigned char>(size)) + padded(name, 4) +
         padded(format, 16) + padded(columns, 64);
}
inline std::string dataflash_message(unsigned char id, const std::string& body) {
  return std::string("\xA3\x95", 2) + bytes(id) + body;
}

/// A message of a PX4 log.
inline std::string ulog_message(char type, const std::string& content) {
  return bytes(std::uint16_t(content.size())) + type + content;
}
inline std::string ulog_start() { return std::string("ULog\x01\x12\x35\x01", 8) + bytes(std::uint64_t(0)); }

}  // namespace tandem::written
