#include "modules/sensors/node/rig_calibration.hpp"

#include "modules/core/input_file.hpp"
#include "modules/sensors/node/open_folder.hpp"

namespace km {
namespace {

constexpr const char* kExpected =
    "expected a folder with sensor.yaml of cam0, cam1 and imu0 (EuRoC), one or two YAML files of "
    "Kalibr with cam0, cam1 and imu0, or a JSON file of Basalt with value0";

RigCalibration read_maps(const std::vector<CalibrationMap>& maps, const RigChoice& choice) {
  const CalibrationMap& first = maps.front();
  if (first.has("T_BS"))
    throw DatasetError(first.file().string() +
                       ": one sensor.yaml of several; give the folder that holds cam0, cam1 and "
                       "imu0");
  if (!first.has("value0")) return read_kalibr(maps, choice);
  if (maps.size() > 1)
    throw DatasetError(maps[1].file().string() + ": a second file beside one of Basalt");
  return read_basalt(first, choice);
}

}  // namespace

RigCalibration read_rig(const std::vector<std::filesystem::path>& files, const RigChoice& choice) {
  if (files.empty()) throw DatasetError(std::string("no file of calibration: ") + kExpected);
  if (files.size() == 1 && is_folder(files[0]))
    return read_euroc_calibration(find_mav0(files[0]), choice);
  std::vector<CalibrationMap> maps;
  for (const std::filesystem::path& file : files) maps.emplace_back(file);
  return read_maps(maps, choice);
}

RigCalibration read_inline_rig(const CalibrationMap& map, const RigChoice& choice) {
  return read_maps({map}, choice);
}

std::optional<std::string> join_cameras(const Camera& left, const std::optional<Camera>& right,
                                        const RigChoice& choice, SensorRig& rig) {
  if (choice.depth) rig.depth = choice.depth->range;
  if (!right) {
    rig.stereo = rgbd_rig(left, choice.depth.value_or(DepthChoice{}).virtual_baseline_m);
    return std::nullopt;
  }
  rig.stereo = {.cameras = {left, *right}};
  return pair_problem(rig.stereo);
}

}  // namespace km
