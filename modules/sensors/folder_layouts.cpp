#include "modules/sensors/folder_layouts.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>
#include <variant>

#include "modules/core/calibration_limits.hpp"
#include "modules/core/image_size.hpp"
#include "modules/core/input_file.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

using Projection = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

constexpr double kDepthTolerance_s = 0.02;  // as the benchmark's own associate.py
constexpr double kSevenScenesRate_hz = 30.0;

// A row of a list: the time and the text behind it.
using ListedFile = StampedRow<std::string>;

// The rows `time [s] ...` of a list. Faulty rows are counted.
std::vector<ListedFile> read_times(const fs::path& file, std::size_t fields, ReaderReport& report) {
  using Parsed = std::variant<std::string, RowFault>;
  const auto name_of = [&](const TextRow& row) -> Parsed {
    return fields > 1 ? std::string(row.fields[1]) : "";
  };
  return read_ordered_rows<std::string>(file, fields, "no time in it", report, name_of,
                                        stamp_of_seconds);
}

[[noreturn]] void refuse(const fs::path& file, int line, const std::string& problem) {
  throw DatasetError(at_line(file, line) + ": " + problem);
}

// `count` finite numbers from field `first` of a row on.
std::vector<double> numbers_in(const fs::path& file, const TextRow& row, std::size_t first,
                               std::size_t count) {
  if (row.fields.size() != first + count)
    refuse(file, row.line,
           std::to_string(row.fields.size() - std::min(first, row.fields.size())) +
               " numbers, expected " + std::to_string(count));
  std::vector<double> numbers;
  for (std::size_t i = first; i < row.fields.size(); ++i) {
    const auto value = number_in(row, i);
    if (!value || !std::isfinite(*value))
      refuse(file, row.line, readable(row.fields[i], 40) + " is not a number");
    numbers.push_back(*value);
  }
  return numbers;
}

// Sets the size of `camera` to that of an image.
void take_size(const fs::path& image, Camera& camera) {
  const auto size = stated_image_size(read_file(image));
  if (!size) throw DatasetError(image.string() + ": not an image whose size is known");
  camera.width = static_cast<int>(size->width);
  camera.height = static_cast<int>(size->height);
  if (const auto problem = resolution_problem(camera.width, camera.height))
    throw DatasetError(image.string() + ": " + *problem);
}

// The first file of `frames` that exists; the first one if none does.
const fs::path& first_image(const std::vector<StereoPairFile>& frames,
                            fs::path StereoPairFile::*member) {
  const auto found = std::ranges::find_if(
      frames, [&](const StereoPairFile& frame) { return is_file(frame.*member); });
  return (found == frames.end() ? frames.front() : *found).*member;
}

// A projection with its line in calib.txt.
struct ListedProjection {
  Projection P = Projection::Zero();
  int line = 0;
};

ListedProjection read_projection(const fs::path& file, const std::string& name) {
  const std::string text = read_file(file);
  for (const TextRow& row : split_rows(text)) {
    if (row.fields[0] != name + ':') continue;
    const std::vector<double> numbers = numbers_in(file, row, 1, 12);
    return {Eigen::Map<const Projection>(numbers.data()), row.line};
  }
  throw DatasetError(file.string() + ": no row " + name +
                     ": with the 12 numbers of the projection of that camera");
}

// The camera of a projection K [I | t], with its centre -t along the axes of the camera.
Camera camera_of(const fs::path& file, const ListedProjection& listed, const fs::path& image) {
  const Projection& P = listed.P;
  Camera camera{.fx = P(0, 0), .fy = P(1, 1), .cx = P(0, 2), .cy = P(1, 2)};
  take_size(image, camera);
  if (const auto problem = intrinsics_problem(camera)) refuse(file, listed.line, *problem);
  const Eigen::Matrix3d K = P.leftCols<3>();
  constexpr double kRounding = 1e-6;
  if (std::abs(K(2, 2) - 1.0) > kRounding || std::abs(K(0, 1)) > kRounding ||
      K.row(2).head<2>().norm() > kRounding || std::abs(K(1, 0)) > kRounding)
    refuse(file, listed.line, "not the projection of a rectified camera");
  const Eigen::Vector3d t = K.inverse() * P.col(3);
  camera.T_body_cam = make_pose(Eigen::Matrix3d::Identity(), -t);
  return camera;
}

std::string six_digits(int number) {
  std::string digits = std::to_string(number);
  return digits.insert(0, 6 - std::min<std::size_t>(digits.size(), 6), '0');
}

// `folder`/`stem`.png, or .jpg if there is only this one.
fs::path image_file(const fs::path& folder, const std::string& stem) {
  const fs::path png = folder / (stem + ".png"), jpg = folder / (stem + ".jpg");
  return is_absent(png) && is_file(jpg) ? jpg : png;
}

SensorRig rgbd_sensors(const DepthCamera& depth) {
  SensorRig rig;
  rig.stereo = rgbd_rig(depth.camera, depth.baseline_m);
  rig.depth = depth.range;
  rig.has_imu = false;
  return rig;
}

// The file nearest to `stamp`, if it is near enough.
const ListedFile* nearest(const std::vector<ListedFile>& files, Stamp stamp) {
  auto after = std::ranges::lower_bound(files, stamp, {}, &ListedFile::stamp);
  if (after == files.end() ||
      (after != files.begin() && stamp - std::prev(after)->stamp < after->stamp - stamp))
    --after;
  return std::abs(seconds_between(after->stamp, stamp)) <= kDepthTolerance_s ? &*after : nullptr;
}

// The number N of a file frame-N.color.png or .jpg, if `kind` is ".color.".
std::optional<int> frame_number(const fs::path& file, std::string_view kind) {
  const std::string name = file.filename();
  constexpr std::string_view kBegin = "frame-";
  const std::size_t end = name.find(kind);
  if (!name.starts_with(kBegin) || end == name.npos) return std::nullopt;
  const auto number =
      parse_int64(std::string_view(name).substr(kBegin.size(), end - kBegin.size()));
  constexpr std::int64_t kMost = 100'000'000;
  return number && *number >= 0 && *number < kMost ? std::optional(static_cast<int>(*number))
                                                   : std::nullopt;
}

bool has_numbered_frames(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    if (frame_number(entry->path(), ".color.") || frame_number(entry->path(), ".depth."))
      return true;
  return false;
}

Camera read_seven_scenes_camera(const fs::path& file) {
  const std::string text = read_file(file);
  const std::vector<TextRow> rows = split_rows(text);
  if (rows.size() != 3)
    throw DatasetError(file.string() + ": " + std::to_string(rows.size()) +
                       " rows, expected the 3 of a camera matrix");
  Eigen::Matrix3d K;
  for (std::size_t i = 0; i < 3; ++i)
    K.row(static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::RowVector3d>(numbers_in(file, rows[i], 0, 3).data());
  Camera camera{.fx = K(0, 0), .fy = K(1, 1), .cx = K(0, 2), .cy = K(1, 2)};
  if (const auto problem = intrinsics_problem(camera)) refuse(file, rows[0].line, *problem);
  return camera;
}

}  // namespace

FolderLayout layout_of(const fs::path& folder) {
  if (is_there(folder / "mav0") || is_there(folder / "cam0")) return FolderLayout::kEuroc;
  if (is_file(folder / "rgb.txt")) return FolderLayout::kTum;
  if (is_folder(folder / "image_0") || is_folder(folder / "image_2")) return FolderLayout::kKitti;
  if (is_file(folder / "camera-intrinsics.txt") || has_numbered_frames(folder))
    return FolderLayout::kSevenScenes;
  return FolderLayout::kEuroc;
}

std::string to_string(FolderLayout layout) {
  switch (layout) {
    case FolderLayout::kEuroc:
      return "a folder in EuRoC's layout";
    case FolderLayout::kKitti:
      return "a folder in KITTI's layout";
    case FolderLayout::kTum:
      return "a folder in the layout of TUM RGB-D";
    case FolderLayout::kSevenScenes:
      return "a folder in the layout of 7-Scenes";
  }
  return "a folder";
}

// Counts the images from `number` on, which follow the last row of the times.
void count_images_without_time(const fs::path& images, int number, ImageFolder& recording) {
  for (fs::path image; is_file(image = image_file(images, six_digits(number))); ++number)
    recording.report.add(ReaderFault::kImageWithoutTime,
                         image.string() + ": no time in " + recording.list.string());
}

ImageFolder read_kitti_folder(const fs::path& folder) {
  const bool is_gray = is_folder(folder / "image_0");
  const std::array<std::string, 2> numbers = {is_gray ? "0" : "2", is_gray ? "1" : "3"};
  const std::array<fs::path, 2> images = {folder / ("image_" + numbers[0]),
                                          folder / ("image_" + numbers[1])};
  if (!is_folder(images[1]))
    throw DatasetError(images[1].string() +
                       ": no such folder: one camera alone does not measure distances");
  ImageFolder result;
  result.name = result.list = folder / "times.txt";
  const std::vector<ListedFile> times = read_times(result.list, 1, result.report);
  for (const ListedFile& row : times) {
    const std::string stem = six_digits(row.index);
    result.frames.push_back({.stamp = row.stamp,
                             .left = image_file(images[0], stem),
                             .right = image_file(images[1], stem),
                             .line = row.line,
                             .depth = {},
                             .labels = {}});
  }
  count_images_without_time(images[0], times.back().index + 1, result);
  const fs::path calib = folder / "calib.txt";
  const std::array<ListedProjection, 2> P = {read_projection(calib, "P" + numbers[0]),
                                             read_projection(calib, "P" + numbers[1])};
  auto& cameras = result.rig.stereo.cameras;
  cameras[0] = camera_of(calib, P[0], first_image(result.frames, &StereoPairFile::left));
  cameras[1] = camera_of(calib, P[1], first_image(result.frames, &StereoPairFile::right));
  const Eigen::Vector3d origin = cameras[0].T_body_cam.translation();
  for (Camera& camera : cameras) camera.T_body_cam.translation() -= origin;
  if (const auto problem = pair_problem(result.rig.stereo))
    refuse(calib, P[1].line, "P" + numbers[1] + " " + *problem);
  result.rig.has_imu = false;
  return result;
}

std::optional<DepthCamera> tum_camera(const fs::path& folder) {
  // Intrinsics of the colour cameras and the scale of depth images, from the benchmark's page on
  // file formats. Its depth images have been scaled already.
  struct Known {
    const char* name;
    double fx, fy, cx, cy;
    std::vector<double> distortion;  // k1, k2, p1, p2, k3
  };
  const std::array<Known, 3> known = {
      {{"freiburg1", 517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
       {"freiburg2", 520.9, 521.0, 325.1, 249.7, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}},
       {"freiburg3", 535.4, 539.2, 320.1, 247.6, {0.0, 0.0, 0.0, 0.0, 0.0}}}};
  const std::string name = (folder / "").parent_path().filename();
  for (const Known& camera : known) {
    if (name.find(camera.name) == name.npos) continue;
    return DepthCamera{.camera = {.width = 640,
                                  .height = 480,
                                  .fx = camera.fx,
                                  .fy = camera.fy,
                                  .cx = camera.cx,
                                  .cy = camera.cy,
                                  .lens = Lens(LensModel::kRadialTangential, camera.distortion)},
                       .depth_scale_m = 1.0 / 5000.0,
                       .range = {0.0, kStructuredLightRange_m}};
  }
  return std::nullopt;
}

ImageFolder read_tum_folder(const fs::path& folder, const DepthCamera& camera) {
  ImageFolder result;
  result.name = result.list = folder / "rgb.txt";
  const auto depths = read_times(folder / "depth.txt", 2, result.report);
  for (const ListedFile& row : read_times(result.list, 2, result.report)) {
    const ListedFile* depth = nearest(depths, row.stamp);
    result.frames.push_back({.stamp = row.stamp,
                             .left = folder / row.value,
                             .right = {},
                             .line = row.line,
                             .depth = depth != nullptr ? folder / depth->value : fs::path(),
                             .labels = {}});
  }
  result.rig = rgbd_sensors(camera);
  result.depth_scale_m = camera.depth_scale_m;
  return result;
}

ImageFolder read_seven_scenes_folder(const fs::path& folder) {
  ImageFolder result;
  result.name = result.list = folder;
  DepthCamera camera{.camera = read_seven_scenes_camera(folder / "camera-intrinsics.txt"),
                     .range = {0.0, kStructuredLightRange_m}};
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const auto number = frame_number(entry->path(), ".color.");
    if (!number) continue;
    const std::string stem = "frame-" + six_digits(*number);
    result.frames.push_back({.stamp = nanoseconds(*number / kSevenScenesRate_hz),
                             .left = entry->path(),
                             .right = {},
                             .line = *number,
                             .depth = folder / (stem + ".depth.png"),
                             .labels = {}});
  }
  if (result.frames.empty())
    throw DatasetError(folder.string() + ": no image frame-NNNNNN.color.png or .jpg in it");
  std::ranges::sort(result.frames, {}, &StereoPairFile::stamp);
  take_size(result.frames.front().left, camera.camera);
  result.rig = rgbd_sensors(camera);
  return result;
}

}  // namespace km
