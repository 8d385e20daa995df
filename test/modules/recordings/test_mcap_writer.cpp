#include <catch2/catch.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "modules/core/input_file.hpp"
#include "modules/recordings/mcap_reader.hpp"
#include "modules/recordings/mcap_writer.hpp"
#include "test/modules/recordings/bag_contents.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

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

TEST_CASE("MCAP files are to the byte those of the conformance suite", "[recordings]") {
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

TEST_CASE("A file cut at any byte gives the chunks before the cut", "[recordings]") {
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
    McapReader reader(folder.write("a.mcap", file.bytes.substr(0, size)));
    const auto read = topic_messages_of(reader);
    CAPTURE(size);
    REQUIRE(read.size() >= messages);
    REQUIRE(read.size() <= at_most);
    REQUIRE(read == by_time({file.messages.begin(),
                             file.messages.begin() + static_cast<std::ptrdiff_t>(read.size())}));
    REQUIRE(reader.report().count(BagFault::kTruncated) > 0);
  }
  McapReader whole(folder.write("a.mcap", file.bytes));
  for (const BagChannel& channel : whole.channels()) CHECK(channel.message_count == 10);
  CHECK(topic_messages_of(whole) == by_time(file.messages));
  CHECK(to_string(whole.report()).empty());
}

TEST_CASE("Attachments are read as they were written, or refused", "[recordings]") {
  std::string bytes = file_of({numbered(1, 5)}, true);
  const TemporaryFolder folder;
  CHECK(read_mcap_attachments(folder.write("a.mcap", bytes)) ==
        std::map<std::string, std::string>{{"myFile", "\1\2\3"}});
  const std::size_t name = bytes.find("myFile");
  CHECK(read_mcap_attachments(folder.write("a.mcap", bytes.substr(0, name))).empty());
  bytes[name] = 'M';
  CHECK_THROWS_WITH(read_mcap_attachments(folder.write("a.mcap", bytes)),
                    Catch::Contains("an attachment that is damaged"));
  CHECK_THROWS_AS(read_mcap_attachments(folder.write("a.mcap", "#ROSBAG")), InputFileError);
}

}  // namespace km
