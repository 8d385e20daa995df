#include "modules/sensors/rgbd_folder_reader.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "modules/core/lie.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/sensors/decoded_image.hpp"
#include "modules/sensors/depth_file.hpp"
#include "modules/sensors/image_file.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxNonOrthonormality = 1e-2;  // poses of a tracker, not a calibration
constexpr double kMillimetre_m = 1e-3;

// The number of "frame-NNNNNN.color.png".
std::optional<int> frame_number(const std::string& name) {
  constexpr std::string_view kStart = "frame-";
  const auto end = name.find(".color.");
  if (!name.starts_with(kStart) || end == name.npos) return std::nullopt;
  const auto number =
      parse_int64(std::string_view(name).substr(kStart.size(), end - kStart.size()));
  if (!number || *number < 0 || *number > 1'000'000'000) return std::nullopt;
  return static_cast<int>(*number);
}

struct ParsedNumbers {
  std::vector<double> values;
  std::string problem;  // empty: none
};

ParsedNumbers parse_numbers(std::span<const std::string_view> fields) {
  ParsedNumbers parsed;
  for (const std::string_view field : fields) {
    const auto value = parse_double(field);
    if (!value) return {{}, std::string(field) + " is not a number"};
    parsed.values.push_back(*value);
  }
  return parsed;
}

// All numbers of a file, row by row.
ParsedNumbers parse_file(const fs::path& file) {
  const std::string text = read_file(file);
  ParsedNumbers all;
  for (const TextRow& row : split_rows(text)) {
    ParsedNumbers parsed = parse_numbers(row.fields);
    if (!parsed.problem.empty()) return {{}, at_line(file, row.line) + ": " + parsed.problem};
    all.values.insert(all.values.end(), parsed.values.begin(), parsed.values.end());
  }
  return all;
}

struct ParsedPose {
  std::optional<SE3> T;
  std::string problem;
};

// Of the first three rows of a pose.
ParsedPose parse_pose(std::span<const double> values) {
  const Eigen::Matrix<double, 3, 4> T =
      Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(values.data());
  if (!T.allFinite()) return {std::nullopt, "the pose is not finite"};
  const Eigen::Matrix3d R = T.leftCols<3>();
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (error > kMaxNonOrthonormality || R.determinant() < 0.0)
    return {std::nullopt, "the pose is not rigid: |R R^T - I| = " + std::to_string(error)};
  return {make_pose(nearest_rotation(R), T.col(3)), {}};
}

}  // namespace

RgbdFolderReader::RgbdFolderReader(const fs::path& folder, const RgbdFolderOptions& options)
    : folder_(folder), options_(options) {
  if (!(options.rate_hz > 0.0) || !(options.range.min_m < options.range.max_m))
    throw std::invalid_argument("RgbdFolderReader: a rate of " + std::to_string(options.rate_hz) +
                                " Hz and depths from " + std::to_string(options.range.min_m) +
                                " m to " + std::to_string(options.range.max_m) + " m");
  list_frames();
  read_intrinsics();
  read_poses();
}

void RgbdFolderReader::list_frames() {
  if (!fs::is_directory(folder_)) throw DatasetError(folder_.string() + ": no such folder");
  for (const auto& entry : fs::directory_iterator(folder_))
    if (const auto number = frame_number(entry.path().filename().string()))
      frames_.push_back({*number, entry.path()});
  if (frames_.empty())
    throw DatasetError(folder_.string() + ": no image frame-NNNNNN.color.png or .jpg");
  std::sort(frames_.begin(), frames_.end(), [](const FrameFile& a, const FrameFile& b) {
    return std::pair(a.number, a.color) < std::pair(b.number, b.color);
  });
  const auto same = [](const FrameFile& a, const FrameFile& b) { return a.number == b.number; };
  frames_.erase(std::unique(frames_.begin(), frames_.end(), same), frames_.end());
}

void RgbdFolderReader::read_intrinsics() {
  const fs::path file = folder_ / "camera-intrinsics.txt";
  const auto [K, problem] = parse_file(file);
  if (!problem.empty()) throw DatasetError(problem);
  const bool is_matrix = K.size() == 9 && K[0] > 0.0 && K[4] > 0.0 && K[3] == 0.0 && K[6] == 0.0 &&
                         K[7] == 0.0 && K[8] == 1.0 && std::isfinite(K[0] + K[2] + K[4] + K[5]);
  if (!is_matrix)
    throw DatasetError(file.string() + ": not a 3x3 matrix of intrinsics, fx 0 cx; 0 fy cy; 0 0 1");
  // The files do not say how large the images are: the first that can be read does.
  for (const FrameFile& frame : frames_) {
    const auto loaded = decode_image(frame.color, cv::IMREAD_GRAYSCALE, {});
    if (loaded.status != ImageStatus::kOk) continue;
    const PinholeCamera camera{.width = loaded.image.cols,
                               .height = loaded.image.rows,
                               .fx = K[0],
                               .fy = K[4],
                               .cx = K[2],
                               .cy = K[5]};
    rig_ = rgbd_rig(camera, options_.baseline_m);
    return;
  }
  throw DatasetError(folder_.string() + ": no colour image can be decoded");
}

void RgbdFolderReader::read_poses() {
  const fs::path file = folder_ / "poses.txt";
  if (!fs::exists(file)) return;  // a file for each frame, then
  const std::string text = read_file(file);
  for (const TextRow& row : split_rows(text)) {
    const auto count = [&](const std::string& problem) {
      report_.add(ReaderFault::kMalformedRow, at_line(file, row.line) + ": " + problem);
    };
    const auto number = parse_int64(row.fields.front());
    if (!number || row.fields.size() != 13) {
      count("not a frame number and the 12 numbers of a pose");
      continue;
    }
    const auto [values, problem] = parse_numbers(std::span(row.fields).subspan(1));
    const ParsedPose pose =
        problem.empty() ? parse_pose(values) : ParsedPose{std::nullopt, problem};
    if (pose.T)
      poses_[static_cast<int>(*number)] = *pose.T;
    else
      count(pose.problem);
  }
}

fs::path RgbdFolderReader::beside(const FrameFile& file, const char* ending) const {
  const std::string name = file.color.filename().string();
  return folder_ / (name.substr(0, name.find(".color.")) + ending);
}

std::optional<SE3> RgbdFolderReader::pose_file(const fs::path& file) {
  const auto [values, problem] = parse_file(file);
  const ParsedPose pose = !problem.empty()      ? ParsedPose{std::nullopt, problem}
                          : values.size() == 16 ? parse_pose(std::span(values).first(12))
                                                : ParsedPose{std::nullopt, "not a 4x4 matrix"};
  if (!pose.T) report_.add(ReaderFault::kWithoutPose, file.string() + ": " + pose.problem);
  return pose.T;
}

std::optional<SE3> RgbdFolderReader::pose_of(const FrameFile& file) {
  if (const auto listed = poses_.find(file.number); listed != poses_.end()) return listed->second;
  const fs::path own = beside(file, ".pose.txt");
  if (fs::exists(own)) return pose_file(own);
  report_.add(ReaderFault::kWithoutPose, file.color.string());
  return std::nullopt;
}

std::optional<PosedFrame> RgbdFolderReader::next() {
  const PinholeCamera& camera = rig_.cameras[0];
  while (next_frame_ < frames_.size()) {
    const FrameFile& file = frames_[next_frame_++];
    const std::optional<SE3> T_world_cam = pose_of(file);
    if (!T_world_cam) continue;
    ImageResult gray = load_gray_image(file.color, camera.width, camera.height);
    if (gray.status != ImageStatus::kOk) {
      report_.add(fault_of(gray.status), gray.problem);
      continue;
    }
    StereoFrame frame{nanoseconds(file.number / options_.rate_hz), std::move(gray.image), {}};
    DepthResult depth = load_depth_image(beside(file, ".depth.png"), camera.width, camera.height,
                                         kMillimetre_m, options_.range);
    if (depth.status == ImageStatus::kOk)
      frame.depth = std::make_shared<const DepthImage>(std::move(depth.image));
    else
      report_.add(fault_of(depth.status), depth.problem);
    return PosedFrame{std::make_shared<const StereoFrame>(std::move(frame)), *T_world_cam};
  }
  return std::nullopt;
}

}  // namespace km
