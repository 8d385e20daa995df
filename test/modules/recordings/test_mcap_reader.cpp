#include <catch2/catch.hpp>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "modules/core/input_file.hpp"
#include "modules/core/json.hpp"
#include "modules/recordings/mcap_reader.hpp"
#include "test/modules/recordings/listed_sum.hpp"
#include "test/modules/recordings/mcap_file.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Fields of a record of the conformance suite by name; numbers are strings there.
struct ListedRecord {
  explicit ListedRecord(const Json& record) : type(record.at("type")) {
    for (const Json& field : record.at("fields")) fields[field.at(0)] = field.at(1);
  }
  [[nodiscard]] std::int64_t number(const std::string& name) const {
    return std::stoll(fields.at(name).get<std::string>());
  }
  [[nodiscard]] std::string text(const std::string& name) const { return fields.at(name); }

  std::string type;
  std::map<std::string, Json> fields;
};

struct Listed {
  std::vector<TopicMessage> messages;
  std::size_t channels = 0;
};

// Messages of a file according to the suite, in order of time.
Listed listed_in(const fs::path& file) {
  Listed listed;
  std::map<std::int64_t, std::string> types;
  std::map<std::int64_t, ListedRecord> channels;
  const Json document = read_json(file);
  for (const Json& json : document.at("records")) {
    const ListedRecord record(json);
    if (record.type == "DataEnd") break;
    if (record.type == "Schema") types[record.number("id")] = record.text("name");
    if (record.type == "Channel") channels.emplace(record.number("id"), record);
    if (record.type != "Message") continue;
    const ListedRecord& channel = channels.at(record.number("channel_id"));
    TopicMessage message{.topic = channel.text("topic"),
                         .type = types.at(channel.number("schema_id")),
                         .encoding = channel.text("message_encoding"),
                         .log_time = record.number("log_time"),
                         .bytes = {}};
    for (const Json& byte : record.fields.at("data"))
      message.bytes.push_back(static_cast<std::uint8_t>(std::stoi(byte.get<std::string>())));
    listed.messages.push_back(std::move(message));
  }
  std::stable_sort(listed.messages.begin(), listed.messages.end(),
                   [](const auto& a, const auto& b) { return a.log_time < b.log_time; });
  listed.channels = channels.size();
  return listed;
}

std::vector<McapFile::Message> numbered_messages(std::size_t count, Stamp first) {
  std::vector<McapFile::Message> messages;
  for (std::size_t i = 0; i < count; ++i)
    messages.push_back({.channel = static_cast<std::uint16_t>(1 + i % 2),
                        .log_time = first + static_cast<Stamp>(i),
                        .bytes = std::vector(i % 50, static_cast<std::uint8_t>(i))});
  return messages;
}

// Two chunks that overlap in time, and two messages outside of them: 42 in all.
McapFile mixed_file(const McapFile::Options& options) {
  McapFile file(options);
  file.add_chunk(numbered_messages(20, 1000), 1000);
  file.add({.channel = 1, .log_time = 1005, .bytes = {1}});
  file.add_chunk(numbered_messages(20, 990), 990);
  file.add({.channel = 2, .log_time = 5, .bytes = {2}});
  return file;
}

}  // namespace

TEST_CASE("Every file of the MCAP conformance suite gives the messages that are listed",
          "[recordings]") {
  const auto folder = shared_data("ros_recordings/mcap/conformance");
  if (!folder) return;
  std::size_t files = 0;
  std::size_t messages = 0;
  for (const auto& entry : fs::recursive_directory_iterator(*folder)) {
    if (entry.path().extension() != ".mcap") continue;
    CAPTURE(entry.path().string());
    ++files;
    const Listed listed = listed_in(fs::path(entry.path()).replace_extension(".json"));
    McapReader reader(entry.path());
    CHECK(reader.channels().size() == listed.channels);
    std::uint64_t count = 0;
    for (const BagChannel& channel : reader.channels()) count += channel.message_count;
    CHECK(count == listed.messages.size());
    const auto read = topic_messages_of(reader);
    CHECK(read == listed.messages);
    CHECK(to_string(reader.report()) == "");
    messages += read.size();
  }
  CHECK(files == 342);
  CHECK(messages == 1694);
}

TEST_CASE("A recording of rosbag2 with zstd is read whole", "[recordings]") {
  const auto file = shared_data("ros_recordings/mcap/nav2_turtlebot.mcap");
  if (!file) return;
  McapReader summed(*file);
  // A message in the chunk that the program zstd decompresses.
  CHECK(sum_of(summed) == ListedSum{8197, 0x100de38bbb1b});
  McapReader reader(*file);
  const auto messages = messages_of(reader);
  check_order(messages);
  std::map<std::string, std::uint64_t> counts;
  for (const BagMessage& message : messages) ++counts[reader.channels()[message.channel].topic];
  for (const BagChannel& channel : reader.channels()) {
    CAPTURE(channel.topic);
    CHECK(channel.encoding == "cdr");
    CHECK(counts[channel.topic] == channel.message_count);
  }
  CHECK(to_string(reader.report()) == "");
}

TEST_CASE("Messages in and outside of chunks come in one order of time", "[recordings]") {
  McapFile::Options options;
  options.compression = GENERATE("", "lz4", "zstd");
  options.has_crc = GENERATE(true, false);
  options.has_summary = GENERATE(true, false);
  options.repeats_channels = GENERATE(true, false);
  CAPTURE(options.compression, options.has_crc, options.has_summary, options.repeats_channels);
  const TemporaryFolder folder;
  McapReader reader(folder.write("a.mcap", mixed_file(options).finish()));
  REQUIRE(reader.channels().size() == 2);
  CHECK(reader.channels()[0].topic == "/imu1");
  CHECK(reader.channels()[0].type == "sensor_msgs/msg/Imu");
  CHECK(reader.channels()[0].message_count == 21);
  CHECK(reader.channels()[1].message_count == 21);
  const auto messages = messages_of(reader);
  check_order(messages);
  REQUIRE(messages.size() == 42);
  CHECK(messages.front().log_time == 5);
  CHECK(messages.front().channel == 1);
  CHECK(messages.front().bytes == std::vector<std::uint8_t>{2});
  CHECK(messages[1].log_time == 990);
  CHECK(to_string(reader.report()) == "");
}

TEST_CASE("A chunk with another checksum than it states is lost with its place", "[recordings]") {
  const bool has_summary = GENERATE(true, false);
  McapFile file({.compression = "", .has_summary = has_summary});
  file.add_chunk({{.channel = 1, .log_time = 1, .bytes = {'f', 'i', 'n', 'd'}}}, 1);
  file.add_chunk({{.channel = 1, .log_time = 2, .bytes = {'k', 'e', 'p', 't'}}}, 2);
  std::string bytes = file.finish();
  bytes[bytes.find("find")] ^= 1;
  const TemporaryFolder folder;
  const fs::path path = folder.write("a.mcap", bytes);
  McapReader reader(path);
  CHECK(messages_of(reader).size() == 1);
  const BagReport report = reader.report();
  REQUIRE(report.count(BagFault::kChecksum) == 1);
  CHECK_THAT(report.entries().at(BagFault::kChecksum).first,
             Catch::StartsWith(path.string() + " byte "));
  // Messages outside of chunks are checked by the checksum of the data.
  McapFile bare({});
  bare.add({.channel = 1, .log_time = 1, .bytes = {'f', 'i', 'n', 'd'}});
  bytes = bare.finish();
  bytes[bytes.find("find")] ^= 1;
  McapReader other(folder.write("b.mcap", bytes));
  CHECK(messages_of(other).size() == 1);
  CHECK(other.report().count(BagFault::kChecksum) == 1);
}

TEST_CASE("Messages are dropped if the index states too late a time for their chunk",
          "[recordings]") {
  McapFile file({});
  file.add_chunk(numbered_messages(10, 100), 100);
  file.add_chunk(numbered_messages(10, 95), 105);
  const TemporaryFolder folder;
  McapReader reader(folder.write("a.mcap", file.finish()));
  const auto messages = messages_of(reader);
  check_order(messages);
  CHECK(reader.report().count(BagFault::kUnordered) == 9);
  CHECK(messages.size() == 11);
}

TEST_CASE("Chunks that decompress to far more than the file are left out and reported",
          "[recordings]") {
  McapFile file({.compression = "zstd", .has_crc = false});
  const McapFile::Bytes zeros(std::size_t{40} << 20U);
  for (const Stamp stamp : {1, 2})
    file.add_chunk({{.channel = 1, .log_time = stamp, .bytes = zeros}}, stamp);
  const TemporaryFolder folder;
  const fs::path path = folder.write("a.mcap", file.finish());
  REQUIRE(fs::file_size(path) < 20000);
  McapReader reader(path);
  CHECK(messages_of(reader).size() == 1);
  REQUIRE(reader.report().count(BagFault::kCompression) == 1);
  CHECK_THAT(reader.report().entries().at(BagFault::kCompression).first,
             Catch::StartsWith(path.string() + " byte ") &&
                 Catch::Contains("more than 64 MiB and 250 times the file"));
}

TEST_CASE("Corrupted MCAP files are refused or read in order", "[recordings]") {
  McapFile::Options options;
  options.compression = GENERATE("", "lz4", "zstd");
  options.has_crc = GENERATE(true, false);
  const TemporaryFolder folder;
  check_corrupted<InputFileError>(mixed_file(options).finish(), folder.path().string(),
                                  [&](const std::string& bytes) {
                                    McapReader reader(folder.write("a.mcap", bytes));
                                    check_order(messages_of(reader));
                                    const BagReport report = reader.report();
                                    for (const auto& [fault, entry] : report.entries())
                                      CHECK(entry.first.find("a.mcap byte ") != entry.first.npos);
                                  });
}

TEST_CASE("A file that is no MCAP file is refused by name", "[recordings]") {
  check_no_files<InputFileError>(".mcap", [](const fs::path& path) { McapReader{path}; });
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(McapReader(folder.write("a.mcap", "#ROSBAG V2.0\n")),
                    Catch::Contains("a.mcap byte 0: does not begin as MCAP files"));
  CHECK_THROWS_AS(McapReader(folder.write("b.mcap", "")), InputFileError);
}

}  // namespace km
