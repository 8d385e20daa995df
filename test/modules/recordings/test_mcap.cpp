#include <nlohmann/json.hpp>

#include "modules/core/io/input_file.hpp"
#include "modules/core/io/json.hpp"
#include "modules/recordings/mcap_writer.hpp"
#include "modules/recordings/open_bag.hpp"
#include "test/modules/recordings/listed_sum.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

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

std::string text_of(const std::vector<std::uint8_t>& bytes) {
  return {bytes.begin(), bytes.end()};
}

// All in one chunk, as the conformance suite has them.
std::string file_of(const std::vector<McapMessage>& messages, bool has_attachment = false) {
  McapWriter writer({.profile = "", .library = "", .compression = ""});
  const auto channel = writer.add_channel(
      {.topic = "example", .message_encoding = "a", .metadata = {{"foo", "bar"}}},
      {.name = "Example", .encoding = "c", .data = "\4\5\6"});
  const std::vector<std::uint8_t> data = {1, 2, 3};
  for (McapMessage message : messages) {
    message.channel_id = channel;
    writer.add(message, data);
  }
  if (has_attachment)
    writer.attach({.log_time = 2,
                   .create_time = 1,
                   .name = "myFile",
                   .media_type = "application/octet-stream",
                   .data = data});
  writer.finish();
  return text_of(writer.take());
}

McapMessage numbered(std::uint32_t sequence, Stamp time) {
  return {.sequence = sequence, .log_time = time, .publish_time = time};
}

// Two channels of one type and one of another; times go up and down.
struct SmallFile {
  std::string bytes;
  std::vector<TopicMessage> messages;   // in order of the file
  std::vector<std::size_t> chunk_ends;  // [bytes]
  std::vector<std::size_t> chunk_messages;
};

SmallFile small_file(const std::string& compression) {
  McapWriter writer({.compression = compression, .chunk_bytes = 400});
  SmallFile file;
  std::vector<std::uint16_t> ids;
  const auto taken = [&] { return text_of(writer.take()); };
  const std::vector<std::pair<std::string, std::string>> kinds = {
      {"/a/pose", "p"}, {"/b/pose", "p"}, {"/log", "l"}};
  for (const auto& [topic, type] : kinds)
    ids.push_back(writer.add_channel({.topic = topic, .message_encoding = "cdr"},
                                     {.name = type, .encoding = "ros2msg", .data = "float64 x"}));
  std::size_t in_chunk = 0;
  for (std::uint32_t k = 0; k < 30; ++k) {
    const auto time = static_cast<Stamp>(1000 + 10 * k - 25 * (k % 3));
    const std::vector<std::uint8_t> data(k, static_cast<std::uint8_t>(k));
    const auto& [topic, type] = kinds[k % 3];
    file.messages.push_back({topic, type, "cdr", time, data});
    writer.add({.channel_id = ids[k % 3], .sequence = k, .log_time = time, .publish_time = time},
               data);
    ++in_chunk;
    file.bytes += taken();
    if (file.chunk_ends.empty() ? file.bytes.size() > 100
                                : file.bytes.size() > file.chunk_ends.back()) {
      file.chunk_ends.push_back(file.bytes.size());
      file.chunk_messages.push_back(std::exchange(in_chunk, 0));
    }
  }
  writer.end_chunk();
  file.bytes += taken();
  file.chunk_ends.push_back(file.bytes.size());
  file.chunk_messages.push_back(in_chunk);
  writer.finish();
  file.bytes += taken();
  return file;
}

std::vector<TopicMessage> by_time(std::vector<TopicMessage> messages) {
  std::ranges::stable_sort(messages, {}, &TopicMessage::log_time);
  return messages;
}

}  // namespace

TEST_CASE("Every file of the MCAP conformance suite gives the messages that are listed") {
  const auto folder = shared_data("ros_recordings/mcap/conformance");
  if (!folder) return;
  std::size_t files = 0;
  std::size_t messages = 0;
  for (const auto& entry : fs::recursive_directory_iterator(*folder)) {
    if (entry.path().extension() != ".mcap") continue;
    CAPTURE(entry.path().string());
    ++files;
    const Listed listed = listed_in(fs::path(entry.path()).replace_extension(".json"));
    const auto reader = open_mcap(entry.path());
    CHECK(reader->channels().size() == listed.channels);
    std::uint64_t count = 0;
    for (const BagChannel& channel : reader->channels()) count += channel.message_count;
    CHECK(count == listed.messages.size());
    const auto read = topic_messages_of(*reader);
    CHECK(read == listed.messages);
    CHECK(to_string(reader->report()) == "");
    messages += read.size();
  }
  CHECK(files == 342);
  CHECK(messages == 1694);
}

TEST_CASE("A recording of rosbag2 with zstd is read whole") {
  const auto file = shared_data("ros_recordings/mcap/nav2_turtlebot.mcap");
  if (!file) return;
  const auto summed = open_mcap(*file);
  // A message in the chunk that the program zstd decompresses.
  CHECK(sum_of(*summed) == ListedSum{8197, 0x100de38bbb1b});
  const auto reader = open_mcap(*file);
  const auto messages = messages_of(*reader);
  check_order(messages);
  std::map<std::string, std::uint64_t> counts;
  for (const BagMessage& message : messages) ++counts[reader->channels()[message.channel].topic];
  for (const BagChannel& channel : reader->channels()) {
    CAPTURE(channel.topic);
    CHECK(channel.encoding == "cdr");
    CHECK(counts[channel.topic] == channel.message_count);
  }
  CHECK(to_string(reader->report()) == "");
}

TEST_CASE("MCAP files are to the byte those of the conformance suite") {
  const auto folder = shared_data("ros_recordings/mcap/conformance");
  if (!folder) return;
  std::vector<McapMessage> ten;
  const std::vector<Stamp> times = {0, 2, 1, 3, 3, 5, 4, 7, 8, 9};
  for (std::uint32_t k = 0; k < 10; ++k) ten.push_back(numbered(k, times[k]));
  const auto [name, bytes] = GENERATE_COPY(table<std::string, std::string>(
      {{"NoData/NoData-st-sum", file_of({})},
       {"OneMessage/OneMessage-ch-chx-mx-rch-rsh-st-sum",
        file_of({{.sequence = 10, .log_time = 2, .publish_time = 1}})},
       {"OneAttachment/OneAttachment-ax-st-sum", file_of({}, true)},
       {"TenMessages/TenMessages-ch-chx-mx-rch-rsh-st-sum", file_of(ten)}}));
  CAPTURE(name);
  CHECK(bytes == read_input_file(*folder / (name + ".mcap")));
}

TEST_CASE("A file cut at any byte gives the chunks before the cut") {
  const std::string compression = GENERATE("", "zstd");
  CAPTURE(compression);
  const SmallFile file = small_file(compression);
  REQUIRE(file.chunk_ends.size() > 3);
  const TemporaryFolder folder;
  for (std::size_t size = 8; size < file.bytes.size(); ++size) {
    std::size_t messages = 0;
    // A chunk is whole before its indexes are, which are not needed.
    std::size_t at_most = 0;
    for (std::size_t k = 0; k < file.chunk_ends.size(); ++k) {
      if (size >= file.chunk_ends[k]) messages += file.chunk_messages[k];
      if (k == 0 || size >= file.chunk_ends[k - 1]) at_most += file.chunk_messages[k];
    }
    const auto reader = open_mcap(folder.write("a.mcap", file.bytes.substr(0, size)));
    const auto read = topic_messages_of(*reader);
    CAPTURE(size);
    REQUIRE(read.size() >= messages);
    REQUIRE(read.size() <= at_most);
    REQUIRE(read == by_time({file.messages.begin(),
                             file.messages.begin() + static_cast<std::ptrdiff_t>(read.size())}));
    REQUIRE(reader->report().count(BagFault::kTruncated) > 0);
  }
  const auto whole = open_mcap(folder.write("a.mcap", file.bytes));
  for (const BagChannel& channel : whole->channels()) CHECK(channel.message_count == 10);
  CHECK(topic_messages_of(*whole) == by_time(file.messages));
  CHECK(to_string(whole->report()).empty());
}

TEST_CASE("Attachments are read as they were written, or refused") {
  std::string bytes = file_of({numbered(1, 5)}, true);
  const TemporaryFolder folder;
  CHECK(read_mcap_attachments(folder.write("a.mcap", bytes)) ==
        std::map<std::string, std::string>{{"myFile", "\1\2\3"}});
  const std::size_t name = bytes.find("myFile");
  CHECK(read_mcap_attachments(folder.write("a.mcap", bytes.substr(0, name))).empty());
  bytes[name] = 'M';
  CHECK_THROWS_WITH(read_mcap_attachments(folder.write("a.mcap", bytes)),
                    Contains("an attachment that is damaged"));
  CHECK_THROWS_AS(read_mcap_attachments(folder.write("a.mcap", "#ROSBAG")), InputFileError);
}

TEST_CASE("A chunk with another checksum than it states is lost with its place") {
  const TemporaryFolder folder;
  SmallFile file = small_file("");
  file.bytes[file.bytes.find(std::string(29, 29))] ^= 1;
  const fs::path path = folder.write("a.mcap", file.bytes);
  const auto reader = open_mcap(path);
  CHECK(messages_of(*reader).size() == file.messages.size() - file.chunk_messages.back());
  const BagReport report = reader->report();
  REQUIRE(report.count(BagFault::kChecksum) == 1);
  CHECK_THAT(report.entries().at(BagFault::kChecksum).first, StartsWith(path.string() + " byte "));
  // Messages outside of chunks are checked by the checksum of the data.
  ByteWriter bare;
  const std::vector<std::uint8_t> magic(kMcapMagic.begin(), kMcapMagic.end());
  bare.bytes(magic);
  put_mcap(bare, McapHeader{});
  put_mcap(bare, McapChannel{.id = 1, .topic = "a", .message_encoding = "b"});
  put_mcap(bare, McapMessage{.channel_id = 1, .log_time = 1}, magic);
  const auto data = bare.release();
  bare.bytes(data);
  put_mcap(bare, McapDataEnd{mcap_crc(data) ^ 1U});
  put_mcap(bare, McapFooter{});
  bare.bytes(magic);
  const auto other = open_mcap(folder.write("b.mcap", text_of(bare.release())));
  CHECK(messages_of(*other).size() == 1);
  CHECK(other->report().count(BagFault::kChecksum) == 1);
}

TEST_CASE("Chunks that decompress to far more than the file are left out and reported") {
  McapWriter writer({});
  const auto channel = writer.add_channel({.topic = "a", .message_encoding = "b"}, {});
  const std::vector<std::uint8_t> zeros(std::size_t{40} << 20U);
  for (const Stamp stamp : {1, 2}) writer.add({.channel_id = channel, .log_time = stamp}, zeros);
  writer.finish();
  const TemporaryFolder folder;
  const fs::path path = folder.write("a.mcap", text_of(writer.take()));
  REQUIRE(fs::file_size(path) < 20000);
  const auto reader = open_mcap(path);
  CHECK(messages_of(*reader).size() == 1);
  REQUIRE(reader->report().count(BagFault::kCompression) == 1);
  CHECK_THAT(
      reader->report().entries().at(BagFault::kCompression).first,
      StartsWith(path.string() + " byte ") && Contains("more than 64 MiB and 250 times the file"));
}

TEST_CASE("Corrupted MCAP files are refused or read in order") {
  const TemporaryFolder folder;
  const std::string good = small_file(GENERATE("", "zstd")).bytes;
  check_corrupted<InputFileError>(good, folder.path().string(), [&](const std::string& bytes) {
    const auto reader = open_mcap(folder.write("a.mcap", bytes));
    check_order(messages_of(*reader));
    const BagReport report = reader->report();
    for (const auto& [fault, entry] : report.entries())
      CHECK(entry.first.find("a.mcap byte ") != entry.first.npos);
  });
}

TEST_CASE("A file that is no MCAP file is refused by name") {
  check_no_files<InputFileError>(".mcap", [](const fs::path& path) { (void)open_mcap(path); });
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(open_mcap(folder.write("a.mcap", "#ROSBAG V2.0\n")),
                    Contains("a.mcap byte 0: does not begin as MCAP files"));
}

}  // namespace km
