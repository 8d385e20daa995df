#include "modules/sensors/rig_calibration_codec.hpp"

#include "modules/core/input_file.hpp"
#include "modules/sensors/calibration_map_codec.hpp"
#include "modules/sensors/euroc_rig_codec.hpp"

namespace km {
namespace {

constexpr const char* kExpected =
    "expected a folder with sensor.yaml of cam0, cam1 and imu0 (EuRoC), one or two YAML files of "
    "Kalibr with cam0, cam1 and imu0, or a JSON file of Basalt with value0";

RigCalibration read_folder(const std::filesystem::path& folder) {
  const std::filesystem::path mav0 = find_mav0(folder);
  return {.rig = read_euroc_rig(mav0, is_there(mav0 / "depth0")),
          .image_time_offset_s = std::nullopt,
          .image_topics = {},
          .imu_topic = {},
          .notes = {}};
}

}  // namespace

RigCalibration read_rig(const std::vector<std::filesystem::path>& files, const RigChoice& choice) {
  if (files.empty()) throw DatasetError(std::string("no file of calibration: ") + kExpected);
  if (files.size() == 1 && is_folder(files[0])) return read_folder(files[0]);
  const CalibrationMap first(files[0]);
  if (first.has("value0")) {
    if (files.size() > 1)
      throw DatasetError(files[1].string() + ": a second file beside one of Basalt");
    return read_basalt(files[0], choice);
  }
  if (first.has("T_BS"))
    throw DatasetError(files[0].string() +
                       ": one sensor.yaml of several; give the folder that holds cam0, cam1 and "
                       "imu0");
  return read_kalibr(files, choice);
}

}  // namespace km
