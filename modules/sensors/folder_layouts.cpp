#include "modules/sensors/folder_layouts.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <sstream>
#include <utility>
#include <variant>

#include "modules/core/camera/calibration_limits.hpp"
#include "modules/core/camera/image_size.hpp"
#include "modules/core/data/imu_limits.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Precondition: `frames` is not empty.
void keep_part(const RecordingPart& part, const std::string& recording,
               std::vector<StereoPairFile>& frames) {
  part.check(recording);
  const Stamp start = frames.front().stamp;
  const double end_s = seconds_between(start, frames.back().stamp);
  std::erase_if(frames, [&](const StereoPairFile& frame) {
    const double t_s = seconds_between(start, frame.stamp);
    return t_s < part.from_s || t_s >= part.to_s ||
           (part.not_before && frame.stamp < *part.not_before);
  });
  if (!frames.empty()) return;
  std::ostringstream message;
  message << recording << ": no stereo pair from " << part.from_s << " s to "
          << (std::isinf(part.to_s) ? "the end" : fixed(part.to_s, 3) + " s")
          << "; the recording has them from 0 s to " << end_s << " s";
  throw DatasetError(message.str());
}

// Throws unless a frame has its depth image on disk.
void check_depth_images(const std::string& recording, const std::vector<StereoPairFile>& frames) {
  const StereoPairFile* first = nullptr;  // first frame whose depth image is missing
  for (const StereoPairFile& frame : frames) {
    if (is_file(frame.depth)) return;
    if (first == nullptr && !frame.depth.empty()) first = &frame;
  }
  throw DatasetError(recording + ": no depth image for any of " + std::to_string(frames.size()) +
                     " images" +
                     (first != nullptr ? ", first: " + first->depth.string() + ": no such image"
                                       : ": the stamps of depth images are too far away"));
}

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
  return std::ranges::any_of(entries_of(folder), [](const fs::path& file) {
    return frame_number(file, ".color.") || frame_number(file, ".depth.");
  });
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
  ReaderReport faults;
  for (const auto& row :
       read_ordered_rows<ImuSample>(file, 7, "holds no inertial sample", faults, parse_imu))
    stream.add({row.stamp, row.value.gyro, row.value.accel});
  for (const auto& [fault, entry] : faults.entries())
    report.add(fault_of_samples(fault), entry.first, entry.count);
  return stream;
}

// Recordings in `folder`, for the message if the user named a folder of recordings.
std::string recordings_below(const fs::path& folder) {
  std::vector<std::string> names;
  for (const fs::path& entry : entries_of(folder))
    if (is_folder(entry / "mav0")) names.push_back(entry.filename());
  constexpr std::size_t kMost = 5;
  std::string text;
  for (std::size_t k = 0; k < std::min(names.size(), kMost); ++k)
    text += (k == 0 ? ", but in it are " : ", ") + names[k];
  return text + (names.size() > kMost ? " and others" : "");
}

}  // namespace

LoadedImage<StereoFrame> load_stereo_pair(const StereoPairFile& files, const StereoRig& rig) {
  LoadedImage<StereoFrame> result;
  result.image.stamp = files.stamp;
  const std::pair<const fs::path&, GrayImage&> images[] = {{files.left, result.image.left},
                                                           {files.right, result.image.right}};
  const std::size_t count = rig.depth_source == DepthSource::kRightImage ? 2 : 1;
  for (std::size_t i = 0; i < count; ++i) {
    const Camera& camera = rig.cameras[i];
    ImageResult loaded = load_gray_image(images[i].first, camera.width, camera.height);
    if (loaded.fault) return {loaded.fault, std::move(loaded.problem), {}};
    images[i].second = std::move(loaded.image);
  }
  result.image.decode_color = [file = files.left,
                               size = cv::Size(rig.cameras[0].width, rig.cameras[0].height)] {
    return color_image_of(decode_image(file, DecodedPixels::kEightBits, size));
  };
  return result;
}

FolderReader::FolderReader(ImageFolder folder, const RecordingPart& part)
    : folder_(std::move(folder)) {
  const std::string name = folder_.name.string();
  if (folder_.is_rgbd()) check_depth_images(name, folder_.frames);
  keep_part(part, name, folder_.frames);
}

bool FolderReader::has_imu(const StereoPairFile& files) {
  if (!folder_.rig.has_imu) return true;
  const std::string why = folder_.imu.why_not(files.stamp);
  if (why.empty()) return true;
  folder_.report.add(ReaderFault::kPairWithoutImu,
                     at_line(folder_.list, files.line) + ": the inertial samples " + why);
  return false;
}

std::vector<ImuSample> FolderReader::imu_until(Stamp stamp) {
  if (!folder_.rig.has_imu) return {};
  std::vector<ImuSample> samples = folder_.imu.until(stamp);
  folder_.imu.report_gaps(samples, folder_.rig.imu.rate_hz, folder_.imu_list.string(),
                          folder_.report);
  return samples;
}

void FolderReader::load_depth(const fs::path& file, StereoFrame& frame) {
  DepthResult loaded = load_depth_image(file, frame.left.width, frame.left.height,
                                        folder_.depth_scale_m, *folder_.rig.depth);
  if (!loaded.fault)
    frame.depth = std::make_shared<const DepthImage>(std::move(loaded.image));
  else
    folder_.report.add(*loaded.fault, loaded.problem);
}

void FolderReader::load_labels(const fs::path& file, StereoFrame& frame) {
  LabelResult loaded = load_label_image(file, frame.left.width, frame.left.height, folder_.palette);
  if (loaded.unknown_pixels > 0)
    folder_.report.add(ReaderFault::kUnknownColor,
                       file.string() + ": " + std::to_string(loaded.unknown_pixels) + " pixels");
  if (!loaded.fault)
    frame.labels = std::make_shared<const LabelImage>(std::move(loaded.image));
  else
    folder_.report.add(*loaded.fault, loaded.problem);
}

std::optional<SensorPacket> FolderReader::next(const ChooseUse& choose) {
  while (next_ < folder_.frames.size()) {
    const StereoPairFile& files = folder_.frames[next_++];
    if (!has_imu(files)) continue;
    const FrameUse use = choose(files.stamp, 0);
    if (use == FrameUse::kNone) continue;
    LoadedImage<StereoFrame> loaded = load_stereo_pair(files, folder_.rig.stereo);
    if (loaded.fault) {
      folder_.report.add(*loaded.fault, at_line(folder_.list, files.line) + ": " + loaded.problem);
      continue;
    }
    const bool has_all = use == FrameUse::kAll || folder_.is_rgbd();
    if (has_all && !files.depth.empty()) load_depth(files.depth, loaded.image);
    if (has_all && !files.labels.empty()) load_labels(files.labels, loaded.image);
    return SensorPacket{std::make_shared<const StereoFrame>(std::move(loaded.image)),
                        imu_until(files.stamp)};
  }
  return std::nullopt;
}

FolderLayout layout_of(const fs::path& folder) {
  if (is_there(folder / "mav0") || is_there(folder / "cam0")) return FolderLayout::kEuroc;
  if (is_file(folder / "rgb.txt")) return FolderLayout::kTum;
  if (is_folder(folder / "image_0") || is_folder(folder / "image_2")) return FolderLayout::kKitti;
  if (is_file(folder / "camera-intrinsics.txt") || has_numbered_frames(folder))
    return FolderLayout::kSevenScenes;
  return FolderLayout::kEuroc;
}

std::string to_string(FolderLayout layout) {
  constexpr std::array kNames = {
      "a folder in EuRoC's layout", "a folder in KITTI's layout",
      "a folder in the layout of TUM RGB-D",
      "a folder in the layout of 7-Scenes"};  // in the order of FolderLayout
  return kNames.at(static_cast<std::size_t>(layout));
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
  for (const fs::path& entry : entries_of(folder)) {
    const auto number = frame_number(entry, ".color.");
    if (!number) continue;
    const std::string stem = "frame-" + six_digits(*number);
    result.frames.push_back({.stamp = nanoseconds(*number / kSevenScenesRate_hz),
                             .left = entry,
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
