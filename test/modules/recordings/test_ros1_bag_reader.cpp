#include "modules/core/io/bytes.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/recordings/open_bag.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "test/modules/recordings/listed_sum.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Writes small bags after the specification, without compression.
class BagFile {
 public:
  struct Message {
    std::uint32_t connection = 0;  // 0 or 1
    std::uint32_t seconds = 0;
    Bytes bytes;
  };

  BagFile() { file_.bytes(octets("#ROSBAG V2.0\n")); }

  void add_chunk(const std::vector<Message>& messages) {
    ByteWriter records;
    std::array<std::uint32_t, 2> counts{};
    std::uint32_t first = messages.front().seconds;
    for (const std::uint32_t id : kConnections) put_connection(records, id);
    for (const auto& [connection, seconds, bytes] : messages) {
      put(records, fields({{"op", {2}}, {"conn", u32(connection)}, {"time", time(seconds)}}),
          bytes);
      ++counts[connection];
      first = std::min(first, seconds);
    }
    const Bytes data = records.release();
    chunks_.push_back({chunk_bytes_.size(), first, counts});
    put(chunk_bytes_,
        fields({{"op", {5}}, {"compression", octets("none")}, {"size", u32(data.size())}}), data);
  }

  [[nodiscard]] std::string finish(bool has_index) {
    const Bytes chunks = chunk_bytes_.release();
    const std::uint64_t begin = file_.size() + kHeaderRecord_bytes;
    const Bytes header = fields({{"op", {3}},
                                 {"index_pos", u64(has_index ? begin + chunks.size() : 0)},
                                 {"conn_count", u32(2)},
                                 {"chunk_count", u32(chunks_.size())}});
    put(file_, header, Bytes(kHeaderRecord_bytes - 8 - header.size(), ' '));
    file_.bytes(chunks);
    if (has_index) put_index(begin);
    const Bytes whole = file_.release();
    return {whole.begin(), whole.end()};
  }

 private:
  static constexpr std::array<std::uint32_t, 2> kConnections = {0, 1};
  static constexpr std::size_t kHeaderRecord_bytes = 4096;

  struct ChunkPlaced {
    std::uint64_t begin;
    std::uint32_t first;
    std::array<std::uint32_t, 2> counts;
  };

  static Bytes octets(const std::string& text) { return {text.begin(), text.end()}; }
  static Bytes u64(std::uint64_t value) {
    ByteWriter out;
    out.u64(value);
    return out.release();
  }
  static Bytes u32(std::uint64_t value) {
    Bytes bytes = u64(value);
    bytes.resize(4);
    return bytes;
  }
  static Bytes time(std::uint32_t seconds) { return u64(seconds); }  // and no nanoseconds
  static Bytes fields(const std::vector<std::pair<std::string, Bytes>>& all) {
    ByteWriter out;
    for (const auto& [name, value] : all) {
      out.bytes(u32(name.size() + 1 + value.size()));
      out.bytes(octets(name + '='));
      out.bytes(value);
    }
    return out.release();
  }
  static void put(ByteWriter& out, const Bytes& header, const Bytes& data) {
    for (const Bytes* part : {&header, &data}) {
      out.bytes(u32(part->size()));
      out.bytes(*part);
    }
  }
  static void put_connection(ByteWriter& out, std::uint32_t id) {
    put(out,
        fields({{"op", {7}}, {"conn", u32(id)}, {"topic", octets("/imu" + std::to_string(id))}}),
        fields({{"topic", octets("/imu")}, {"type", octets("sensor_msgs/Imu")}}));
  }
  void put_index(std::uint64_t chunks_begin) {
    for (const std::uint32_t id : kConnections) put_connection(file_, id);
    for (const ChunkPlaced& chunk : chunks_) {
      ByteWriter counts;
      for (const std::uint32_t id : kConnections) {
        counts.u32(id);
        counts.u32(chunk.counts[id]);
      }
      put(file_,
          fields({{"op", {6}},
                  {"ver", u32(1)},
                  {"chunk_pos", u64(chunks_begin + chunk.begin)},
                  {"start_time", time(chunk.first)},
                  {"end_time", time(chunk.first)},
                  {"count", u32(2)}}),
          counts.release());
    }
  }

  ByteWriter file_;
  ByteWriter chunk_bytes_;
  std::vector<ChunkPlaced> chunks_;
};

// Twelve messages in three chunks that overlap in time.
std::string small_bag(bool has_index) {
  BagFile file;
  for (std::uint32_t chunk = 0; chunk < 3; ++chunk) {
    std::vector<BagFile::Message> messages;
    for (std::uint32_t i = 0; i < 4; ++i)
      messages.push_back({.connection = i % 2,
                          .seconds = 100 - 10 * chunk + 7 * i,
                          .bytes = {static_cast<std::uint8_t>(4 * chunk + i)}});
    file.add_chunk(messages);
  }
  return file.finish(has_index);
}

}  // namespace

TEST_CASE("Bags of ROS 1 give the same messages as ROS' own reader") {
  struct Known {
    const char* file;
    ListedSum sum;  // result of Debian's python3-rosbag 1.15
    std::size_t topics;
  };
  const Known known = GENERATE(Known{"ROS_example.bag", {26566, 0x33da0a80b6c3}, 3},
                               Known{"example.bag", {8647, 0x10ddf7d3108e}, 9},
                               Known{"example-bz2.bag", {8647, 0x10ddf7d3108e}, 9},
                               Known{"example-lz4.bag", {8647, 0x10ddf7d3108e}, 9},
                               Known{"example-unsorted-chunks.bag", {3, 0x16c97e68a}, 1},
                               Known{"no-messages.bag", {0, 0}, 0},
                               Known{"tf_example.bag", {518, 0x1044f91edf5}, 2},
                               Known{"tilt_laser.bag", {4093, 0x7f5b5e52090}, 9});
  CAPTURE(known.file);
  const auto file = shared_data(std::string("ros_recordings/rosbag1/") + known.file);
  if (!file) return;
  const auto summed = open_ros1_bag(*file);
  CHECK(sum_of(*summed) == known.sum);
  CHECK(to_string(summed->report()) == "");

  const auto reader = open_ros1_bag(*file);
  CHECK(reader->channels().size() == known.topics);
  const auto messages = messages_of(*reader);
  check_order(messages);
  std::vector<std::uint64_t> counts(reader->channels().size());
  for (const BagMessage& message : messages) ++counts[message.channel];
  for (std::size_t i = 0; i < counts.size(); ++i)
    CHECK(counts[i] == reader->channels()[i].message_count);
}

TEST_CASE("A bag is read the same with and without an index") {
  const bool has_index = GENERATE(true, false);
  const TemporaryFolder folder;
  const auto reader = open_ros1_bag(folder.write("a.bag", small_bag(has_index)));
  REQUIRE(reader->channels().size() == 2);
  CHECK(reader->channels()[1].topic == "/imu1");
  CHECK(reader->channels()[1].type == "sensor_msgs/Imu");
  CHECK(reader->channels()[1].encoding == "ros1");
  CHECK(reader->channels()[1].message_count == 6);
  std::vector<std::uint8_t> order;
  for (const BagMessage& message : messages_of(*reader)) order.push_back(message.bytes.at(0));
  // 80, 87, 90, 94, 97, 100, 101, 104, 107, 111, 114, 121 s
  CHECK(order == std::vector<std::uint8_t>{8, 9, 4, 10, 5, 0, 11, 6, 1, 7, 2, 3});
  CHECK(reader->report().count(BagFault::kIndex) == (has_index ? 0 : 1));
}

TEST_CASE("The complete chunks of a truncated bag are read") {
  const std::string whole = small_bag(GENERATE(true, false));
  const TemporaryFolder folder;
  std::size_t before = 0;
  for (std::size_t size = 4200; size < whole.size(); size += 7) {
    CAPTURE(size);
    const auto reader = open_ros1_bag(folder.write("a.bag", whole.substr(0, size)));
    const auto messages = messages_of(*reader);
    check_order(messages);
    CHECK(messages.size() % 4 == 0);
    CHECK(messages.size() >= before);
    CHECK(reader->report().count(BagFault::kIndex) == 1);
    before = messages.size();
  }
  CHECK(before >= 8);
}

TEST_CASE("Corrupted bags are refused or read in order") {
  const std::string recorded = GENERATE("", "tf_example.bag", "no-messages.bag");
  const auto file = shared_data("ros_recordings/rosbag1/" + recorded);
  if (!file) return;
  const TemporaryFolder folder;
  const std::string bag =
      recorded.empty() ? small_bag(GENERATE(true, false)) : read_input_file(*file);
  check_corrupted<InputFileError>(bag, folder.path().string(), [&](const std::string& bytes) {
    const auto reader = open_ros1_bag(folder.write("a.bag", bytes));
    check_order(messages_of(*reader));
    const BagReport report = reader->report();
    for (const auto& [fault, entry] : report.entries())
      CHECK(entry.first.find("a.bag byte ") != entry.first.npos);
  });
}

TEST_CASE("A file that is no bag of version 2 is refused by name") {
  check_no_files<InputFileError>(".bag", [](const fs::path& path) { (void)open_ros1_bag(path); });
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(open_ros1_bag(folder.write("a.bag", "#ROSBAG V1.2\n")),
                    Contains("a.bag byte 0: does not begin as bags of version 2.0"));
  CHECK_THROWS_WITH(open_ros1_bag(folder.write("b.bag", "#ROSBAG V2.0\n")),
                    Contains("b.bag byte 13: no bag header"));
}

}  // namespace km
