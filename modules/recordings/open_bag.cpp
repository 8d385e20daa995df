#include "modules/recordings/open_bag.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "modules/core/input_file.hpp"
#include "modules/recordings/db3_reader.hpp"
#include "modules/recordings/mcap_reader.hpp"
#include "modules/recordings/mcap_records.hpp"
#include "modules/recordings/merged_reader.hpp"
#include "modules/recordings/random_access_file.hpp"
#include "modules/recordings/ros1_bag_reader.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

std::unique_ptr<BagReader> open_file(const fs::path& path) {
  constexpr std::uint64_t kMagic_bytes = 8;
  const RandomAccessFile file(path);
  if (file.size() == 0) throw InputFileError(path.string() + ": is empty");
  const std::string magic = file.beginning(kMagic_bytes);
  if (magic == "#ROSBAG ") return std::make_unique<Ros1BagReader>(path);
  if (magic == kMcapMagic) return std::make_unique<McapReader>(path);
  if (magic == "SQLite f") return std::make_unique<Db3Reader>(path);
  throw InputFileError(file.place(0) + ": does not begin like a .bag, .mcap or .db3 file");
}

// Files in the order of their numbers: bag_2 before bag_10.
std::vector<fs::path> files_of(const fs::path& folder, std::string_view extension) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    if (entry->path().extension() == extension) files.push_back(entry->path());
  if (error) throw InputFileError(folder.string() + ": " + error.message());
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return std::pair(a.native().size(), a) < std::pair(b.native().size(), b);
  });
  return files;
}

std::unique_ptr<BagReader> open_folder(const fs::path& folder) {
  std::vector<fs::path> files = files_of(folder, ".db3");
  const std::vector<fs::path> others = files_of(folder, ".mcap");
  if (!files.empty() && !others.empty())
    throw InputFileError(folder.string() + ": both .db3 and .mcap files: name the one to read");
  files.insert(files.end(), others.begin(), others.end());
  if (files.empty() && !files_of(folder, ".zstd").empty())
    throw InputFileError(folder.string() + ": its files are compressed as a whole: zstd -d them");
  if (files.empty()) throw InputFileError(folder.string() + ": no .db3 or .mcap file in it");
  std::vector<std::unique_ptr<BagReader>> readers;
  for (const fs::path& file : files) readers.push_back(open_file(file));
  return std::make_unique<MergedReader>(std::move(readers));
}

}  // namespace

bool may_be_bag(const fs::path& path) {
  if (!is_folder(path)) return true;
  return !files_of(path, ".db3").empty() || !files_of(path, ".mcap").empty();
}

std::unique_ptr<BagReader> open_bag(const fs::path& path) {
  return is_folder(path) ? open_folder(path) : open_file(path);
}

}  // namespace km
