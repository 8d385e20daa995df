#include "apps/experiments/recorded_flight_files.hpp"

#include <algorithm>
#include <fstream>
#include <vector>

#include "modules/core/text_rows.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr int kDepth = 3;

std::vector<fs::path> entries_named(const fs::path& place, const std::string& name) {
  std::vector<fs::path> found;
  std::error_code error;
  fs::recursive_directory_iterator walk(place, fs::directory_options::skip_permission_denied,
                                        error);
  for (; !error && walk != fs::recursive_directory_iterator(); walk.increment(error)) {
    const std::string entry = walk->path().filename().string();
    if (entry.starts_with(name)) found.push_back(walk->path());
    // Inside a recording there are only its thousands of images.
    if (walk.depth() + 1 >= kDepth || entry == "mav0" || entry.starts_with(name))
      walk.disable_recursion_pending();
  }
  std::sort(found.begin(), found.end());
  return found;
}

// Time between the first and the last image of the left camera for which there is a file [s].
double recorded_s(const fs::path& folder) {
  const fs::path camera = folder / "mav0/cam0";
  std::error_code error;
  std::int64_t first = 0, last = 0;
  for (const auto& image : fs::directory_iterator(camera / "data", error)) {
    const auto stamp = parse_int64(image.path().stem().string());
    if (!stamp) continue;
    first = first == 0 ? *stamp : std::min(first, *stamp);
    last = std::max(last, *stamp);
  }
  return 1e-9 * static_cast<double>(last - first);
}

bool is_table(const std::string& name) {
  const auto ends = [&](const char* end) { return name.ends_with(end); };
  return ends(".csv") || ends(".csv.gz") || ends(".txt") || ends(".txt.gz");
}

void take(const fs::path& file, fs::path& place) {
  if (place.empty() && fs::is_regular_file(file)) place = file;
}

}  // namespace

RecordedFlightFiles find_recorded_flight(const fs::path& place, const std::string& name,
                                         double least_s) {
  RecordedFlightFiles files;
  if (place.empty()) return files;
  const std::vector<fs::path> entries = entries_named(place, name);
  for (const fs::path& entry : entries) {
    if (!fs::is_directory(entry / "mav0")) continue;
    if (files.folder.empty() && recorded_s(entry) >= least_s) files.folder = entry;
    take(entry / "mav0/state_groundtruth_estimate0/data.csv", files.truth);
    take(entry / "mav0/imu0/data.csv", files.imu);
  }
  for (const fs::path& entry : entries) {
    const std::string text = entry.filename().string();
    if (is_table(text)) take(entry, text.find("imu") == text.npos ? files.truth : files.imu);
  }
  return files;
}

}  // namespace km
