#include "modules/sensors/euroc_folder.hpp"

#include <algorithm>
#include <sstream>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "modules/core/imu_limits.hpp"
#include "modules/core/input_file.hpp"
#include "modules/sensors/folder_layouts.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

struct ListedImage {
  Stamp stamp = 0;
  int line = 0;
  fs::path file;
};

std::vector<ListedImage> list_images(const fs::path& camera, ReaderReport& report) {
  std::vector<ListedImage> images;
  const fs::path list = camera / "data.csv";
  using Parsed = std::variant<fs::path, RowFault>;
  const auto file_of = [&](const TextRow& row) -> Parsed {
    return camera / "data" / row.fields[1];
  };
  for (auto& row : read_ordered_rows<fs::path>(list, 2, "lists no image", report, file_of))
    images.push_back({row.stamp, row.line, std::move(row.value)});
  return images;
}

std::vector<Stamp> stamps_of(const std::vector<ListedImage>& images) {
  std::vector<Stamp> stamps;
  stamps.reserve(images.size());
  for (const ListedImage& image : images) stamps.push_back(image.stamp);
  return stamps;
}

LabelPalette read_palette(const fs::path& file) {
  if (is_absent(file)) return {};
  try {
    return parse_label_palette(read_file(file), file.string());
  } catch (const std::invalid_argument& error) {
    throw DatasetError(error.what());
  }
}

// Assigns each image that `folder`/data.csv lists (depth0, label0) to the `member` of the frame
// whose stamp is at most a millisecond away. There may be fewer images than frames. Images without
// a frame are counted.
void list_beside(const fs::path& folder, fs::path StereoPairFile::*member,
                 std::vector<StereoPairFile>& frames, ReaderReport& report) {
  constexpr double kTolerance_s = 1e-3;
  auto frame = frames.begin();
  for (ListedImage& image : list_images(folder, report)) {
    while (frame != frames.end() && seconds_between(frame->stamp, image.stamp) > kTolerance_s)
      ++frame;
    if (frame == frames.end() || seconds_between(frame->stamp, image.stamp) < -kTolerance_s) {
      report.add(ReaderFault::kImageWithoutFrame,
                 at_line(folder / "data.csv", image.line) + ": " + image.file.filename().string());
      continue;
    }
    (*frame++).*member = std::move(image.file);
  }
}

std::variant<ImuSample, RowFault> parse_imu(const TextRow& row) {
  Vector6 values;
  for (int i = 0; i < 6; ++i) {
    const std::string_view field = row.fields[static_cast<std::size_t>(i) + 1];
    const auto value = parse_double(field);
    if (!value)
      return RowFault{ReaderFault::kMalformedRow, std::string(field) + " is not a number"};
    values[i] = *value;
  }
  const ImuSample sample{0, values.head<3>(), values.tail<3>()};
  if (!values.allFinite()) return RowFault{ReaderFault::kNotFinite, "not finite"};
  if (is_plausible(sample)) return sample;
  std::ostringstream why;
  why << sample.gyro.stableNorm() << " rad/s (at most " << kMaxAngularRate_radps << "), "
      << sample.accel.stableNorm() << " m/s^2 (at most " << kMaxSpecificForce_mps2 << ')';
  return RowFault{ReaderFault::kImplausible, why.str()};
}

ImuStream read_imu(const fs::path& file, ReaderReport& report) {
  ImuStream stream;
  for (const auto& row :
       read_ordered_rows<ImuSample>(file, 7, "holds no inertial sample", report, parse_imu))
    stream.add({row.stamp, row.value.gyro, row.value.accel});
  return stream;
}

// Recordings in `folder`, for the message if the user named a folder of recordings.
std::string recordings_below(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    if (is_folder(entry->path() / "mav0")) names.push_back(entry->path().filename().string());
  std::ranges::sort(names);
  constexpr std::size_t kMost = 5;
  std::string text;
  for (std::size_t k = 0; k < std::min(names.size(), kMost); ++k)
    text += (k == 0 ? ", but in it are " : ", ") + names[k];
  return text + (names.size() > kMost ? " and others" : "");
}

}  // namespace

fs::path find_mav0(const fs::path& folder) {
  if (!is_folder(folder)) throw DatasetError(folder.string() + ": no such folder");
  if (is_folder(folder / "mav0")) return folder / "mav0";
  if (is_folder(folder / "cam0")) return folder;
  throw DatasetError(folder.string() +
                     ": neither a folder mav0 nor cam0 in it: not a recording in " + kKnownLayouts +
                     recordings_below(folder));
}

StereoPairFiles list_euroc_pairs(const fs::path& mav0, ReaderReport& report) {
  const auto lefts = list_images(mav0 / "cam0", report);
  const auto rights = list_images(mav0 / "cam1", report);
  const Synchrony synchrony = find_synchrony(stamps_of(lefts), stamps_of(rights));
  const auto count_unpaired = [&](ReaderFault fault, const char* camera, const ListedImage& image) {
    report.add(fault, at_line(mav0 / camera / "data.csv", image.line) + ": " +
                          image.file.filename().string());
  };
  std::vector<StereoPairFile> pairs;
  auto left = lefts.begin();
  auto right = rights.begin();
  while (left != lefts.end() || right != rights.end()) {
    const bool no_left = left == lefts.end();
    const bool no_right = right == rights.end();
    const double off_s =
        no_left || no_right ? 0.0 : seconds_between(left->stamp, right->stamp) - synchrony.offset_s;
    if (no_right || off_s > synchrony.tolerance_s) {
      count_unpaired(ReaderFault::kLeftWithoutRight, "cam0", *left++);
    } else if (no_left || off_s < -synchrony.tolerance_s) {
      count_unpaired(ReaderFault::kRightWithoutLeft, "cam1", *right++);
    } else {
      pairs.push_back({left->stamp, left->file, right->file, left->line, {}, {}});
      ++left, ++right;
    }
  }
  if (pairs.empty())
    throw DatasetError(mav0.string() + ": no image of cam0 has one of cam1 within " +
                       std::to_string(synchrony.tolerance_s) + " s");
  return {std::move(pairs), synchrony};
}

std::vector<StereoPairFile> list_euroc_lefts(const fs::path& mav0, ReaderReport& report) {
  std::vector<StereoPairFile> frames;
  for (ListedImage& left : list_images(mav0 / "cam0", report))
    frames.push_back({left.stamp, std::move(left.file), {}, left.line, {}, {}});
  return frames;
}

ImageFolder list_euroc_folder(const fs::path& mav0, SensorRig rig, double depth_scale_m,
                              const FolderOptions& options) {
  ImageFolder result;
  result.name = mav0;
  result.list = mav0 / "cam0" / "data.csv";
  result.rig = std::move(rig);
  result.depth_scale_m = depth_scale_m;
  if (options.labels) result.palette = read_palette(mav0 / "label_palette.csv");
  if (result.is_rgbd()) {
    result.frames = list_euroc_lefts(mav0, result.report);
  } else {
    StereoPairFiles found = list_euroc_pairs(mav0, result.report);
    result.frames = std::move(found.pairs);
    if (is_remarkable(found.synchrony)) result.remarks = {to_string(found.synchrony, "right")};
  }
  result.imu_list = mav0 / "imu0" / "data.csv";
  if (result.rig.has_imu) result.imu = read_imu(result.imu_list, result.report);
  if (result.rig.depth)
    list_beside(mav0 / "depth0", &StereoPairFile::depth, result.frames, result.report);
  if (options.labels)
    list_beside(mav0 / "label0", &StereoPairFile::labels, result.frames, result.report);
  for (StereoPairFile& pair : result.frames) pair.stamp += nanoseconds(options.correction.offset_s);
  return result;
}

}  // namespace km
