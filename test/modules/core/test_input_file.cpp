#include <sys/stat.h>

#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_rows.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/test.hpp"

namespace km {

TEST_CASE("The bytes of a file are read unchanged") {
  const TemporaryFolder folder;
  const std::string bytes("a\0\r\n\xFF", 5);
  CHECK(read_input_file(folder.write("some", bytes)) == bytes);
  CHECK(read_input_file(folder.write("none", "")).empty());
  const std::string large(3'000'000, 'x');
  CHECK(read_input_file(folder.write("large", large)) == large);
  CHECK(read_input_file("/proc/self/stat").size() > 10);  // has no size until it is read
}

TEST_CASE("A path that is not a file is refused with its kind") {
  check_no_files<InputFileError>(".txt", [](const auto& file) { (void)read_input_file(file); });
  const TemporaryFolder folder;
  const auto places = no_files(folder, "");
  const char* const problems[] = {"no such file", "Too many levels of symbolic links",
                                  "Too many levels of symbolic links", "a folder, not a file",
                                  "File name too long"};
  for (std::size_t i = 0; i < places.size(); ++i) {
    CHECK(problem_of_file(places[i]) == problems[i]);
    CHECK_FALSE(is_file(places[i]));
    CHECK(is_folder(places[i]) == (i == 3));
    CHECK(is_there(places[i]) == (i == 3));
    CHECK(is_absent(places[i]) == (i == 0));
  }
  CHECK(problem_of_file("/dev/zero") == "not a file");
}

TEST_CASE("A text in UTF-16 is refused by name") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_input_file(folder.write("a.csv", std::string("\xFF\xFE\x31\0", 4))),
                    Contains("a.csv: a text in UTF-16: save it as UTF-8"));
}

TEST_CASE("A file beyond the limit is not read") {
  const TemporaryFolder folder;
  const auto file = folder.write("some", "12345");
  CHECK(read_input_file(file, 5) == "12345");
  CHECK_THROWS_WITH(read_input_file(file, 4), Contains("some: larger than"));
  fs::resize_file(file, std::uintmax_t{1} << 40U);  // a hole needs no disk space
  CHECK_THROWS_WITH(read_input_file(file), Contains("larger than 8192 MiB"));
}

TEST_CASE("A pipe is read until its writer closes it, and refused without a writer") {
  const TemporaryFolder folder;
  const fs::path pipe = folder.path() / "pipe";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  auto writer = std::async(std::launch::async, [&] {
    std::ofstream out(pipe);
    out << "first " << std::flush << "second";
  });
  CHECK(read_input_file(pipe) == "first second");
  writer.get();
  CHECK_THROWS_WITH(read_input_file(pipe), Contains("no program has written"));
}

TEST_CASE("Text in messages is printable and short") {
  CHECK(readable("10 m, \xC3\xA4") == "10 m, \xC3\xA4");
  CHECK(readable("a\x1b[2J\n\x7f") == "a?[2J??");
  CHECK(readable("0123456789", 8) == "0123 ...");
}

TEST_CASE("Kind and permissions are those of the file that is read and not of its successor") {
  namespace fs = std::filesystem;
  const TemporaryFolder folder;
  const fs::path name = folder.path() / "name";
  REQUIRE(mkfifo(name.c_str(), 0600) == 0);
  auto reading = std::async(std::launch::async, [&] { return open_input_file(name); });
  std::ofstream writer(name);  // waits until the reader has opened it
  fs::rename(folder.write("successor", "another"), name);
  writer << "some";
  writer.close();
  const InputFile read = reading.get();
  CHECK(read.bytes == "some");
  CHECK(read.status.type() == fs::file_type::fifo);
  CHECK(read.status.permissions() == (fs::perms::owner_read | fs::perms::owner_write));
  CHECK(open_input_file(name).status.type() == fs::file_type::regular);
}

}  // namespace km
