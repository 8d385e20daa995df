#include "modules/core/io/write_file.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TEST_CASE("A file is replaced as a whole and leaves no other file") {
  const TemporaryFolder folder;
  folder.write("a", "what was there before is longer");
  write_file(folder.path() / "a", "new");
  CHECK(folder.read("a") == "new");
  CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("A file that cannot be written is reported with the reason and the former file stays") {
  const TemporaryFolder folder;
  const fs::path taken = folder.path() / "taken";
  fs::create_directory(taken);
  CHECK_THROWS_WITH(write_file(taken, "x"), taken.string() + ": cannot be written: Is a directory");
  const fs::path nowhere = folder.path() / "none" / "a";
  CHECK_THROWS_WITH(write_file(nowhere, "x"),
                    nowhere.string() + ": cannot be written: No such file or directory");
  folder.write("a", "old");
  fs::create_directory(folder.path() / "a.part");  // blocks the name of the partial file
  CHECK_THROWS(write_file(folder.path() / "a", "new"));
  CHECK(folder.read("a") == "old");
}

TEST_CASE("A device is written in place and a full device is reported") {
  CHECK_NOTHROW(write_file("/dev/null", "x"));
  CHECK(fs::is_character_file("/dev/null"));
  CHECK_THROWS_WITH(write_file("/dev/full", "x"),
                    "/dev/full: cannot be written: No space left on device");
  std::string waiting = "x";
  CHECK_THROWS_WITH(append_to_file("/dev/full", waiting),
                    "/dev/full: cannot be written: No space left on device");
  CHECK(waiting == "x");
}

TEST_CASE("A link stays a link and its file is written") {
  const TemporaryFolder folder;
  folder.write("file", "old");
  fs::create_symlink("file", folder.path() / "link");
  write_file(folder.path() / "link", "new");
  CHECK(fs::is_symlink(folder.path() / "link"));
  CHECK(folder.read("file") == "new");
}

TEST_CASE("A link in place of the partial file is not followed") {
  const TemporaryFolder folder;
  folder.write("elsewhere", "old");
  fs::create_symlink("elsewhere", folder.path() / "a.part");
  write_file(folder.path() / "a", "new");
  CHECK(fs::is_regular_file(fs::symlink_status(folder.path() / "a")));
  CHECK(folder.read("a") == "new");
  CHECK(folder.read("elsewhere") == "old");
  CHECK_FALSE(fs::exists(folder.path() / "a.part"));
}

TEST_CASE("A file for its owner alone can never be read by other users") {
  const TemporaryFolder folder;
  const fs::path secret = folder.path() / "secret";
  const fs::path elsewhere = folder.write("elsewhere", "old");
  SECTION("without an earlier file") {}
  SECTION("with a partial file that all users can read") {
    fs::permissions(folder.write("secret.part", "old"), fs::perms::all);
  }
  SECTION("with an earlier file that all users can read") {
    fs::permissions(folder.write("secret", "old"), fs::perms::all);
  }
  SECTION("with a link to a file that all users can read") {
    fs::create_symlink("elsewhere", secret);
  }
  SECTION("with a link in place of the partial file") {
    fs::create_symlink("elsewhere", folder.path() / "secret.part");
  }
  write_file(secret, "new", {.mode = 0600, .through_links = false, .durable = true});
  const fs::file_status there = fs::symlink_status(secret);
  CHECK(fs::is_regular_file(there));
  CHECK(there.permissions() == (fs::perms::owner_read | fs::perms::owner_write));
  CHECK(folder.read("secret") == "new");
  CHECK(folder.read("elsewhere") == "old");
  CHECK_FALSE(fs::exists(folder.path() / "secret.part"));
}

TEST_CASE("Appended bytes follow the existing ones") {
  const TemporaryFolder folder;
  const bool durable = GENERATE(false, true);
  for (std::string line : {"one\n", "two\n"}) {
    append_to_file(folder.path() / "a", line, {.durable = durable});
    CHECK(line.empty());
  }
  CHECK(folder.read("a") == "one\ntwo\n");
}

}  // namespace
}  // namespace km
