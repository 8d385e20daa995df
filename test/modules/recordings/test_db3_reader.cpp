#include <sqlite3.h>

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

constexpr const char* kTables =
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
    " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
    " timestamp INTEGER NOT NULL, data BLOB NOT NULL);";
constexpr const char* kIndex = "CREATE INDEX timestamp_idx ON messages (timestamp ASC);";
constexpr const char* kRows =
    "INSERT INTO topics VALUES (3, '/imu', 'sensor_msgs/msg/Imu', 'cdr', ''),"
    " (5, '/odom', 'nav_msgs/msg/Odometry', 'cdr', '');"
    "INSERT INTO messages VALUES (1, 3, 20, x'01'), (2, 5, 10, x'02'), (3, 3, 10, x'03'),"
    " (4, 3, 30, x'');";

class Database {
 public:
  explicit Database(const fs::path& path) {
    REQUIRE(sqlite3_open(path.c_str(), &database_) == SQLITE_OK);
  }
  ~Database() { sqlite3_close(database_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void run(const std::string& sql) {
    REQUIRE(sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
  }

 private:
  sqlite3* database_ = nullptr;
};

fs::path database_of(const TemporaryFolder& folder, const std::string& name,
                     const std::string& sql) {
  const fs::path path = folder.path() / name;
  Database(path).run(sql);
  return path;
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

TEST_CASE("Bags of ROS 2 give the same messages as SQLite's own program") {
  struct Known {
    const char* folder;
    ListedSum sum;  // result of Python's sqlite3
    std::size_t topics;
  };
  const Known known = GENERATE(Known{"s3e_playground_2", {20, 0xa422acf5d}, 15},
                               Known{"tf_example", {518, 0x104ab1443b7}, 2});
  CAPTURE(known.folder);
  const auto folder = shared_data(std::string("ros_recordings/rosbag2/") + known.folder);
  if (!folder) return;
  const bool is_file = GENERATE(true, false);
  const auto reader = open_bag(is_file ? *folder / (std::string(known.folder) + ".db3") : *folder);
  CHECK(reader->channels().size() == known.topics);
  CHECK(sum_of(*reader) == known.sum);
  CHECK(to_string(reader->report()) == "");
}

TEST_CASE("Messages of a database come in order of time and id") {
  const TemporaryFolder folder;
  const bool has_index = GENERATE(true, false);
  const fs::path path =
      database_of(folder, "a b%?#.db3", std::string(kTables) + (has_index ? kIndex : "") + kRows);
  const auto reader = open_db3(path);
  REQUIRE(reader->channels().size() == 2);
  CHECK(reader->channels()[0].message_count == 3);
  CHECK(reader->channels()[1].topic == "/odom");
  CHECK(reader->channels()[1].type == "nav_msgs/msg/Odometry");
  CHECK(reader->channels()[1].encoding == "cdr");
  const auto messages = messages_of(*reader);
  REQUIRE(messages.size() == 4);
  CHECK(messages[0].bytes == std::vector<std::uint8_t>{2});
  CHECK(messages[0].channel == 1);
  CHECK(messages[1].bytes == std::vector<std::uint8_t>{3});
  CHECK(messages[2].log_time == 20);
  CHECK(messages[3].bytes.empty());
  CHECK(to_string(reader->report()) == "");
  CHECK(names_in(folder.path()) == std::vector<std::string>{"a b%?#.db3"});
}

TEST_CASE("Messages in a write-ahead log are read") {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "a.db3";
  Database recorder(path);  // open meanwhile, as by a recorder that runs
  recorder.run("PRAGMA journal_mode = WAL;");
  recorder.run(kTables);
  recorder.run(kRows);
  REQUIRE(fs::file_size(path.string() + "-wal") > 0);
  CHECK(messages_of(*open_db3(path)).size() == 4);
}

TEST_CASE("Rows that are no messages are lost with their place") {
  const TemporaryFolder folder;
  const fs::path path =
      database_of(folder, "a.db3",
                  std::string(kTables) + kRows +
                      "INSERT INTO messages VALUES (7, 99, 40, x'01'), (8, 3, 'noon', x'01'),"
                      " (9, 3, 40, 'text'), (10, 3, -9223372036854775808, x'01');");
  const auto reader = open_db3(path);
  CHECK(messages_of(*reader).size() == 4);
  const BagReport report = reader->report();
  CHECK(report.count(BagFault::kUnknownChannel) == 1);
  CHECK(report.count(BagFault::kMalformed) == 3);
  CHECK(report.entries().at(BagFault::kUnknownChannel).first ==
        path.string() + ": message 7: topic 99");
}

TEST_CASE("A database without the tables is refused and its views are not run") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(open_db3(database_of(folder, "a.db3", "CREATE TABLE other(id INTEGER);")),
                    Contains("a.db3: no table topics"));
  const std::string endless =
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format);"
      "CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id FROM n)"
      " SELECT id, 1 AS topic_id, 1 AS timestamp, x'' AS data FROM n;";
  CHECK_THROWS_WITH(open_db3(database_of(folder, "b.db3", endless)),
                    Contains("b.db3: no table messages"));
  CHECK_THROWS_WITH(open_db3(folder.write("c.db3", "SQLite")),
                    Contains("c.db3: not a SQLite database"));
  check_no_files<InputFileError>(".db3", [](const fs::path& path) { (void)open_db3(path); });
}

TEST_CASE("Several files of a folder are one recording") {
  const TemporaryFolder folder;
  fs::create_directory(folder.path() / "bag");
  database_of(folder, "bag/bag_10.db3", std::string(kTables) + kRows);
  database_of(folder, "bag/bag_2.db3",
              std::string(kTables) +
                  "INSERT INTO topics VALUES (1, '/odom', 'nav_msgs/msg/Odometry', 'cdr', '');"
                  "INSERT INTO messages VALUES (1, 1, 10, x'AA'), (2, 1, 25, x'BB');");
  folder.write("bag/metadata.yaml", "rosbag2_bagfile_information:");
  REQUIRE(may_be_bag(folder.path() / "bag"));
  const auto reader = open_bag(folder.path() / "bag");
  REQUIRE(reader->channels().size() == 2);
  CHECK(reader->channels()[0].topic == "/odom");
  CHECK(reader->channels()[0].message_count == 3);
  std::vector<std::pair<Stamp, std::size_t>> order;
  for (const BagMessage& message : messages_of(*reader))
    order.emplace_back(message.log_time, message.channel);
  CHECK(order == std::vector<std::pair<Stamp, std::size_t>>{
                     {10, 0}, {10, 0}, {10, 1}, {20, 1}, {25, 0}, {30, 1}});
}

TEST_CASE("A file that is no recording is refused by name") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(open_bag(folder.write("a.bag", "nothing of the kind")),
                    Contains("a.bag byte 0: does not begin like"));
  CHECK_THROWS_WITH(open_bag(folder.write("none.bag", "")), Contains("none.bag: is empty"));
  fs::create_directory(folder.path() / "empty");
  CHECK_FALSE(may_be_bag(folder.path() / "empty"));
  CHECK_THROWS_WITH(open_bag(folder.path() / "empty"), Contains("no .db3 or .mcap file"));
  folder.write("packed/a_0.db3.zstd", "");
  CHECK_THROWS_WITH(open_bag(folder.path() / "packed"), Contains("zstd -d"));
  CHECK(may_be_bag(folder.path() / "packed"));
  CHECK_THROWS_WITH(open_bag(folder.write("a.mcap.zst", "\x28\xB5\x2F\xFD____")),
                    Contains("is compressed as a whole: zstd -d "));
  folder.write("two/a.db3", "");
  folder.write("two/a.mcap", "");
  CHECK_THROWS_WITH(open_bag(folder.path() / "two"), Contains("both .db3 and .mcap"));
}

TEST_CASE("Corrupted databases are refused or read in order") {
  const TemporaryFolder folder;
  // Long enough that rows, index and overflowing data have pages of their own.
  const fs::path good = database_of(
      folder, "good.db3",
      std::string(kTables) + kIndex + kRows +
          "WITH RECURSIVE n(id) AS (SELECT 10 UNION ALL SELECT id + 1 FROM n WHERE id < 400)"
          " INSERT INTO messages SELECT id, 3, id * 7919 % 1000, zeroblob(id * id % 5000) FROM n;");
  check_corrupted<InputFileError>(
      read_input_file(good), folder.path().string(), [&](const std::string& bytes) {
        check_order(messages_of(*open_db3(folder.write("a.db3", bytes))));
      });
}

TEST_CASE("Messages that a recorder compressed one by one are read") {
  const TemporaryFolder folder;
  // "zstd" of 00 01 00 00 and ten times 07, and the first bytes of it.
  const fs::path path = database_of(
      folder, "a.db3",
      std::string(kTables) +
          "INSERT INTO topics VALUES (3, '/imu', 'sensor_msgs/msg/Imu', 'cdr', '');" +
          "INSERT INTO messages VALUES (1, 3, 10, x'28b52ffd200e5d0000280001000007010005d002'), "
          "(2, 3, 20, x'28b52ffd2004'), (3, 3, 30, x'00010000');");
  const auto reader = open_bag(path);
  const auto messages = messages_of(*reader);
  REQUIRE(messages.size() == 2);
  CHECK(messages[0].bytes == std::vector<std::uint8_t>{0, 1, 0, 0, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7});
  CHECK(messages[1].bytes == std::vector<std::uint8_t>{0, 1, 0, 0});
  CHECK(reader->report().count(BagFault::kCompression) == 1);
}

}  // namespace km
