#include <malloc.h>
#include <sys/mman.h>

#include "apps/result_files.hpp"
#include "apps/robot/growing_files.hpp"
#include "test/support/captured_log.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TEST_CASE("Rows for which there was no room are written once there is room") {
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

TEST_CASE("Rows wait while the folder is gone, and a deleted file begins again with its header") {
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
  CHECK_THAT(results.lost().at((out / "a.csv").string()), Contains("rows are missing"));
}

TEST_CASE("A disk that is full for too long costs rows, and the file is reported as incomplete") {
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
  CHECK_THAT(results.lost().at(path.string()), Contains("rows are missing"));
}

TEST_CASE("A file that is continued loses its incomplete row and no other") {
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

TEST_CASE("A file that is missing, or incomplete in its first row, begins from scratch") {
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
TEST_CASE("Results replace an empty file of no run, and no other") {
  const TemporaryFolder folder;
  folder.write("traffic.csv", "");  // as one who watches the file creates it before the run
  CHECK_NOTHROW(expect_no_other_files(folder.path()));
  folder.write("traffic.csv", "mine");
  CHECK_THROWS_WITH(remove_results(folder.path()), Contains("traffic.csv: would be replaced"));
  CHECK(folder.read("traffic.csv") == "mine");
}

namespace {

constexpr std::uint64_t kMega = 1'000'000;

TEST_CASE("Memory that is taken shows, and processor time does") {
  const ProcessUsage before = process_usage();
  CHECK(before.resident_bytes > kMega);
  CHECK(before.peak_bytes >= before.resident_bytes / 2);  // counted lazily by the kernel
  constexpr std::size_t kTaken = 64 * kMega;
  // From the kernel, because the heap may still hold memory of other tests.
  void* const taken =
      mmap(nullptr, kTaken, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  REQUIRE(taken != MAP_FAILED);
  std::memset(taken, 1, kTaken);
  const ProcessUsage after = process_usage();
  REQUIRE(munmap(taken, kTaken) == 0);
  CHECK(after.resident_bytes > before.resident_bytes + kTaken * 9 / 10);
  CHECK(after.cpu_s >= before.cpu_s);
  CHECK(after.system_s <= after.cpu_s);
}

TEST_CASE("Free memory between blocks in use returns to the kernel") {
  constexpr std::size_t kBlock = 1024, kBlocks = 65536;
  std::vector<std::unique_ptr<char[]>> blocks(kBlocks);
  for (auto& block : blocks) {
    block = std::make_unique_for_overwrite<char[]>(kBlock);
    std::memset(block.get(), 1, kBlock);
  }
  const struct mallinfo2 heap = mallinfo2();
  if (heap.uordblks + heap.hblkhd < kBlock * kBlocks) {
    std::cout << "SKIPPED: a sanitizer replaces the heap of the C library\n";
    return;
  }
  for (std::size_t k = 0; k < kBlocks; ++k)
    if (k % 64 != 0) blocks[k].reset();  // one block in 16 pages stays
  const std::uint64_t before = process_usage().resident_bytes;
  return_freed_memory();
  CHECK(process_usage().resident_bytes + kBlock * kBlocks / 2 < before);
}

TEST_CASE("The growth of memory is measured in the second half of the time") {
  std::ostringstream text;
  ProcessCsv csv(text);
  CHECK_FALSE(csv.summary().memory_growth_bytes_per_minute);
  const std::uint64_t per_s = GENERATE(0U, 50'000U);
  for (std::uint64_t s = 0; s <= 120; ++s)  // 2 MB a second for a minute, then less
    csv.append(static_cast<double>(s),
               {.resident_bytes =
                    100 * kMega + (s < 60 ? 2 * kMega * s : 120 * kMega + per_s * (s - 60))});
  const ProcessSummary process = csv.summary();
  CHECK(process.memory_at_start_bytes == 100 * kMega);
  CHECK(process.memory_at_end_bytes == 220 * kMega + 60 * per_s);
  REQUIRE(process.memory_growth_bytes_per_minute);
  CHECK(*process.memory_growth_bytes_per_minute ==
        Approx(60.0 * static_cast<double>(per_s)).margin(1.0));
}

TEST_CASE("process.csv has a row for each sample") {
  std::ostringstream text;
  ProcessCsv csv(text);
  csv.append(0.5, {.cpu_s = 0.25, .system_s = 0.125, .page_faults = 10, .resident_bytes = 12345});
  csv.append(1.5, {.cpu_s = 1.0, .resident_bytes = 23456, .peak_bytes = 34567});
  CHECK(text.str() ==
        "time_s,cpu_s,resident_bytes,system_s,page_faults\n"
        "0.500,0.250,12345,0.125,10\n1.500,1.000,23456,0.000,0\n");
  CHECK(csv.summary().cpu_s == 1.0);
  CHECK(csv.summary().peak_memory_bytes == 34567);
  for (int s = 2; s < 100; ++s) csv.append(1.0 * s, {.cpu_s = 1.0, .resident_bytes = 23456});
  CHECK_FALSE(csv.summary().memory_growth_bytes_per_minute);  // too short
}

TEST_CASE("process.csv continues the time of the run, and sums up the processor time") {
  std::ostringstream text;
  ProcessCsv csv(text,
                 "time_s,cpu_s,resident_bytes,system_s,page_faults\n"
                 "1.000,0.500,12345,0.250,100\n2.500,1.250,23456,0.500,200\n");
  CHECK(csv.former_s() == 2.5);
  csv.append(3.5, {.cpu_s = 0.25, .system_s = 0.125, .page_faults = 50, .resident_bytes = 34567});
  CHECK(text.str() == "3.500,1.500,34567,0.625,250\n");
  CHECK(csv.summary().cpu_s == 0.25);
}

TEST_CASE("optimizer.csv has a row for each round, and continues the numbers") {
  std::ostringstream text;
  std::vector<OptimizerProgress> rounds{
      {.members = {1, 2}, .round = 1, .cost = 4.0, .seconds = 0.5}};
  RoundsCsv first(text);
  first.append(rounds);
  rounds.push_back({.members = {1, 2}, .round = 3, .cost = 2.0, .seconds = 1.5});
  first.append(rounds);
  first.append(rounds);
  const std::string header = "seconds,round,members,cost,gradient_norm\n";
  CHECK(text.str() == header + "0.5,1,2,4,0\n1.5,3,2,2,0\n");

  std::ostringstream more;
  RoundsCsv next(more, text.str());
  next.append(rounds);
  CHECK(more.str() == "2,4,2,4,0\n3,6,2,2,0\n");
}

}  // namespace
}  // namespace km
