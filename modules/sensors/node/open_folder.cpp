#include "modules/sensors/node/open_folder.hpp"

#include <utility>

#include "modules/core/calibration_limits.hpp"
#include "modules/core/input_file.hpp"
#include "modules/sensors/node/euroc_rig.hpp"
#include "modules/sensors/node/read_camera.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

DepthCamera read_depth_camera(const fs::path& file) {
  const CalibrationMap yaml(file);
  DepthCamera result;
  result.camera = read_camera(yaml, "distortion_coefficients");
  constexpr double kTumScale_m = 1.0 / 5000.0;
  constexpr double kStructuredLightRange_m = 8.0;
  result.depth_scale_m = yaml.number("depth_scale", kDepthScale_m, kTumScale_m);
  result.range = read_depth_range(yaml, kStructuredLightRange_m);
  result.baseline_m = yaml.number("baseline_m", kDepthBaseline_m, result.baseline_m);
  return result;
}

DepthCamera depth_camera_of(const fs::path& folder, const fs::path& file) {
  if (!file.empty()) return read_depth_camera(file);
  if (auto known = tum_camera(folder)) return *std::move(known);
  throw DatasetError(folder.string() +
                     ": a folder in TUM's layout has no calibration: name it after its camera "
                     "(freiburg1, freiburg2 or freiburg3 in its name), or describe the camera by "
                     "--rig FILE (see Inputs in apps/robot/README.md)");
}

}  // namespace

ImageFolder read_image_folder(const fs::path& folder, const fs::path& camera_file) {
  const FolderLayout layout = layout_of(folder);
  if (layout == FolderLayout::kTum)
    return read_tum_folder(folder, depth_camera_of(folder, camera_file));
  if (!camera_file.empty())
    throw DatasetError(camera_file.string() + ": not for " + to_string(layout) +
                       ", which has its calibration: leave --rig out");
  return layout == FolderLayout::kKitti ? read_kitti_folder(folder)
                                        : read_seven_scenes_folder(folder);
}

std::unique_ptr<DatasetReader> open_folder(const fs::path& folder, const EurocOptions& options,
                                           const fs::path& camera_file) {
  const FolderLayout layout = layout_of(folder);
  if (layout == FolderLayout::kEuroc)
    return std::make_unique<EurocReader>(open_euroc(folder, options));
  if (options.labels)
    throw DatasetError(folder.string() + ": " + to_string(layout) + " has no label images");
  return std::make_unique<ImageFolderReader>(
      read_image_folder(folder, camera_file),
      RecordingPart{options.from_s, options.to_s, options.not_before});
}

}  // namespace km
