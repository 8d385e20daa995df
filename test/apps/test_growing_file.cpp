#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "apps/result_files.hpp"
#include "apps/robot/growing_file.hpp"
#include "test/support/captured_log.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

TEST_CASE("Rows for which there was no room are written once there is room", "[robot]") {
  const CapturedLog log;
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "a.csv";
  fs::create_symlink("/dev/full", path);
  ResultWriter results;
  GrowingFile file(path, results);
  for (int i = 0; i < 3; ++i) {
    file.rows() << i << '\n';
    file.flush();
  }
  const std::string why = path.string() + ": cannot be written: No space left on device";
  CHECK(results.lost() == std::map<std::string, std::string>{{path.string(), why}});
  CHECK(log.lines().size() == 1);  // not one a second

  fs::remove(path);
  file.flush();
  CHECK(folder.read("a.csv") == "0\n1\n2\n");
  CHECK(results.lost().empty());
}

TEST_CASE("Rows wait while the folder is gone, and a deleted file begins again with its header",
          "[robot]") {
  const CapturedLog log;
  const TemporaryFolder folder;
  const fs::path out = folder.path() / "out", moved = folder.path() / "moved";
  fs::create_directory(out);
  ResultWriter results;
  GrowingFile file(out / "a.csv", results);
  file.rows() << "time\n0\n";
  file.flush();
  fs::rename(out, moved);
  file.rows() << "1\n";
  file.flush();
  CHECK(results.lost().size() == 1);
  fs::rename(moved, out);
  file.flush();
  CHECK(results.lost().empty());
  CHECK(folder.read("out/a.csv") == "time\n0\n1\n");

  fs::remove(out / "a.csv");
  file.rows() << "2\n";
  file.flush();
  file.rows() << "3\n";
  file.flush();
  CHECK(folder.read("out/a.csv") == "time\n2\n3\n");
  CHECK_THAT(results.lost().at((out / "a.csv").string()), Catch::Contains("rows are missing"));
}

TEST_CASE("A disk that is full for too long costs rows, and the file is reported as incomplete",
          "[robot]") {
  const CapturedLog log;
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "a.csv";
  fs::create_symlink("/dev/full", path);
  ResultWriter results;
  GrowingFile file(path, results);
  for (int i = 0; i < 2; ++i) {
    file.rows() << std::string(GrowingFile::kMaxWaiting_bytes - 1, 'x') << '\n';
    file.flush();
  }
  fs::remove(path);
  file.flush();
  CHECK(fs::file_size(path) == GrowingFile::kMaxWaiting_bytes);
  CHECK_THAT(results.lost().at(path.string()), Catch::Contains("rows are missing"));
}

TEST_CASE("A file that is continued loses its incomplete row and no other", "[robot]") {
  const TemporaryFolder folder;
  const fs::path path = folder.write("a.csv", "time\n1\n2\n3.");
  ResultWriter results;
  GrowingFile file(path, results);
  CHECK(file.go_on() == "time\n1\n2\n");
  file.rows() << 4 << '\n';
  file.flush();
  file.rows() << 5 << '\n';
  file.flush();
  CHECK(folder.read("a.csv") == "time\n1\n2\n4\n5\n");
  CHECK(results.lost().empty());
}

TEST_CASE("A file that is missing, or incomplete in its first row, begins from scratch",
          "[robot]") {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "a.csv";
  if (GENERATE(false, true)) folder.write("a.csv", "tim");
  ResultWriter results;
  GrowingFile file(path, results);
  CHECK(file.go_on().empty());
  file.rows() << "time\n1\n";
  file.flush();
  CHECK(folder.read("a.csv") == "time\n1\n");
  CHECK(results.lost().empty());
}

}  // namespace
TEST_CASE("Results replace an empty file of no run, and no other", "[result_files]") {
  const TemporaryFolder folder;
  folder.write("traffic.csv", "");  // as one who watches the file creates it before the run
  CHECK_NOTHROW(expect_no_other_files(folder.path()));
  folder.write("traffic.csv", "mine");
  CHECK_THROWS_WITH(remove_results(folder.path()),
                    Catch::Contains("traffic.csv: would be replaced"));
  CHECK(folder.read("traffic.csv") == "mine");
}

}  // namespace km
